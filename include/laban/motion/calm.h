#pragma once

#include <Eigen/Dense>

#include "laban/motion/pose_matrix.h"

namespace laban::motion {

/// Jerk of a motion as the standard body plays it, m/s^3: root mean square over joints and frames
/// of the length of the third derivative (differences) of positions relative to the hips; 0 for
/// fewer than four frames.
[[nodiscard]] double rms_jerk_m_s3(const PoseMatrix& pose);

/// The same around each frame, travel included: rms over joints and 0.1 s on either side of the
/// third derivative of positions; F values, m/s^3.
[[nodiscard]] Eigen::RowVectorXd local_jerk_m_s3(const PoseMatrix& pose);

/// Both measures at once, for the price of one.
struct Jerk {
  double usual_m_s3 = 0.0;    ///< rms_jerk_m_s3
  double largest_m_s3 = 0.0;  ///< of local_jerk_m_s3: at the worst moment
};
[[nodiscard]] Jerk jerk_of(const PoseMatrix& pose);

/// The motion low-passed (angles, height, steps) by the highest cutoff, of a ladder from 14 down to
/// 2 Hz, that brings its rms_jerk_m_s3 to `most` or less, or by the lowest; as it is if its jerk is
/// no more.
[[nodiscard]] PoseMatrix calm(const PoseMatrix& pose, double most_m_s3);

/// The motion low-passed only where its local jerk exceeds `most`, there by the highest cutoff of
/// the ladder that brings it down or by the lowest, and back to nothing within 0.3 s; elsewhere
/// every value stays as it is.
/// @param most_m_s3  a value a frame; may be infinite.
/// @throws Error{kUsage} if there are not as many values as frames.
[[nodiscard]] PoseMatrix calm_locally(const PoseMatrix& pose, const Eigen::RowVectorXd& most_m_s3);

/// A motion and where it takes the joints of the standard body.
struct PosedMotion {
  PoseMatrix pose;
  Eigen::MatrixXd joint_positions;  ///< standard_joint_positions of it
};

/// calm, then calm_locally with one limit for all frames: a motion with no more jerk than `most`
/// stays as it is. Each motion on the way is played once.
[[nodiscard]] PosedMotion calm(PoseMatrix pose, const Jerk& most);

}  // namespace laban::motion
