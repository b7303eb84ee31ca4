#include <algorithm>
#include <filesystem>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/effort/observer.h"
#include "laban/math/parallel.h"
#include "laban/math/statistics.h"
#include "laban/motion/standard_body.h"

#include "file_pattern.h"
#include "files.h"
#include "number_checks.h"
#include "verb.h"

namespace laban::cli {
namespace {

namespace fs = std::filesystem;
using base::Error;
using base::ErrorKind;

struct CorpusVerb {
  Common common;
  std::string clips;
  std::string table;  ///< fragments of a table instead of clips
  std::string pattern = "{content}_{performer}";
  std::string label = "none";
  std::string output;
  std::string blend_folder;
  std::string blend_format = "glb";
  std::vector<std::string> contents;
  int blends = 105;
  int groups = 0;
};

/// A file of the folder that fits the pattern.
struct FoundClip {
  fs::path path;
  std::map<std::string, std::string> names;
};

std::vector<FoundClip> find_clips(const CorpusVerb& verb) {
  const FilePattern pattern(verb.pattern);
  if (!pattern.has("content") && verb.groups == 0) {
    throw Error(
        ErrorKind::kUsage,
        "--pattern '" + verb.pattern +
            "' has no {content}; add it, or give --groups N to group the clips by DTW alone");
  }
  std::error_code failed;
  std::vector<FoundClip> found;
  int others = 0;
  for (const auto& entry : fs::directory_iterator(verb.clips, failed)) {
    const fs::path& path = entry.path();
    if (!entry.is_regular_file() || !io::is_motion_file(path)) continue;
    const auto names = pattern.match(path.stem().string());
    if (!names) {
      ++others;
      continue;
    }
    const auto content = names->find("content");
    if (content != names->end() && !verb.contents.empty() &&
        std::find(verb.contents.begin(), verb.contents.end(), content->second) ==
            verb.contents.end()) {
      continue;
    }
    found.push_back({path, *names});
  }
  if (failed) throw Error(ErrorKind::kIo, verb.clips + ": cannot be read: " + failed.message());
  if (found.empty()) {
    throw Error(ErrorKind::kData,
                fmt::format("{}: none of its {} motion files matches --pattern '{}'", verb.clips,
                            others, verb.pattern));
  }
  if (others > 0)
    warn(verb.common,
         fmt::format("{}: {} motion files do not match the pattern", verb.clips, others));
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.path < b.path; });
  return found;
}

std::string name_or(const std::map<std::string, std::string>& names, const std::string& key,
                    const std::string& otherwise = {}) {
  const auto found = names.find(key);
  return found == names.end() ? otherwise : found->second;
}

struct ReadFragments {
  std::vector<transfer::Fragment> fragments;
  std::vector<effort::LabelRow> rows;  ///< where each lies: clip and frames
};

/// Path of a clip as the table names it; links are kept as the user wrote them.
std::string relative_to_table(const CorpusVerb& verb, const fs::path& path) {
  const fs::path table =
      verb.output == "-" ? fs::current_path() / "table" : fs::absolute(verb.output);
  const fs::path folder = table.lexically_normal().parent_path();
  return fs::absolute(path).lexically_normal().lexically_relative(folder).generic_string();
}

/// Fragments of a table, as `laban texture fragments` writes it.
ReadFragments fragments_of_table(const CorpusVerb& verb) {
  ReadFragments read;
  const fs::path folder = fs::path(verb.table).parent_path();
  int without_content = 0;
  for (CutFragment& cut : read_table_fragments(verb.table, verb.common)) {
    const std::string& content = cut.row.content;
    if (content.empty()) ++without_content;
    if (!verb.contents.empty() &&
        std::find(verb.contents.begin(), verb.contents.end(), content) == verb.contents.end()) {
      continue;
    }
    effort::LabelRow row;
    row.clip = relative_to_table(verb, folder / cut.row.clip);
    row.begin_frame = cut.row.begin_frame;
    row.end_frame = cut.row.end_frame;
    read.rows.push_back(std::move(row));
    cut.fragment.effort = std::nullopt;
    read.fragments.push_back(std::move(cut.fragment));
  }
  if (without_content > 0) {
    throw Error(ErrorKind::kData, fmt::format("{}: {} fragments have no content; name it in its "
                                              "column",
                                              verb.table, without_content));
  }
  if (read.fragments.empty())
    throw Error(ErrorKind::kData, verb.table + ": it has no fragment of the contents asked for");
  return read;
}

ReadFragments read_fragments(const CorpusVerb& verb) {
  ReadFragments read;
  std::vector<CapturedClip> clips;
  std::vector<double> rates;
  for (const FoundClip& found : find_clips(verb)) {
    clips.push_back(read_captured_clip(found.path.string(), {}, verb.common));
    rates.push_back(clips.back().file.clip.frame_rate_hz());
    effort::LabelRow row;
    row.clip = relative_to_table(verb, found.path);
    read.rows.push_back(std::move(row));
    read.fragments.push_back({found.path.stem().string(),
                              name_or(found.names, "content"),
                              name_or(found.names, "performer", name_or(found.names, "style")),
                              {},
                              std::nullopt});
  }
  const double rate_hz = common_rate(rates);
  math::parallel_for(static_cast<int>(clips.size()), verb.common.threads, [&](int i) {
    const auto cell = static_cast<std::size_t>(i);
    read.fragments[cell].pose = clips[cell].pose(rate_hz);
  });
  return read;
}

