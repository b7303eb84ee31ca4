#pragma once

#include <algorithm>
#include <cmath>

#include "laban/motion/clip.h"

namespace laban::motion {

/// A fractional frame: `frame` and the share of the way to the next one, in [0, 1); 0 at the last.
struct FramePosition {
  int frame = 0;
  double fraction = 0.0;
};

/// The position nearest to `frame` inside a clip of `frame_count` frames. Within 1e-6 of a whole
/// frame it is that frame, so that rates such as 1/0.0083333 do not blur what they only copy.
[[nodiscard]] inline FramePosition frame_position(double frame, int frame_count) {
  const double inside = std::clamp(frame, 0.0, static_cast<double>(frame_count - 1));
  const double nearest = std::round(inside);
  if (std::abs(inside - nearest) <= 1e-6) return {static_cast<int>(nearest), 0.0};
  const double below = std::floor(inside);
  return {static_cast<int>(below), inside - below};
}

/// A joint's local rotation between frames, by slerp.
[[nodiscard]] inline Eigen::Quaterniond rotation_at(const Clip& clip, const FramePosition& at,
                                                    int joint) {
  const Eigen::Quaterniond& here = clip.rotation(at.frame, joint);
  if (at.fraction == 0.0) return here;
  return here.slerp(at.fraction, clip.rotation(at.frame + 1, joint)).normalized();
}

/// A joint's offset from its parent between frames, linearly, metres.
[[nodiscard]] inline Eigen::Vector3d translation_at(const Clip& clip, const FramePosition& at,
                                                    int joint) {
  const Eigen::Vector3d here = clip.translation(at.frame, joint);
  if (at.fraction == 0.0) return here;
  return here + at.fraction * (clip.translation(at.frame + 1, joint) - here);
}

}  // namespace laban::motion
