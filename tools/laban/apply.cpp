#include <algorithm>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/draw/animation.h"
#include "laban/draw/contact_sheet.h"

#include "apply_batch.h"
#include "effort_state.h"
#include "files.h"
#include "state_reader.h"
#include "styling.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct ApplyVerb {
  Common common;
  StylingOptions styling;
  std::vector<std::string> inputs;
  WriteClipOptions writing;
  std::string output;
  std::string output_folder;
  std::string state;
  std::string report;
  std::string picture;
  std::string animation;
};

std::string picture(const ApplyVerb& verb, const Styling& styling, const StyledFile& file) {
  const auto joins = [&](auto begin_of) {
    std::vector<double> marks;
    for (std::size_t n = 1; n < file.applied.snippets.size(); ++n)
      marks.push_back(begin_of(file.applied.snippets[n]) / styling.model.frame_rate_hz());
    return marks;
  };
  const motion::Capture& capture = file.input.capture;
  const draw::Strip strips[] = {
      {with_standard_names(capture.clip, capture.humanoid), "input: " + verb.inputs.front(),
       joins([](const auto& snippet) { return snippet.begin; }), ""},
      {with_standard_names(file.styled.clip, capture.humanoid),
       "output: " + to_text(styling.options.asked, styling.asked),
       joins([](const auto& snippet) { return snippet.output_begin; }), ""}};
  draw::ContactSheetOptions options;
  options.format = is_svg(verb.picture) ? draw::Format::kSvg : draw::Format::kPng;
  return draw::contact_sheet(strips, options);
}

std::string animation(const ApplyVerb& verb, const Styling& styling, const StyledFile& file) {
  const motion::Humanoid& humanoid = file.input.capture.humanoid;
  const motion::Clip& output = file.styled.clip;
  std::vector<double> joins;
  for (const int frame : file.styled.joins) joins.push_back(frame / output.frame_rate_hz());
  const draw::AnimatedClip clips[] = {
      {with_standard_names(file.input.capture.clip, humanoid),
       "input: " + verb.inputs.front(),
       "",
       humanoid,
       {}},
      {with_standard_names(output, humanoid), "output: " + verb.output,
       "asked: " + to_text(styling.options.asked, styling.asked), humanoid, std::move(joins)}};
  return draw::animation(clips, {.source_frames = file.styled.source_frames});
}

void apply_one(const ApplyVerb& verb) {
  check_outputs(verb.common, {verb.output, verb.report, verb.picture, verb.animation});
  (void)check_clip_output(verb.output, verb.writing);
  if (!verb.picture.empty()) (void)is_svg(verb.picture);
  const Styling styling = read_styling(verb.styling);
  const StyledFile file = style_file(styling, verb.inputs.front(), verb.common,
                                     terminal_progress(verb.common, "styling").get());
  for (const std::string& caution : cautions(styling, file.applied, verb.inputs.front()))
    warn(verb.common, caution);
  write_styled(file, verb.output, verb.writing, verb.common);
  const std::string json = report_json(styling, file).dump(2) + "\n";
  if (!verb.report.empty()) write_bytes(verb.report, json, verb.common);
  if (!verb.picture.empty()) write_bytes(verb.picture, picture(verb, styling, file), verb.common);
  if (!verb.animation.empty())
    write_bytes(verb.animation, animation(verb, styling, file), verb.common);
  if (verb.output == "-") return;
  fmt::print("{}", verb.common.json ? json : report_text(styling, file));
}

void run(ApplyVerb& verb) {
  using base::Error;
  using base::ErrorKind;
  if (!verb.state.empty()) {
    EffortState state = parse_effort_state(read_bytes(verb.state), verb.state);
    verb.styling = std::move(state.styling);
    if (verb.inputs.empty()) verb.inputs = {std::move(state.input)};
  }
  if (verb.inputs.empty()) throw CLI::RequiredError("INPUT");
  if (verb.output.ends_with('/')) std::swap(verb.output, verb.output_folder);
  if (verb.output_folder.empty()) {
    if (verb.inputs.size() > 1 || std::filesystem::is_directory(verb.inputs.front()))
      throw Error(ErrorKind::kUsage, "several clips need --output-dir DIR instead of -o");
    if (verb.output.empty())
      throw Error(ErrorKind::kUsage, "no output given; -o FILE, or --output-dir DIR for several");
    return apply_one(verb);
  }
  if (!verb.report.empty() || !verb.picture.empty() || !verb.animation.empty()) {
    throw Error(ErrorKind::kUsage,
                "--report, --picture and --animate are of one clip; --output-dir writes a table of "
                "results");
  }
  apply_batch(verb.styling, {verb.inputs, verb.output_folder, verb.writing}, verb.common);
}

}  // namespace

void add_apply(CLI::App& app) {
  auto verb = std::make_shared<ApplyVerb>();
  CLI::App* sub =
      add_verb(app, "apply", "Give a clip a target Effort: the same action, done another way",
               "laban apply walk.bvh --flow -2 --weight 1.5 --time 2 -o walk_sudden.glb");
  sub->add_option("INPUT", verb->inputs, "clip, '-' for stdin; or several, or folders of clips");
  CLI::Option* output =
      sub->add_option("-o,--output", verb->output, "clip to write (.bvh or .glb), '-' for stdout");
  sub->add_option("--output-dir", verb->output_folder,
                  "folder to write clips to, with a table of results, summary.csv; clips that are "
                  "there from the same input with the same options are skipped")
      ->excludes(output);
  sub->add_option("--report", verb->report, "JSON report to write");
  sub->add_option("--picture", verb->picture,
                  "contact sheet to write (.png or .svg): input above output");
  sub->add_option("--animate", verb->animation,
                  "page to write (.html): input beside output, playing in any browser");
  const std::vector<CLI::Option*> others = sub->get_options();
  add_styling_options(sub, verb->styling);
  add_state_option(sub, verb->state, "Effort room", others);
  add_write_options(sub, verb->writing);
  add_common(sub, verb->common, {.writes = true, .threads = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
