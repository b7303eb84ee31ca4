#pragma once

#include <span>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/motion/skeleton.h"

namespace laban::motion {

/// Model-space rotations that bring the joints of a skeleton as near to given places as its bone
/// lengths let them.
///
/// From the root down, each joint turns its bones towards where its children shall be, as seen from
/// where the joint has really come to lie: lengths that do not fit make no error that grows along a
/// limb. What positions leave open (the turn of a bone about itself, the rotation of a leaf) comes
/// from `guide`: a joint with one bone turns on from its guide by the shortest arc, one with
/// several takes the rotation of least squared distance to its children's places (Wahba's problem,
/// by the q-method [Davenport68]) with a thousandth of weight on its guide. So the result follows
/// positions and guide continuously, unless a bone's place lies opposite to where the guide points
/// it.
///
/// @param positions  3 x J, metres, model space; the root is taken to lie at its own.
/// @param guide      J unit rotations, model-from-joint.
/// @returns J rotations, model-from-joint.
/// @throws Error{kUsage} if sizes are not the skeleton's; Error{kData} if a position is not finite.
[[nodiscard]] std::vector<Eigen::Quaterniond> rotations_from_positions(
    const Skeleton& skeleton, const Eigen::Ref<const Eigen::Matrix3Xd>& positions,
    std::span<const Eigen::Quaterniond> guide);

}  // namespace laban::motion
