#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/io/bvh.h"
#include "laban/motion/motion_quality.h"

#include "loop.h"
#include "stream.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

struct LoopSynthesizeVerb {
  Common common;
  ReadClipOptions reading;
  WriteClipOptions writing;
  SeamChoices seam;
  TurningChoices turning;
  loop::LoopOptions options;
  std::string input;
  std::string output;
  std::string report;
  std::string picture;
  AskedLength length;
  bool seamless = false;
  bool stream = false;
  bool no_turns = false;
  bool no_seams = false;
  bool no_foot_fix = false;
};

/// What both kinds of output are reported by.
struct Made {
  motion::Clip clip;
  std::vector<double> source_frames;
  std::vector<loop::FoundSeam> seams;
  std::vector<double> marks_s;  ///< where seams begin
  int foot_stances = 0;
  Json details;  ///< of the kind
};

loop::LoopOptions resolved(const LoopSynthesizeVerb& verb) {
  loop::LoopOptions options = verb.options;
  options.seam = verb.seam.resolved();
  options.turning = verb.turning.resolved();
  options.turns = !verb.no_turns;
  options.leaps = !verb.no_seams;
  options.hold_feet = !verb.no_foot_fix;
  options.seed = verb.common.seed;
  return options;
}

/// How often each frame of the capture is shown: what share of them is, and the most often.
struct Usage {
  double share = 0.0;
  int most_shown = 0;
};

Usage usage_of(const std::vector<double>& source_frames, int frame_count) {
  std::map<int, int> shown;
  Usage usage;
  for (const double frame : source_frames) {
    usage.most_shown = std::max(usage.most_shown, ++shown[static_cast<int>(std::lround(frame))]);
  }
  usage.share = static_cast<double>(shown.size()) / frame_count;
  return usage;
}

std::string_view name_of(loop::LoopStep step) {
  switch (step) {
    case loop::LoopStep::kForwards:
      return "forwards";
    case loop::LoopStep::kBackwards:
      return "backwards";
    case loop::LoopStep::kSeam:
      return "seam";
  }
  return "";
}

Made make_endless(const LoopSynthesizeVerb& verb, const CapturedClip& input, int frames) {
  loop::EndlessLoop endless(input.capture, resolved(verb));
  loop::LoopedClip looped = endless.next(frames);
  Made made{std::move(looped.clip), std::move(looped.source_frames),
            endless.seams(),        {},
            looped.foot_stances,    {}};
  Json parts = Json::array();
  for (const loop::LoopPart& part : looped.parts) {
    const auto end = std::min<std::int64_t>(part.end, frames);
    parts.push_back({{"step", name_of(part.step)},
                     {"begin_frame", part.begin},
                     {"end_frame", end},
                     {"seam", part.seam < 0 ? Json() : Json(part.seam)}});
    if (part.step == loop::LoopStep::kSeam) {
      made.marks_s.push_back(static_cast<double>(part.begin) / made.clip.frame_rate_hz());
    }
  }
  Json points = Json::array();
  for (const loop::TurningPoint& point : endless.turning().points) {
    points.push_back({{"frame", point.frame}, {"symmetry", point.symmetry}});
  }
  made.details = {{"kind", "endless"}, {"turning_points", points}, {"parts", parts}};
  return made;
}

Made make_seamless(const LoopSynthesizeVerb& verb, const CapturedClip& input) {
  loop::SeamlessLoop looped = loop::seamless_loop(input.capture, resolved(verb));
  const double rate_hz = looped.clip.frame_rate_hz();
  return {std::move(looped.clip),
          std::move(looped.source_frames),
          {looped.seam},
          {looped.seam_begin / rate_hz},
          looped.foot_stances,
          {{"kind", "seamless"},
           {"closed", looped.closed},
           {"travel_m", looped.travel_m},
           {"turn_deg", looped.turn_rad * 57.29577951308232},
           {"seam_begin_frame", looped.seam_begin},
           {"seam_end_frame", looped.seam_end}}};
}

Json report_json(const LoopSynthesizeVerb& verb, const CapturedClip& input, const Made& made,
                 const Usage& usage) {
  const motion::Capture& capture = input.capture;
  const auto contacts = motion::find_foot_contacts(capture.clip, capture.humanoid);
  const motion::FootFloor floor = contacts.floor.value_or(motion::FootFloor{});
  const auto quality = [&](const motion::Clip& clip) {
    const motion::MotionQuality measured = motion::measure_quality(clip, capture.humanoid, floor);
    return Json{{"foot_skate_cm", measured.foot_skate_cm},
                {"toe_height_m", measured.toe_height_m},
                {"jerk_m_s3", measured.jerk_m_s3}};
  };
  Json json = {{"schema", "laban.loop_synthesize/1"},
               {"output", verb.output},
               {"frames", made.clip.frame_count()},
               {"frame_rate_hz", made.clip.frame_rate_hz()},
               {"source_frames", capture.clip.frame_count()},
               {"frames_used_share", usage.share},
               {"most_shown", usage.most_shown},
               {"foot_stances", made.foot_stances},
               {"quality", {{"output", quality(made.clip)}, {"input", quality(capture.clip)}}},
               {"seams", Json::array()}};
  for (const loop::FoundSeam& seam : made.seams) json["seams"].push_back(to_json(seam));
  json.update(made.details);
  json["run"] = run_record("loop synthesize",
                           {{"frames", made.clip.frame_count()},
                            {"seamless", verb.seamless},
                            {"in_place", verb.options.in_place},
                            {"turns", !verb.no_turns},
                            {"seams", !verb.no_seams},
                            {"seam_count", verb.options.seam_count},
                            {"probability_step", verb.options.probability_step},
                            {"foot_fix", !verb.no_foot_fix},
                            {"seed", verb.common.seed},
                            {"seam", to_json(verb.seam)},
                            {"turning", to_json(verb.turning)}},
                           {input.record});
  return json;
}

