#pragma once

#include <numbers>

#include "laban/motion/clip.h"
#include "laban/motion/skeleton.h"

namespace laban::test {

inline constexpr double kDegree = std::numbers::pi / 180.0;

/// A Mixamo character of 1.8 m in its bind pose (T-pose, identity rotations), with one finger a
/// hand; names begin with "mixamorig:".
[[nodiscard]] motion::Skeleton mixamo_skeleton();

/// One frame of a skeleton at rest, at 30 Hz.
[[nodiscard]] motion::Clip at_rest(const motion::Skeleton& skeleton);

/// Smooth random motion of every joint of a skeleton at 60 Hz, turning past a full circle.
[[nodiscard]] motion::Clip random_motion(const motion::Skeleton& skeleton, int frames,
                                         unsigned seed);

}  // namespace laban::test
