#pragma once

#include <vector>

#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {

/// True for what a limb ends with: a hand or a foot.
[[nodiscard]] bool is_limb_end(StandardJoint joint) noexcept;

/// A frame's pose with a hand or foot brought to a place by two-bone IK: elbow or knee bends about
/// the axis that it bends about already, about its hinge where it is straight; the hand or foot
/// keeps its orientation, and all other joints theirs. Bones keep their lengths: what is out of
/// reach is reached for.
///
/// @param target  of the joint `end`, metres, model space.
/// @returns a local rotation for each joint.
/// @throws Error{kUsage} if the humanoid was made for a skeleton of another size, there is no such
///         frame, or `end` is no end of a limb; Error{kData} if the target is not finite.
[[nodiscard]] std::vector<Eigen::Quaterniond> reach(const Clip& clip, int frame,
                                                    const Humanoid& humanoid, StandardJoint end,
                                                    const Eigen::Vector3d& target);

}  // namespace laban::motion
