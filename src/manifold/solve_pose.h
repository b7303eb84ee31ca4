#pragma once

#include <limits>

#include "laban/manifold/pose_manifold.h"

namespace laban::manifold {

/// The pose that channels of the map say (pose_at), turned from the pose before, if there is one,
/// by no more than `most_turn`, radians, in what positions leave open: the turn of a bone about
/// itself, and the rotation of head, hands and toes against the joint above. Bones point where
/// positions ask, but swing at most four times as fast: captures let go of a marker flip a foot
/// over.
[[nodiscard]] MapPose solve_pose(Eigen::VectorXd channels, const MapPose* before,
                                 double most_turn = std::numeric_limits<double>::infinity());

/// The rotation on the way from `a` to `b` that is `most` radians away from `a`, or `b` if nearer.
[[nodiscard]] Eigen::Quaterniond turned_towards(const Eigen::Quaterniond& a,
                                                const Eigen::Quaterniond& b, double most);

}  // namespace laban::manifold
