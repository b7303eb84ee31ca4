#include "support/clips.h"

#include <cmath>

#include "laban/base/rng.h"

namespace laban::test {

motion::Clip random_clip(const ClipShape& shape) {
  base::Rng rng(shape.seed);
  std::vector<motion::Joint> joints;
  for (int j = 0; j < shape.joints; ++j) {
    joints.push_back({"joint" + std::to_string(j), j - 1,
                      Eigen::Vector3d(0.0, j == 0 ? 0.0 : 0.2, 0.0), std::nullopt});
  }
  std::vector<Eigen::Vector3d> phases;
  for (int j = 0; j < shape.joints; ++j)
    phases.emplace_back(rng.uniform(0, 6), rng.uniform(0, 6), rng.uniform(0, 6));
  Eigen::Matrix3Xd root(3, shape.frames);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < shape.frames; ++f) {
    const double t = f / shape.frame_rate_hz;
    root.col(f) << 0.3 * t, 0.9 + 0.05 * std::sin(3.0 * t), 0.8 * t;
    for (int j = 0; j < shape.joints; ++j) {
      const Eigen::Array3d phase = phases[static_cast<std::size_t>(j)].array();
      rotations.push_back(math::exp((shape.amplitude_rad * (2.0 * t + phase).sin()).matrix()));
    }
  }
  return {std::make_shared<const motion::Skeleton>(std::move(joints)), shape.frame_rate_hz,
          std::move(root), std::move(rotations)};
}

motion::PoseMatrix random_pose_matrix(const ClipShape& shape) {
  base::Rng rng(shape.seed);
  motion::PoseMatrix pose;
  pose.frame_rate_hz = shape.frame_rate_hz;
  pose.leg_length_m = 0.84;
  pose.angles.resize(motion::kAngleRowCount, shape.frames);
  pose.height.resize(shape.frames);
  Eigen::Matrix3Xd path(3, shape.frames);
  for (int row = 0; row < motion::kAngleRowCount; ++row) {
    const double phase = rng.uniform(0, 6);
    const double rate = rng.uniform(1, 4);
    for (int f = 0; f < shape.frames; ++f) {
      pose.angles(row, f) = shape.amplitude_rad * std::sin(rate * f / shape.frame_rate_hz + phase);
    }
  }
  for (int f = 0; f < shape.frames; ++f) {
    const double t = f / shape.frame_rate_hz;
    pose.height(f) = 1.15 + 0.03 * std::sin(5.0 * t);
    path.col(f) << 0.1 * std::sin(t), 1.2 * t, 0.4 * std::sin(0.7 * t);
  }
  pose.steps = motion::planar_steps(path);
  return pose;
}

}  // namespace laban::test
