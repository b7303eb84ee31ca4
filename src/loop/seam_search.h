#pragma once

#include <span>
#include <vector>

#include "laban/loop/endless_loop.h"

#include "loop/body_track.h"
#include "loop/join_window.h"

namespace laban::loop {

/// What is usual in a capture: rms over its standard joints a frame.
struct UsualMotion {
  double speed_m_s = 0.0;                 ///< 99th percentile
  double acceleration_m_s2 = 0.0;         ///< 99th percentile
  std::vector<double> speeds_m_s;         ///< of each frame
  double lively_acceleration_m_s2 = 0.0;  ///< 90th percentile
};

/// rms speed and acceleration of each frame but the first and last, which copy their neighbours'.
struct MotionRates {
  std::vector<double> speed_m_s;
  std::vector<double> acceleration_m_s2;
};
[[nodiscard]] MotionRates motion_rates(const BodyRows& rows, std::span<const BodyFrame> frames,
                                       double frame_rate_hz);
[[nodiscard]] UsualMotion usual_motion(const BodyRows& rows, std::span<const BodyFrame> frames,
                                       double frame_rate_hz);

/// How many frames at the beginning, 0 to 3, are no motion but leap into it (what is left of a
/// T-pose that a rig's files begin with): steps over 1.5 times any later one.
[[nodiscard]] int first_flowing_frame(const motion::Clip& clip, const motion::Humanoid& humanoid);
/// The capture from that frame on.
[[nodiscard]] motion::Capture flowing(const motion::Capture& capture, int first_frame);

/// A seam that can be played: frames in the outgoing clip's place.
struct SewnSeam {
  FoundSeam found;
  std::vector<BodyFrame> frames;
  PlanarMotion outgoing_from_incoming;
  int join = 0;          ///< frame of the overlap at which the body switches
  double worth_m = 0.0;  ///< less is better: off the captured, feet that slide, clip left out
};

struct SeamTask {
  const BodyRows& rows;
  const std::vector<BodyFrame>& outgoing;
  const std::vector<BodyFrame>& incoming;
  double frame_rate_hz = 0.0;
  UsualMotion usual;
  /// On whose rig both are; its feet are led over the seam. Null: they go where the legs take them.
  const motion::Capture* rig = nullptr;
};

/// Places the overlap, cuts, blends and smooths, leads the feet: the best `count` seams that differ
/// in place, best first. At least one. Seams whose speed or acceleration is beyond the captures'
/// own come after all others and are left out where there are others, and so are seams that are
/// much worse than the best: frames far from all captured ones, and feet that slide.
[[nodiscard]] std::vector<SewnSeam> find_seams(const SeamTask& task, const SeamOptions& options,
                                               int count);

/// The turn and shift that bring the incoming overlap to the outgoing one: least squares over the
/// joints, feet that stand in both counting most, the middle of the overlap more than its ends.
[[nodiscard]] PlanarMotion align_overlap(const BodyRows& rows, std::span<const BodyFrame> outgoing,
                                         std::span<const BodyFrame> incoming);

}  // namespace laban::loop
