#pragma once

#include <Eigen/Dense>

#include "laban/motion/standard_joint.h"

namespace laban::motion {

/// Rows of PoseMatrix::angles: three a standard joint.
inline constexpr int kAngleRowCount = 3 * kStandardJointCount;

/// F frames of a standard humanoid, free of the rig it was captured on: the only thing that
/// matchers and learners see (METHODS 0, DESIGN 2).
///
/// Standard joint s has the local rotation q_s = R_parent(s)^-1 R_s, where R_s is its model-space
/// rotation away from the standard reference pose (a T-pose facing +Z in which every R_s is the
/// identity). For the hips, R is split into heading (about +Y) and tilt; row block 0 holds the
/// tilt.
struct PoseMatrix {
  double frame_rate_hz = 0.0;
  /// Length of a leg (hip to ankle) of the captured body, metres. Heights and steps below are in
  /// leg lengths, so that two captures of one motion on bodies of two sizes give the same numbers.
  double leg_length_m = 0.0;
  /// 63 x F exponential maps, radians, unwrapped along time; rows 3 s .. 3 s + 2 are standard joint
  /// s.
  Eigen::MatrixXd angles;
  /// Height of the hips above the ground plane y = 0, leg lengths; F values.
  Eigen::RowVectorXd height;
  /// 3 x F rigid planar steps from frame t - 1 to t, in the heading frame of t - 1: x (to the
  /// character's left) and z (forward) in leg lengths, yaw in radians. Column 0 copies column 1 and
  /// is not integrated (METHODS 0); zero if F = 1.
  Eigen::Matrix3Xd steps;

  [[nodiscard]] int frame_count() const noexcept { return static_cast<int>(angles.cols()); }
  [[nodiscard]] double duration_s() const noexcept { return (frame_count() - 1) / frame_rate_hz; }
  /// Frames [begin, end) as a pose matrix of their own (column 0 of the steps copies column 1).
  /// @throws Error{kUsage} unless 0 <= begin < end <= F.
  [[nodiscard]] PoseMatrix slice(int begin, int end) const;
};

/// Where a planar root path begins: x, z in leg lengths, yaw in radians.
struct PlanarPose {
  double x = 0.0;
  double z = 0.0;
  double yaw = 0.0;
};

/// 3 x F planar root path (x, z in leg lengths; yaw, unwrapped): the steps integrated from `start`.
[[nodiscard]] Eigen::Matrix3Xd planar_path(const PoseMatrix& pose, const PlanarPose& start = {});

/// The inverse of planar_path: 3 x F steps of a path (column 0 copies column 1).
[[nodiscard]] Eigen::Matrix3Xd planar_steps(const Eigen::Ref<const Eigen::Matrix3Xd>& path);

}  // namespace laban::motion
