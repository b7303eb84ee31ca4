#pragma once

#include <limits>

#include "laban/manifold/pose_manifold.h"

namespace laban::manifold {

/// The pose that channels of the map say (pose_at), turned from the pose before, if there is one,
/// by no more than `most_turn`, radians, in what positions leave open: the turn of a bone about
/// itself, and the rotation of head, hands and toes against the joint above. Bones still point
/// where positions ask.
[[nodiscard]] MapPose solve_pose(Eigen::VectorXd channels, const MapPose* before,
                                 double most_turn = std::numeric_limits<double>::infinity());

}  // namespace laban::manifold
