#include <algorithm>
#include <cstdio>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/io/bvh.h"

#include "loop_making.h"
#include "loop_state.h"
#include "state_reader.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

struct LoopSynthesizeVerb {
  Common common;
  ReadClipOptions reading;
  WriteClipOptions writing;
  LoopChoices choices;
  std::string input;
  std::string output;
  std::string report;
  std::string picture;
  std::string state;
  bool stream = false;
};

Json report_json(const LoopSynthesizeVerb& verb, const CapturedClip& input, const MadeLoop& made) {
  Json json = {{"schema", "laban.loop_synthesize/1"}, {"output", verb.output}};
  json.update(loop_report(input, made));
  json["run"] = run_record("loop synthesize",
                           {{"frames", made.clip.frame_count()},
                            {"seamless", verb.choices.seamless},
                            {"in_place", verb.choices.options.in_place},
                            {"turns", !verb.choices.no_turns},
                            {"seams", !verb.choices.no_seams},
                            {"seam_count", verb.choices.options.seam_count},
                            {"probability_step", verb.choices.options.probability_step},
                            {"foot_fix", !verb.choices.no_foot_fix},
                            {"seed", verb.choices.options.seed},
                            {"seam", to_json(verb.choices.seam)},
                            {"turning", to_json(verb.choices.turning)}},
                           {input.record});
  return json;
}

void print_text(const LoopSynthesizeVerb& verb, const Json& json, const MadeLoop& made) {
  fmt::print(
      "{}: {} frames at {:g} Hz, {:.1f} s, of {} captured ones ({:.0f} % used, one at most "
      "{} times)\n",
      verb.output, made.clip.frame_count(), made.clip.frame_rate_hz(),
      made.clip.frame_count() / made.clip.frame_rate_hz(), json["source_frames"].get<int>(),
      100.0 * json["frames_used_share"].get<double>(), json["most_shown"].get<int>());
  if (json["kind"] == "seamless") {
    if (made.details["closed"]) {
      fmt::print("the last frame flows into the first\n");
    } else {
      fmt::print("the last frame flows into the first, {:.2f} m and {:+.1f} degrees on\n",
                 json["travel_m"].get<double>(), json["turn_deg"].get<double>());
    }
  } else {
    fmt::print("{} turning points, {} seams played\n", json["turning_points"].size(),
               made.marks_s.size());
  }
  for (const loop::FoundSeam& seam : made.seams) fmt::print("seam: {}\n", to_text(seam));
  if (verb.choices.options.in_place) return;  // over which all feet slide
  fmt::print("foot skate {:.3f} cm a frame at 30 Hz, captured {:.3f}\n",
             json["quality"]["output"]["foot_skate_cm"].get<double>(),
             json["quality"]["input"]["foot_skate_cm"].get<double>());
}

/// Rows to stdout as they are made.
void stream(const LoopSynthesizeVerb& verb, const CapturedClip& input) {
  loop::EndlessLoop endless(input.capture, verb.choices.resolved());
  io::BvhWriteOptions writing;
  writing.unit_m = input.file.unit_m;
  stream_bvh(verb.choices.length.resolved(input.capture.clip.frame_rate_hz()), writing, verb.common,
             [&endless](int count) { return endless.next(count).clip; });
}

void check_choices(const LoopSynthesizeVerb& verb) {
  (void)verb.choices.resolved();
  const auto usage = [](const char* what) { throw Error(ErrorKind::kUsage, what); };
  if (verb.stream) {
    if (verb.choices.seamless) usage("--stream runs on; --seamless makes one round: leave one out");
    check_stream(verb.output, verb.writing, !verb.report.empty() || !verb.picture.empty(),
                 verb.common);
  } else if (!verb.choices.seamless && !verb.choices.length) {
    usage("say how long: --frames N, --seconds S, --seamless or --stream");
  }
}

