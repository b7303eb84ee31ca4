#pragma once

#include <Eigen/Dense>

#include "laban/motion/pose_matrix.h"

namespace laban::manifold {

/// Rows of a pose vector: three a standard joint.
inline constexpr int kPoseRowCount = 3 * motion::kStandardJointCount;

/// Poses as joint positions free of the body's place and heading [Manifold 3]: 63 x F, metres on
/// the standard body, rows 3 s .. 3 s + 2 are standard joint s. The hips stand over the origin and
/// face +Z; their height and tilt stay, as in METHODS 0, so a jump is not a stance.
[[nodiscard]] Eigen::MatrixXd pose_vectors(const motion::PoseMatrix& pose);

/// Mean over joints of the distance between two poses, metres.
/// @throws Error{kData} unless both have 63 rows.
[[nodiscard]] double mean_joint_distance(const Eigen::Ref<const Eigen::VectorXd>& a,
                                         const Eigen::Ref<const Eigen::VectorXd>& b);

}  // namespace laban::manifold
