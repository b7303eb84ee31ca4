#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/draw/animation.h"
#include "laban/draw/contact_sheet.h"
#include "laban/transfer/styled_clip.h"

#include "files.h"
#include "report.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct ApplyVerb {
  Common common;
  ReadClipOptions reading;
  std::string input;
  WriteClipOptions writing;
  std::string output;
  std::string model;
  std::string report;
  std::string picture;
  std::string animation;
  transfer::EffortTarget target;
  transfer::ApplyOptions options;
  bool no_foot_fix = false;
};

Json report_json(const ApplyVerb& verb, const transfer::StyleModel& model,
                 const transfer::AppliedStyle& applied, const transfer::StyledQuality& quality,
                 const std::vector<InputRecord>& inputs) {
  Json json = {
      {"schema", "laban.apply/1"}, {"asked", to_json(verb.target)}, {"snippets", Json::array()}};
  for (const auto& snippet : applied.snippets) json["snippets"].push_back(to_json(snippet, model));
  json["quality"] = to_json(quality);
  json["frame_rate_hz"] = model.frame_rate_hz();
  json["regressor"] = effort::name_of(model.regressor.kind());
  json["run"] = run_record("apply",
                           {{"neighbours", verb.options.search.neighbors},
                            {"samples", verb.options.search.samples},
                            {"strict", verb.options.strict},
                            {"join_halflife_s", verb.options.join.halflife_s},
                            {"fastest_play", verb.options.fastest_play},
                            {"foot_fix", !verb.no_foot_fix}},
                           inputs);
  return json;
}

void print(const ApplyVerb& verb, const transfer::StyleModel& model,
           const transfer::AppliedStyle& applied, const transfer::StyledQuality& quality) {
  fmt::print("asked: {}\n", to_text(verb.target));
  fmt::print("{:>5} {:>5}  {:<10} {:<44} {:>6}  {:<19} {:<19} {}\n", "begin", "end", "content",
             "blend", "alpha", "predicted (F W T)", "measured", "input measured");
  for (const transfer::AppliedSnippet& snippet : applied.snippets) {
    const double rate = model.frame_rate_hz();
    const auto name = [&](int fragment) {
      return model.fragments[static_cast<std::size_t>(fragment)].name;
    };
    const transfer::BlendChoice& choice = snippet.choice;
    std::string pair = choice.is_seed() ? name(choice.fragment_i)
                                        : name(choice.fragment_i) + " + " + name(choice.fragment_j);
    if (snippet.kept) pair = "no content match: kept as captured";
    fmt::print("{:5.2f} {:5.2f}  {:<10} {:<44} {:>6}  {:<19} {:<19} {}\n", snippet.begin / rate,
               snippet.end / rate, snippet.kept ? "-" : snippet.content, pair,
               snippet.kept ? "" : fmt::format("{:+.3f}", choice.alpha),
               snippet.kept ? "" : to_text(choice.predicted), to_text(snippet.measured.effort),
               to_text(snippet.before.effort));
    if (snippet.kept) continue;
    fmt::print(
        "{:>25} reachable: flow {:+.2f}..{:+.2f}  weight {:+.2f}..{:+.2f}  time {:+.2f}..{:+.2f}\n",
        "", choice.reachable[0].low, choice.reachable[0].high, choice.reachable[1].low,
        choice.reachable[1].high, choice.reachable[2].low, choice.reachable[2].high);
  }
  fmt::print("{}\n", to_text(quality));
}

std::string picture(const ApplyVerb& verb, const CapturedClip& input, const motion::Clip& output,
                    const transfer::StyleModel& model, const transfer::AppliedStyle& applied) {
  const auto joins = [&](auto begin_of) {
    std::vector<double> marks;
    for (std::size_t n = 1; n < applied.snippets.size(); ++n) {
      marks.push_back(begin_of(applied.snippets[n]) / model.frame_rate_hz());
    }
    return marks;
  };
  const draw::Strip strips[] = {
      {with_standard_names(input.capture.clip, input.capture.humanoid), "input: " + verb.input,
       joins([](const auto& snippet) { return snippet.begin; }), ""},
      {with_standard_names(output, input.capture.humanoid), "output: " + to_text(verb.target),
       joins([](const auto& snippet) { return snippet.output_begin; }), ""}};
  draw::ContactSheetOptions options;
  options.format = is_svg(verb.picture) ? draw::Format::kSvg : draw::Format::kPng;
  return draw::contact_sheet(strips, options);
}

