#pragma once

#include <array>
#include <span>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/motion/pose_matrix.h"

namespace laban::texture {

/// Rows of an observation: three angles a standard joint, height, three planar root steps.
inline constexpr int kObservationRows = motion::kAngleRowCount + 4;
/// The row of the hips' height.
inline constexpr int kHeightRow = motion::kAngleRowCount;
/// The first of the rows of steps.
inline constexpr int kStepRow = kObservationRows - 3;

/// The one space in which all takes of a corpus are observed ([Li02, 3.1], "locally
/// reparameterised"): joint angles away from one reference pose, so that they stay far below pi.
struct ObservationSpace {
  /// Local rotation of each standard joint in the reference pose (that of PoseMatrix is a T-pose).
  std::array<Eigen::Quaterniond, motion::kStandardJointCount> reference;
  /// 67 positive factors, observation over pose matrix: they make one unit of any row weigh alike
  /// in the fits, for one variance is charged for all rows outside a texton's subspace.
  Eigen::VectorXd scale;
};

/// The space of a corpus: reference rotations are the takes' means.
/// @throws Error{kUsage} if there is no take.
[[nodiscard]] ObservationSpace learn_observation_space(std::span<const motion::PoseMatrix> takes);

/// 67 x F observations: rows 3 s .. 3 s + 2 are standard joint s, then height, then steps.
/// Angles are unwrapped along time, each joint on the branch that stays nearest to the reference.
[[nodiscard]] Eigen::MatrixXd observe(const ObservationSpace& space,
                                      const motion::PoseMatrix& pose);

/// The same poses with each joint told on the branch nearest to what it is in `near`, and then from
/// frame to frame: only so is the difference of two observations one of poses.
/// @param observations  67 x F.  @param near  67 x 1.
[[nodiscard]] Eigen::MatrixXd on_branches_near(const ObservationSpace& space,
                                               Eigen::MatrixXd observations,
                                               const Eigen::Ref<const Eigen::VectorXd>& near);

/// What turns one observation into another: for each joint the rotation that takes the first to the
/// second the shorter way, in the first's own axes, as an exponential map on the branch nearest to
/// `near` (none: the shorter way); for height and steps the difference. Observation units.
/// @param from, to  67 x 1.  @param near  67 x 1 or empty.
[[nodiscard]] Eigen::VectorXd offset_between(const ObservationSpace& space,
                                             const Eigen::Ref<const Eigen::VectorXd>& from,
                                             const Eigen::Ref<const Eigen::VectorXd>& to,
                                             const Eigen::VectorXd& near = {});

/// Observations turned by offsets, each joint about its own axes: the inverse of offset_between,
/// with angles unwrapped along time from the branch nearest to the first column's own.
/// @param observations, offsets  67 x F.
[[nodiscard]] Eigen::MatrixXd with_offsets(const ObservationSpace& space,
                                           Eigen::MatrixXd observations,
                                           const Eigen::Ref<const Eigen::MatrixXd>& offsets);

/// The inverse of observe: poses of any 67 x F observations.
[[nodiscard]] motion::PoseMatrix poses_of(const ObservationSpace& space,
                                          const Eigen::Ref<const Eigen::MatrixXd>& observations,
                                          double frame_rate_hz, double leg_length_m);

}  // namespace laban::texture
