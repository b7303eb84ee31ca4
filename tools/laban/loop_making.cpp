#include "loop_making.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "laban/base/error.h"
#include "laban/motion/motion_quality.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

constexpr double kDegrees = 180.0 / std::numbers::pi;

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

MadeLoop make_endless(const LoopChoices& choices, const CapturedClip& input, int frames,
                      base::Progress* progress) {
  loop::EndlessLoop endless(input.capture, choices.resolved());
  loop::LoopedClip looped = endless.next(frames, progress);
  MadeLoop made{std::move(looped.clip), std::move(looped.source_frames),
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

MadeLoop make_seamless(const LoopChoices& choices, const CapturedClip& input) {
  loop::SeamlessLoop looped = loop::seamless_loop(input.capture, choices.resolved());
  const double rate_hz = looped.clip.frame_rate_hz();
  return {std::move(looped.clip),
          std::move(looped.source_frames),
          {looped.seam},
          {looped.seam_begin / rate_hz},
          looped.foot_stances,
          {{"kind", "seamless"},
           {"closed", looped.closed},
           {"travel_m", looped.travel_m},
           {"turn_deg", looped.turn_rad * kDegrees},
           {"round_yaw_deg", looped.round_yaw_rad * kDegrees},
           {"round_shift_m", {looped.round_shift_m.x(), looped.round_shift_m.z()}},
           {"seam_begin_frame", looped.seam_begin},
           {"seam_end_frame", looped.seam_end}}};
}

}  // namespace

loop::LoopOptions LoopChoices::resolved() const {
  const auto usage = [](const char* what) { throw Error(ErrorKind::kUsage, what); };
  if (seamless && length)
    usage("--seamless makes a loop as long as its seam says; leave --frames and --seconds out");
  if (seamless && no_seams) usage("--seamless is a seam; leave --no-seams out");
  loop::LoopOptions resolved = options;
  resolved.seam = seam.resolved();
  resolved.turning = turning.resolved();
  resolved.turns = !no_turns;
  resolved.leaps = !no_seams;
  resolved.hold_feet = !no_foot_fix;
  return resolved;
}

MadeLoop make_loop(const LoopChoices& choices, const CapturedClip& input,
                   base::Progress* progress) {
  if (choices.seamless) return make_seamless(choices, input);
  const auto frames = choices.length.resolved(input.capture.clip.frame_rate_hz());
  if (!frames)
    throw Error(ErrorKind::kUsage, "say how long: --frames N, --seconds S, --seamless or --stream");
  return make_endless(choices, input, *frames, progress);
}

std::string loop_bytes(const CapturedClip& input, const MadeLoop& made, const std::string& path,
                       const WriteClipOptions& writing, const Common& common) {
  std::vector<double> source_frames = made.source_frames;
  for (double& frame : source_frames) frame += input.first_frame();
  return clip_bytes(path, made.clip, common,
                    {input.file.unit_m, input.file.asset, std::move(source_frames)}, writing);
}

Json loop_report(const CapturedClip& input, const MadeLoop& made) {
  const motion::Capture& capture = input.capture;
  const Usage usage = usage_of(made.source_frames, capture.clip.frame_count());
  const auto contacts = motion::find_foot_contacts(capture.clip, capture.humanoid);
  const motion::FootFloor floor = contacts.floor.value_or(motion::FootFloor{});
  const auto quality = [&](const motion::Clip& clip) {
    const motion::MotionQuality measured = motion::measure_quality(clip, capture.humanoid, floor);
    return Json{{"foot_skate_cm", measured.foot_skate_cm},
                {"toe_height_m", measured.toe_height_m},
                {"jerk_m_s3", measured.jerk_m_s3}};
  };
  Json json = {{"frames", made.clip.frame_count()},
               {"frame_rate_hz", made.clip.frame_rate_hz()},
               {"source_frames", capture.clip.frame_count()},
               {"frames_used_share", usage.share},
               {"most_shown", usage.most_shown},
               {"foot_stances", made.foot_stances},
               {"quality", {{"output", quality(made.clip)}, {"input", quality(capture.clip)}}},
               {"seams", Json::array()}};
  for (const loop::FoundSeam& seam : made.seams) json["seams"].push_back(to_json(seam));
  json.update(made.details);
  return json;
}

}  // namespace laban::cli