std::string animation(const ApplyVerb& verb, const CapturedClip& input,
                      const transfer::StyledClip& styled) {
  const motion::Humanoid& humanoid = input.capture.humanoid;
  std::vector<double> joins;
  for (const int frame : styled.joins) joins.push_back(frame / styled.clip.frame_rate_hz());
  const draw::AnimatedClip clips[] = {
      {with_standard_names(input.capture.clip, humanoid), "input: " + verb.input, "", humanoid, {}},
      {with_standard_names(styled.clip, humanoid), "output: " + verb.output,
       "asked: " + to_text(verb.target), humanoid, std::move(joins)}};
  return draw::animation(clips, {.source_frames = styled.source_frames});
}

void run(const ApplyVerb& verb) {
  if (const auto problems = verb.target.problems(); !problems.empty()) {
    throw base::Error(base::ErrorKind::kUsage, problems.front());
  }
  check_outputs(verb.common, {verb.output, verb.report, verb.picture, verb.animation});
  (void)check_clip_output(verb.output, verb.writing);
  if (!verb.picture.empty()) (void)is_svg(verb.picture);
  std::vector<InputRecord> inputs(1);
  const transfer::StyleModel model = read_model(verb.model, inputs.front());
  const CapturedClip input = read_captured_clip(verb.input, verb.reading, verb.common);
  inputs.push_back(input.record);
  const transfer::AppliedStyle applied =
      transfer::apply_style(model, input.pose(model.frame_rate_hz()), verb.target, verb.options);
  const transfer::StyledClip styled =
      transfer::play_style(model, applied, input.capture, {.hold_feet = !verb.no_foot_fix});
  const motion::Clip& output = styled.clip;
  const transfer::StyledQuality quality = transfer::measure_styled(styled, input.capture.humanoid);

  for (const transfer::AppliedSnippet& snippet : applied.snippets) {
    if (!snippet.kept) continue;
    warn(verb.common,
         fmt::format("{}: {:.2f} s to {:.2f} s match no content of the model; kept as captured",
                     verb.input, snippet.begin / model.frame_rate_hz(),
                     snippet.end / model.frame_rate_hz()));
  }
  const Json json = report_json(verb, model, applied, quality, inputs);
  // The character's file counts its frames from a T-pose, if it has one.
  std::vector<double> source_frames = styled.source_frames;
  for (double& frame : source_frames) frame += input.first_frame();
  write_clip(verb.output, output, verb.common,
             {input.file.unit_m, input.file.asset, std::move(source_frames)}, verb.writing);
  if (!verb.report.empty()) write_bytes(verb.report, json.dump(2) + "\n", verb.common);
  if (!verb.picture.empty())
    write_bytes(verb.picture, picture(verb, input, output, model, applied), verb.common);
  if (!verb.animation.empty())
    write_bytes(verb.animation, animation(verb, input, styled), verb.common);
  if (verb.output == "-") return;
  if (verb.common.json) {
    fmt::print("{}\n", json.dump(2));
  } else {
    print(verb, model, applied, quality);
  }
}

}  // namespace

void add_apply(CLI::App& app) {
  auto verb = std::make_shared<ApplyVerb>();
  CLI::App* sub =
      add_verb(app, "apply", "Give a clip a target Effort: the same action, done another way",
               "laban apply walk.bvh --flow -2 --weight 1.5 --time 2 -o walk_sudden.glb");
  sub->add_option("INPUT", verb->input, "clip, '-' for stdin")->required();
  sub->add_option("-o,--output", verb->output, "clip to write (.bvh or .glb), '-' for stdout")
      ->required();
  add_target_options(sub, verb->target);
  sub->add_option("--model", verb->model, "style model (default: the embedded corpus's)");
  sub->add_option("--report", verb->report, "JSON report to write");
  sub->add_option("--picture", verb->picture,
                  "contact sheet to write (.png or .svg): input above output");
  sub->add_option("--animate", verb->animation,
                  "page to write (.html): input beside output, playing in any browser");
  sub->add_flag("--strict", verb->options.strict, "a part that matches no content is an error");
  sub->add_flag("--no-foot-fix", verb->no_foot_fix,
                "leave feet as they are blended: do not hold them where they touch the ground");
  add_search_options(sub, verb->options.search);
  add_read_options(sub, verb->reading);
  add_write_options(sub, verb->writing);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
