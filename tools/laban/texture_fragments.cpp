#include <cmath>
#include <filesystem>

#include <fmt/core.h>

#include "laban/effort/label_table.h"

#include "number_checks.h"
#include "texture.h"

namespace laban::cli {
namespace {

namespace fs = std::filesystem;

struct TextureFragmentsVerb {
  Common common;
  std::string input;
  std::string output;
  std::string clips;
  int least = 1;
};

/// Path of a clip as the table names it.
std::string relative_to(const std::string& table, const fs::path& clip) {
  const fs::path file = table == "-" ? fs::current_path() / "table" : fs::absolute(table);
  const fs::path folder = file.lexically_normal().parent_path();
  return fs::absolute(clip).lexically_normal().lexically_relative(folder).generic_string();
}

/// The take's own frame at which a frame of the texture lies.
int file_frame(const texture::Take& take, int frame) {
  return take.first_file_frame +
         static_cast<int>(std::lround(take.file_frames_per_frame * (frame - take.begin)));
}

effort::LabelTable cut(const TextureFragmentsVerb& verb, const texture::MotionTexture& texture) {
  std::vector<int> counts(texture.textons.size());
  for (const texture::Segment& segment : texture.segments)
    ++counts[static_cast<std::size_t>(segment.texton)];
  effort::LabelTable table;
  std::size_t take = 0;
  for (const texture::Segment& segment : texture.segments) {
    while (segment.begin >= texture.takes[take].begin + texture.takes[take].length) ++take;
    if (counts[static_cast<std::size_t>(segment.texton)] < verb.least) continue;
    const texture::Take& from = texture.takes[take];
    const fs::path named(from.name);
    const std::string stem = named.stem().string();
    effort::LabelRow row;
    row.begin_frame = file_frame(from, segment.begin);
    row.end_frame = file_frame(from, segment.begin + segment.length - 1) + 1;
    row.fragment = fmt::format("{}_{}", stem, *row.begin_frame);
    row.clip = relative_to(verb.output,
                           verb.clips.empty() ? named : fs::path(verb.clips) / named.filename());
    row.content = fmt::format("texton_{:03}", segment.texton);
    row.performer = stem;
    table.rows.push_back(std::move(row));
  }
  return table;
}

void run(const TextureFragmentsVerb& verb) {
  if (verb.output != "-") check_outputs(verb.common, {verb.output});
  InputRecord record;
  const texture::MotionTexture texture = read_texture_file(verb.input, record);
  const effort::LabelTable table = cut(verb, texture);
  if (table.rows.empty()) {
    throw base::Error(base::ErrorKind::kData,
                      fmt::format("{}: no texton has {} segments; lower --least or learn with a "
                                  "larger --threshold",
                                  verb.input, verb.least));
  }
  write_bytes(verb.output, effort::format_label_table(table), verb.common);
  if (verb.output == "-") return;
  std::vector<std::string> contents;
  for (const effort::LabelRow& row : table.rows) contents.push_back(row.content);
  std::sort(contents.begin(), contents.end());
  contents.erase(std::unique(contents.begin(), contents.end()), contents.end());
  if (verb.common.json) {
    const Json json = {{"schema", "laban.texture_fragments/1"},
                       {"table", verb.output},
                       {"fragments", table.rows.size()},
                       {"contents", contents},
                       {"left_out", texture.segments.size() - table.rows.size()}};
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: {} fragments of {} contents", verb.output, table.rows.size(), contents.size());
  if (table.rows.size() < texture.segments.size()) {
    fmt::print("; {} segments of rarer textons left out",
               texture.segments.size() - table.rows.size());
  }
  fmt::print("\n");
}

}  // namespace

void add_texture_fragments(CLI::App* texture) {
  auto verb = std::make_shared<TextureFragmentsVerb>();
  CLI::App* sub =
      add_verb(*texture, "fragments",
               "Cut the captures into fragments to be labelled, a content for each texton",
               "laban texture fragments dance.texture --labels fragments.csv");
  sub->add_option("TEXTURE", verb->input, "texture file (.texture)")->required();
  sub->add_option("--labels,-o,--output", verb->output,
                  "label table to write (CSV), '-' for stdout")
      ->required();
  sub->add_option("--clips", verb->clips,
                  "folder that the captures are in now (default: where they were learnt from)");
  sub->add_option("--least", verb->least, "only textons with so many segments")
      ->check(positive_number())
      ->capture_default_str();
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