void print_text(const LoopSynthesizeVerb& verb, const Json& json, const Made& made,
                const Usage& usage) {
  fmt::print(
      "{}: {} frames at {:g} Hz, {:.1f} s, of {} captured ones ({:.0f} % used, one at most "
      "{} times)\n",
      verb.output, made.clip.frame_count(), made.clip.frame_rate_hz(),
      made.clip.frame_count() / made.clip.frame_rate_hz(), json["source_frames"].get<int>(),
      100.0 * usage.share, usage.most_shown);
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
  if (verb.options.in_place) return;  // over which all feet slide
  fmt::print("foot skate {:.3f} cm a frame at 30 Hz, captured {:.3f}\n",
             json["quality"]["output"]["foot_skate_cm"].get<double>(),
             json["quality"]["input"]["foot_skate_cm"].get<double>());
}

/// Rows to stdout as they are made.
void stream(const LoopSynthesizeVerb& verb, const CapturedClip& input) {
  loop::EndlessLoop endless(input.capture, resolved(verb));
  io::BvhWriteOptions writing;
  writing.unit_m = input.file.unit_m;
  stream_bvh(verb.length.resolved(input.capture.clip.frame_rate_hz()), writing, verb.common,
             [&endless](int count) { return endless.next(count).clip; });
}

void check_choices(const LoopSynthesizeVerb& verb) {
  (void)resolved(verb);
  const auto usage = [](const char* what) { throw Error(ErrorKind::kUsage, what); };
  if (verb.stream) {
    if (verb.seamless) usage("--stream runs on; --seamless makes one round: leave one out");
    check_stream(verb.output, verb.writing, !verb.report.empty() || !verb.picture.empty(),
                 verb.common);
    return;
  }
  if (verb.seamless && verb.length) {
    usage("--seamless makes a loop as long as its seam says; leave --frames and --seconds out");
  }
  if (verb.seamless && verb.no_seams) usage("--seamless is a seam; leave --no-seams out");
  if (!verb.seamless && !verb.length) {
    usage("say how long: --frames N, --seconds S, --seamless or --stream");
  }
}

void run(LoopSynthesizeVerb& verb) {
  check_choices(verb);
  if (verb.stream) {
    return stream(verb, read_captured_clip(verb.input, verb.reading, verb.common));
  }
  check_outputs(verb.common, {verb.output, verb.report, verb.picture});
  (void)check_clip_output(verb.output, verb.writing);
  if (!verb.picture.empty()) (void)is_svg(verb.picture);
  const CapturedClip input = read_captured_clip(verb.input, verb.reading, verb.common);
  const Made made = naming(verb.input, [&] {
    return verb.seamless ? make_seamless(verb, input)
                         : make_endless(verb, input,
                                        *verb.length.resolved(input.capture.clip.frame_rate_hz()));
  });
  std::vector<double> source_frames = made.source_frames;
  for (double& frame : source_frames) frame += input.first_frame();
  write_clip(verb.output, made.clip, verb.common,
             {input.file.unit_m, input.file.asset, std::move(source_frames)}, verb.writing);
  const Usage usage = usage_of(made.source_frames, input.capture.clip.frame_count());
  const Json json = report_json(verb, input, made, usage);
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
    print_text(verb, json, made, usage);
  }
}

}  // namespace

void add_loop_synthesize(CLI::App* loop) {
  auto verb = std::make_shared<LoopSynthesizeVerb>();
  CLI::App* sub =
      add_verb(*loop, "synthesize", "Play one clip on and on, or make one perfect loop of it",
               "laban loop synthesize kick.bvh --frames 1700 -o endless.bvh");
  sub->add_option("INPUT", verb->input, "clip, '-' for stdin")->required();
  sub->add_option("-o,--output", verb->output, "clip to write (.bvh or .glb), '-' for stdout")
      ->required();
  add_length_options(sub, verb->length);
  sub->add_flag("--seamless", verb->seamless,
                "one perfect loop: its last frame flows into the first");
  sub->add_flag("--in-place", verb->options.in_place, "without travel over the ground");
  sub->add_flag("--stream", verb->stream,
                "BVH to stdout as it is made, in constant memory; without --frames or --seconds "
                "until the reader closes");
  sub->add_flag("--no-turns", verb->no_turns, "never play backwards from a turning point");
  sub->add_flag("--no-seams", verb->no_seams, "never leap from the end to the beginning");
  sub->add_flag("--no-foot-fix", verb->no_foot_fix, "leave feet as they come");
  sub->add_option("--seam-count", verb->options.seam_count, "most seams to choose from")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  sub->add_option("--probability-step", verb->options.probability_step,
                  "how much less likely a turn becomes when it is taken, more when not")
      ->check(CLI::Range(0.0, 2.0))
      ->capture_default_str();
  sub->add_option("--report", verb->report, "JSON report to write");
  sub->add_option("--picture", verb->picture,
                  "contact sheet to write (.png or .svg): input above output, seams marked");
  add_seam_options(sub, verb->seam);
  add_turning_options(sub, verb->turning);
  add_read_options(sub, verb->reading);
  add_write_options(sub, verb->writing);
  add_common(sub, verb->common, {.writes = true, .seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
