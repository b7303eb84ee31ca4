#pragma once

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/rng.h"
#include "laban/motion/clip.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/pose_matrix.h"
#include "laban/motion/resample.h"
#include "laban/motion/standard_body.h"

// Movements done over with one thing changed, so that tests and studies can tell what should
// follow.
namespace laban::test {

/// The clip turned about the vertical by `yaw` radians and moved over the ground by `to` metres.
inline motion::Clip elsewhere(const motion::Clip& clip, double yaw, const Eigen::Vector3d& to) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()));
  Eigen::Matrix3Xd positions = turn.toRotationMatrix() * clip.root_positions();
  positions.colwise() += to;
  const Eigen::Index joints = clip.joint_count();
  std::vector<Eigen::Quaterniond> rotations;
  Eigen::Matrix3Xd translations;
  if (clip.has_translations()) translations.resize(3, clip.frame_count() * joints);
  for (int f = 0; f < clip.frame_count(); ++f) {
    for (int j = 0; j < clip.joint_count(); ++j) {
      rotations.push_back(j == 0 ? turn * clip.rotation(f, j) : clip.rotation(f, j));
      if (!clip.has_translations()) continue;
      translations.col(f * joints + j) =
          j == 0 ? Eigen::Vector3d(positions.col(f)) : Eigen::Vector3d(clip.translation(f, j));
    }
  }
  return {clip.shared_skeleton(), clip.frame_rate_hz(), positions, std::move(rotations),
          std::move(translations)};
}

/// The pose with `noise` (66 rows: angles, height, x, z) added, scaled.
inline motion::PoseMatrix plus(motion::PoseMatrix pose, const Eigen::MatrixXd& noise,
                               double scale) {
  pose.angles += scale * noise.topRows<motion::kAngleRowCount>();
  pose.height += scale * noise.row(motion::kAngleRowCount);
  Eigen::Matrix3Xd path = motion::planar_path(pose);
  path.topRows<2>() += scale * noise.bottomRows<2>();
  pose.steps = motion::planar_steps(path);
  return pose;
}

/// White noise on all rows of a pose matrix, of a size that moves joints by `size_m` (root mean
/// square a coordinate, on the standard body).
inline motion::PoseMatrix with_noise(const motion::PoseMatrix& pose, double size_m,
                                     std::uint64_t seed = 2) {
  base::Rng rng(seed);
  Eigen::MatrixXd noise(motion::kAngleRowCount + 3, pose.frame_count());
  for (double& value : noise.reshaped()) value = 0.001 * rng.normal();
  const Eigen::Matrix3Xd moved =
      motion::joint_positions(motion::to_standard_clip(plus(pose, noise, 1.0))) -
      motion::joint_positions(motion::to_standard_clip(pose));
  return plus(pose, noise, size_m / std::sqrt(moved.array().square().mean()));
}

/// Played `factor` times as fast, and sampled at the old rate again.
inline motion::PoseMatrix faster(motion::PoseMatrix pose, double factor) {
  const double rate_hz = pose.frame_rate_hz;
  pose.frame_rate_hz *= factor;
  return motion::resample(pose, rate_hz);
}

/// The pose at a share `where` of the duration held for `hold_s` seconds, to the next frame.
inline motion::PoseMatrix with_hold(const motion::PoseMatrix& pose, double where, double hold_s) {
  const auto at = static_cast<Eigen::Index>(std::lround(where * (pose.frame_count() - 1)));
  const auto held = static_cast<Eigen::Index>(std::lround(hold_s * pose.frame_rate_hz));
  const Eigen::Index after = pose.frame_count() - 1 - at;
  motion::PoseMatrix result = pose;
  result.angles.resize(pose.angles.rows(), pose.frame_count() + held);
  result.angles << pose.angles.leftCols(at + 1), pose.angles.col(at).replicate(1, held),
      pose.angles.rightCols(after);
  result.height.resize(pose.frame_count() + held);
  result.height << pose.height.head(at + 1), Eigen::RowVectorXd::Constant(held, pose.height[at]),
      pose.height.tail(after);
  result.steps.resize(3, pose.frame_count() + held);
  result.steps << pose.steps.leftCols(at + 1), Eigen::Matrix3Xd::Zero(3, held),
      pose.steps.rightCols(after);
  return result;
}

}  // namespace laban::test
