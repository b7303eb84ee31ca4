#include "laban/motion/pose_matrix.h"

#include <cmath>

#include "laban/base/error.h"
#include "laban/math/rotation.h"

namespace laban::motion {

PoseMatrix PoseMatrix::slice(int begin, int end) const {
  if (begin < 0 || begin >= end || end > frame_count()) {
    throw base::Error(base::ErrorKind::kUsage,
                      "pose matrix: frames [" + std::to_string(begin) + ", " + std::to_string(end) +
                          ") do not lie in its " + std::to_string(frame_count()) + " frames");
  }
  const int count = end - begin;
  PoseMatrix part{frame_rate_hz, leg_length_m, angles.middleCols(begin, count),
                  height.segment(begin, count), steps.middleCols(begin, count)};
  if (count > 1) {
    part.steps.col(0) = part.steps.col(1);
  } else {
    part.steps.setZero();
  }
  return part;
}

Eigen::Matrix3Xd planar_path(const PoseMatrix& pose, const PlanarPose& start) {
  Eigen::Matrix3Xd path(3, pose.frame_count());
  path.col(0) << start.x, start.z, start.yaw;
  for (int t = 1; t < pose.frame_count(); ++t) {
    const double yaw = path(2, t - 1);
    const double c = std::cos(yaw);
    const double s = std::sin(yaw);
    // Rotation about +Y by yaw takes (x, z) to (c x + s z, -s x + c z).
    path(0, t) = path(0, t - 1) + c * pose.steps(0, t) + s * pose.steps(1, t);
    path(1, t) = path(1, t - 1) - s * pose.steps(0, t) + c * pose.steps(1, t);
    path(2, t) = yaw + pose.steps(2, t);
  }
  return path;
}

Eigen::Matrix3Xd planar_steps(const Eigen::Ref<const Eigen::Matrix3Xd>& path) {
  Eigen::Matrix3Xd steps = Eigen::Matrix3Xd::Zero(3, path.cols());
  for (Eigen::Index t = 1; t < path.cols(); ++t) {
    const double c = std::cos(path(2, t - 1));
    const double s = std::sin(path(2, t - 1));
    const double dx = path(0, t) - path(0, t - 1);
    const double dz = path(1, t) - path(1, t - 1);
    steps.col(t) << c * dx - s * dz, s * dx + c * dz,
        math::nearest_angle(path(2, t) - path(2, t - 1), 0.0);
  }
  if (path.cols() > 1) steps.col(0) = steps.col(1);
  return steps;
}

}  // namespace laban::motion
