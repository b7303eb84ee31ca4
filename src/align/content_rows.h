#pragma once

#include <Eigen/Dense>

#include "laban/motion/pose_matrix.h"

namespace laban::align {

/// Rows of joint_places: three a standard joint but the hips.
inline constexpr int kPlaceRowCount = motion::kAngleRowCount - 3;
/// Rows of travel.
inline constexpr int kTravelRowCount = 2;

/// 60 x F: where the joints other than the hips are, seen from the hips in the character's heading,
/// in leg lengths, on the standard body whatever body was captured.
[[nodiscard]] Eigen::MatrixXd joint_places(const motion::PoseMatrix& pose);

/// 2 x F: how the hips travel over the ground, sideways and forward in the character's heading, leg
/// lengths a second: the median of the steps within 0.1 s of a frame, so that the one step across a
/// cut of an edited capture, however wide, says nothing.
[[nodiscard]] Eigen::MatrixXd travel(const motion::PoseMatrix& pose);

}  // namespace laban::align