/// What the studio's loop room was set to; INPUT stands above its own.
void take_state(LoopSynthesizeVerb& verb) {
  LoopState state = parse_loop_state(read_bytes(verb.state), verb.state);
  verb.choices = std::move(state.choices);
  verb.reading = std::move(state.reading);
  if (verb.input.empty()) verb.input = std::move(state.input);
}

void run(LoopSynthesizeVerb& verb) {
  verb.choices.options.seed = verb.common.seed;
  if (!verb.state.empty()) take_state(verb);
  if (verb.input.empty()) throw CLI::RequiredError("INPUT");
  check_choices(verb);
  if (verb.stream) {
    return stream(verb, read_captured_clip(verb.input, verb.reading, verb.common));
  }
  check_outputs(verb.common, {verb.output, verb.report, verb.picture});
  (void)check_clip_output(verb.output, verb.writing);
  if (!verb.picture.empty()) (void)is_svg(verb.picture);
  const CapturedClip input = read_captured_clip(verb.input, verb.reading, verb.common);
  const MadeLoop made = naming(verb.input, [&] {
    return make_loop(verb.choices, input, terminal_progress(verb.common, "making motion").get());
  });
  write_bytes(verb.output, loop_bytes(input, made, verb.output, verb.writing, verb.common),
              verb.common);
  const Json json = report_json(verb, input, made);
  if (!verb.report.empty()) write_bytes(verb.report, json.dump(2) + "\n", verb.common);
  if (!verb.picture.empty()) {
    write_bytes(
        verb.picture,
        loop_picture(verb.picture, input.capture.humanoid, input.capture.clip,
                     "input: " + verb.input, made.clip, "output: " + verb.output, made.marks_s),
        verb.common);
  }
  if (verb.output == "-") return;
  if (verb.common.json) {
    fmt::print("{}\n", json.dump(2));
  } else {
    print_text(verb, json, made);
  }
}

}  // namespace

void add_loop_synthesize(CLI::App* loop) {
  auto verb = std::make_shared<LoopSynthesizeVerb>();
  CLI::App* sub =
      add_verb(*loop, "synthesize", "Play one clip on and on, or make one perfect loop of it",
               "laban loop synthesize kick.bvh --frames 1700 -o endless.bvh");
  LoopChoices& choices = verb->choices;
  sub->add_option("INPUT", verb->input, "clip, '-' for stdin");
  sub->add_option("-o,--output", verb->output, "clip to write (.bvh or .glb), '-' for stdout")
      ->required();
  sub->add_option("--report", verb->report, "JSON report to write");
  sub->add_option("--picture", verb->picture,
                  "contact sheet to write (.png or .svg): input above output, seams marked");
  const std::vector<CLI::Option*> others = sub->get_options();
  add_length_options(sub, choices.length);
  sub->add_flag("--seamless", choices.seamless,
                "one perfect loop: its last frame flows into the first");
  sub->add_flag("--in-place", choices.options.in_place, "without travel over the ground");
  sub->add_flag("--stream", verb->stream,
                "BVH to stdout as it is made, in constant memory; without --frames or --seconds "
                "until the reader closes");
  sub->add_flag("--no-turns", choices.no_turns, "never play backwards from a turning point");
  sub->add_flag("--no-seams", choices.no_seams, "never leap from the end to the beginning");
  sub->add_flag("--no-foot-fix", choices.no_foot_fix, "leave feet as they come");
  sub->add_option("--seam-count", choices.options.seam_count, "most seams to choose from")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  sub->add_option("--probability-step", choices.options.probability_step,
                  "how much less likely a turn becomes when it is taken, more when not")
      ->check(CLI::Range(0.0, 2.0))
      ->capture_default_str();
  add_seam_options(sub, choices.seam);
  add_turning_options(sub, choices.turning);
  add_read_options(sub, verb->reading);
  add_state_option(sub, verb->state, "loop room", others);
  add_write_options(sub, verb->writing);
  add_common(sub, verb->common, {.writes = true, .seed = true});
  sub->get_option("--state")->excludes(sub->get_option("--seed"));
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
