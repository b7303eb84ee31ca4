#pragma once

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/manifold/pose_vector.h"

namespace laban::manifold {

// What the GRBF gives for a map point, row by row. Positions and speed come first: they alone are
// read where a path is timed.
inline constexpr int kSpeedRow = kPoseRowCount;  ///< mean speed of joints, m/s
inline constexpr int kTimingRows = kSpeedRow + 1;
inline constexpr int kStepRow = kTimingRows;  ///< 3: root's planar velocity, leg lengths/s, rad/s
inline constexpr int kContactRow = kStepRow + 3;      ///< 4: share of foot points on the ground
inline constexpr int kVelocityRow = kContactRow + 4;  ///< 63: velocity of the pose vector, m/s
inline constexpr int kRotationRow = kVelocityRow + kPoseRowCount;  ///< 6 a standard joint
inline constexpr int kFreeJointRow = kRotationRow + 6 * motion::kStandardJointCount;

/// Rows for a rig with so many free joints: 6 each.
[[nodiscard]] constexpr int channel_count(int free_joints) {
  return kFreeJointRow + 6 * free_joints;
}

/// A rotation as its matrix's first two columns: continuous, so that means and maps make sense
/// [Zhou19].
[[nodiscard]] inline Eigen::Matrix<double, 6, 1> two_axes(const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  Eigen::Matrix<double, 6, 1> axes;
  axes << R.col(0), R.col(1);
  return axes;
}

/// The rotation nearest to two axes, by Gram and Schmidt; the identity where they say nothing.
[[nodiscard]] inline Eigen::Quaterniond from_two_axes(
    const Eigen::Ref<const Eigen::Matrix<double, 6, 1>>& axes) {
  constexpr double kLeast = 1e-9;
  const Eigen::Vector3d x = axes.head<3>();
  const Eigen::Vector3d z = x.cross(axes.tail<3>());
  if (x.norm() < kLeast || z.norm() < kLeast) return Eigen::Quaterniond::Identity();
  Eigen::Matrix3d R;
  R.col(0) = x.normalized();
  R.col(2) = z.normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return Eigen::Quaterniond(R).normalized();
}

}  // namespace laban::manifold
