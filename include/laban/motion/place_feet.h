#pragma once

#include <array>

#include <Eigen/Dense>

#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {

/// The clip with its left and right foot joints brought to `goals` by two-bone IK; the feet keep
/// their orientation in model space, and the rest of the body its place.
///
/// What is added to thighs and shins has nothing above 8 Hz. No leg is stretched beyond what it is
/// or a knee bent by 4 degrees: a foot that cannot reach its goal stays short of it. A leg that is
/// at its goals in all frames keeps its rotations bit for bit.
///
/// @param goals  3 x F each, metres, model space.
/// @throws Error{kUsage} if the humanoid was made for a skeleton of another size; Error{kData}
///         unless there is a finite goal for each frame.
[[nodiscard]] Clip place_feet(const Clip& clip, const Humanoid& humanoid,
                              const std::array<Eigen::Matrix3Xd, 2>& goals);

}  // namespace laban::motion