/// Groups by DTW alone, and how well they agree with the contents that the names give.
struct Grouping {
  std::vector<int> groups;
  std::optional<double> agreement;  ///< adjusted Rand index
};

Grouping group_contents(const CorpusVerb& verb, std::vector<transfer::Fragment>& fragments) {
  Grouping grouping;
  const auto named = transfer::number_contents(fragments);
  const bool by_dtw = fragments.front().content.empty();
  const int count = by_dtw ? verb.groups : static_cast<int>(named.names.size());
  if (count > static_cast<int>(fragments.size())) {
    throw Error(ErrorKind::kUsage, "--groups is more than there are clips");
  }
  grouping.groups = transfer::cluster_contents(fragments, count, verb.common.threads);
  if (!by_dtw) {
    grouping.agreement = math::adjusted_rand_index(named.numbers, grouping.groups);
    return grouping;
  }
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    fragments[i].content = "group_" + std::to_string(grouping.groups[i] + 1);
  }
  return grouping;
}

/// Labels fragments and blends by the kinematic observer.
void measure_labels(const CorpusVerb& verb, transfer::StyleCorpus& corpus) {
  const auto seeds = static_cast<int>(corpus.fragments.size());
  const auto blends = static_cast<int>(corpus.blends.size());
  std::vector<effort::Descriptors> descriptors(static_cast<std::size_t>(seeds + blends));
  const auto progress = terminal_progress(verb.common, "measuring");
  math::parallel_for(seeds + blends, verb.common.threads, [&](int n) {
    const bool is_seed = n < seeds;
    const auto place = static_cast<std::size_t>(is_seed ? n : n - seeds);
    descriptors[static_cast<std::size_t>(n)] = effort::describe(
        is_seed ? corpus.fragments[place].pose
                : transfer::make_blend(corpus.fragments, corpus.blends[place]).pose);
  });
  std::vector<std::string> contents;
  for (const auto& fragment : corpus.fragments) contents.push_back(fragment.content);
  const auto reference = effort::fit_observer_reference(
      std::span(descriptors).first(static_cast<std::size_t>(seeds)), contents);
  for (std::size_t n = 0; n < descriptors.size(); ++n) {
    const bool is_seed = n < corpus.fragments.size();
    const std::size_t place = is_seed ? n : n - corpus.fragments.size();
    const std::size_t seed =
        is_seed ? place : static_cast<std::size_t>(corpus.blends[place].fragment_i);
    const effort::Effort effort = effort::observe(descriptors[n], reference, contents[seed]).effort;
    (is_seed ? corpus.fragments[place].effort : corpus.blends[place].effort) = effort;
  }
}

void set_effort(effort::LabelRow& row, const std::optional<effort::Effort>& effort) {
  if (!effort) return;
  // Three decimals: a label table is for reading, and no observer is that sure.
  const auto rounded = [](double value) { return std::round(value * 1000.0) / 1000.0 + 0.0; };
  row.flow = rounded(effort->flow);
  row.weight = rounded(effort->weight);
  row.time = rounded(effort->time);
  row.source = effort::LabelSource::kMeasured;
  row.observer = "kinematic";
}

fs::path blend_path(const CorpusVerb& verb, const transfer::CorpusBlend& blend) {
  return fs::path(verb.blend_folder) / (blend.name + "." + verb.blend_format);
}

effort::LabelTable make_table(const CorpusVerb& verb, const transfer::StyleCorpus& corpus,
                              const std::vector<effort::LabelRow>& places) {
  effort::LabelTable table;
  for (std::size_t i = 0; i < corpus.fragments.size(); ++i) {
    const transfer::Fragment& fragment = corpus.fragments[i];
    effort::LabelRow row = places[i];
    row.fragment = fragment.name;
    row.content = fragment.content;
    row.performer = fragment.performer;
    set_effort(row, fragment.effort);
    table.rows.push_back(row);
  }
  for (const transfer::CorpusBlend& blend : corpus.blends) {
    effort::LabelRow row;
    row.fragment = blend.name;
    if (!verb.blend_folder.empty()) row.clip = relative_to_table(verb, blend_path(verb, blend));
    row.parent_i = corpus.fragments[static_cast<std::size_t>(blend.fragment_i)].name;
    row.parent_j = corpus.fragments[static_cast<std::size_t>(blend.fragment_j)].name;
    row.content = corpus.fragments[static_cast<std::size_t>(blend.fragment_i)].content;
    row.alpha = blend.alpha;
    set_effort(row, blend.effort);
    table.rows.push_back(row);
  }
  return table;
}

