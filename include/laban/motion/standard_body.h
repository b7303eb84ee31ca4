#pragma once

#include <memory>

#include <Eigen/Dense>

#include "laban/motion/clip.h"
#include "laban/motion/pose_matrix.h"

namespace laban::motion {

/// Leg length (hip to ankle) of the standard body, metres.
inline constexpr double kStandardLegLengthM = 0.84;

/// The standard body: the 21 standard joints at rest in the standard T-pose (facing +Z, arms along
/// +-X), an adult of about 1.75 m; joint order is StandardJoint's. Shared, built once.
[[nodiscard]] const std::shared_ptr<const Skeleton>& standard_skeleton();

/// Plays a pose matrix on the standard body, whatever body it was captured on: what is measured on
/// it does not depend on the performer's size. The root path begins at `start`.
[[nodiscard]] Clip to_standard_clip(const PoseMatrix& pose, const PlanarPose& start = {});

/// Where the standard joints are when a pose matrix plays on the standard body: 3 J x F, joint j in
/// rows 3 j to 3 j + 2, metres. What joint_positions(to_standard_clip(..)) gives to round-off, in a
/// fraction of the time.
[[nodiscard]] Eigen::MatrixXd standard_joint_positions(const PoseMatrix& pose,
                                                       const PlanarPose& start = {});

}  // namespace laban::motion