void write_blends(const CorpusVerb& verb, const transfer::StyleCorpus& corpus) {
  std::error_code failed;
  fs::create_directories(verb.blend_folder, failed);
  if (failed)
    throw Error(ErrorKind::kIo, verb.blend_folder + ": cannot be made: " + failed.message());
  for (const auto& blend : corpus.blends)
    check_outputs(verb.common, {blend_path(verb, blend).string()});
  for (const auto& blend : corpus.blends) {
    write_clip(blend_path(verb, blend).string(),
               motion::to_standard_clip(transfer::make_blend(corpus.fragments, blend).pose),
               verb.common);
  }
}

void print(const CorpusVerb& verb, const transfer::StyleCorpus& corpus, const Grouping& grouping) {
  const auto contents = transfer::number_contents(corpus.fragments);
  const auto performers = transfer::number_performers(corpus.fragments);
  if (verb.common.json) {
    Json json = {{"schema", "laban.corpus/1"},
                 {"table", verb.output},
                 {"fragments", corpus.fragments.size()},
                 {"blends", corpus.blends.size()},
                 {"contents", contents.names},
                 {"performers", performers.names},
                 {"frame_rate_hz", corpus.fragments.front().pose.frame_rate_hz}};
    json["dtw_groups_adjusted_rand_index"] =
        grouping.agreement ? Json(*grouping.agreement) : Json();
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: {} fragments of {} contents by {} performers at {:g} Hz, {} blends, labels: {}\n",
             verb.output, corpus.fragments.size(), contents.names.size(), performers.names.size(),
             corpus.fragments.front().pose.frame_rate_hz, corpus.blends.size(), verb.label);
  if (!grouping.agreement) return;
  fmt::print("content groups by DTW alone: adjusted Rand index {:.3f}\n", *grouping.agreement);
  for (std::size_t g = 0; g < contents.names.size(); ++g) {
    std::map<int, int> counts;
    for (std::size_t i = 0; i < contents.numbers.size(); ++i) {
      if (contents.numbers[i] == static_cast<int>(g)) ++counts[grouping.groups[i]];
    }
    std::string line;
    for (const auto& [group, count] : counts)
      line += fmt::format(" {} in group {}", count, group + 1);
    tell(verb.common, contents.names[g] + ":" + line);
  }
}

void run(const CorpusVerb& verb) {
  if (verb.output != "-") check_outputs(verb.common, {verb.output});
  if (verb.clips.empty() == verb.table.empty()) {
    throw Error(ErrorKind::kUsage,
                "say what the fragments are: either a folder of --clips or a table of --fragments");
  }
  ReadFragments read = verb.table.empty() ? read_fragments(verb) : fragments_of_table(verb);
  const Grouping grouping = group_contents(verb, read.fragments);
  transfer::StyleCorpus corpus;
  corpus.blends =
      transfer::draw_blends(read.fragments, {.count = verb.blends, .seed = verb.common.seed});
  corpus.fragments = std::move(read.fragments);
  if (verb.label == "measured") measure_labels(verb, corpus);
  if (!verb.blend_folder.empty()) write_blends(verb, corpus);
  write_bytes(verb.output, effort::format_label_table(make_table(verb, corpus, read.rows)),
              verb.common);
  if (verb.output != "-") print(verb, corpus, grouping);
}

}  // namespace

void add_corpus(CLI::App& app) {
  auto verb = std::make_shared<CorpusVerb>();
  CLI::App* sub = add_verb(app, "corpus",
                           "Make a label table from clips or fragments, with blends to be labelled",
                           "laban corpus --clips captures --pattern '{content}_{performer}_{take}' "
                           "--label measured -o captures.csv");
  sub->add_option("--clips", verb->clips, "folder of the clips");
  sub->add_option("--fragments", verb->table,
                  "label table whose fragments are taken instead, with their contents, e.g. of "
                  "'laban texture fragments'");
  sub->add_option(
         "--pattern", verb->pattern,
         "how file names are read: {content}, {performer} or {style}, and any other {name}")
      ->capture_default_str();
  sub->add_option("--contents", verb->contents, "only these contents, e.g. walk,bow")
      ->delimiter(',');
  sub->add_option("--groups", verb->groups,
                  "without {content}: group the clips into so many contents by DTW alone")
      ->check(positive_number());
  sub->add_option("--blends", verb->blends, "blends to draw")
      ->check(number_from_0())
      ->capture_default_str();
  sub->add_option("--label", verb->label,
                  "'measured' fills labels in by the kinematic observer, 'none' leaves them blank")
      ->check(CLI::IsMember({"measured", "none"}))
      ->capture_default_str();
  sub->add_option("--write-blends", verb->blend_folder,
                  "folder to write the blends to, as clips to view");
  sub->add_option("--blend-format", verb->blend_format, "format of these clips")
      ->check(CLI::IsMember({"glb", "bvh"}))
      ->capture_default_str();
  sub->add_option("-o,--output", verb->output, "label table to write (CSV)")->required();
  add_common(sub, verb->common, {.writes = true, .threads = true, .seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
