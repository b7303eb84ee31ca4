#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "laban/math/rotation.h"
#include "laban/motion/clip.h"
#include "laban/motion/forward_kinematics.h"

namespace laban::test {

/// Largest change of a bone's length over a clip, metres.
inline double bone_length_spread_m(const motion::Clip& clip) {
  Eigen::VectorXd low;
  Eigen::VectorXd high;
  for (int f = 0; f < clip.frame_count(); ++f) {
    const Eigen::Matrix3Xd positions = motion::forward_kinematics(clip, f).positions;
    Eigen::VectorXd lengths = Eigen::VectorXd::Zero(positions.cols());
    for (int j = 1; j < clip.joint_count(); ++j) {
      lengths[j] = (positions.col(j) - positions.col(clip.skeleton().joint(j).parent)).norm();
    }
    low = f == 0 ? lengths : low.cwiseMin(lengths).eval();
    high = f == 0 ? lengths : high.cwiseMax(lengths).eval();
  }
  return (high - low).maxCoeff();
}

/// Largest turn of a joint from one frame to the next, radians.
inline double largest_turn(const motion::Clip& clip) {
  double largest = 0.0;
  for (int f = 1; f < clip.frame_count(); ++f) {
    for (int j = 0; j < clip.joint_count(); ++j) {
      largest =
          std::max(largest, math::angle_between(clip.rotation(f - 1, j), clip.rotation(f, j)));
    }
  }
  return largest;
}

/// Way of the root over the ground a second, metres, measured every quarter of one: hips sway.
inline double travel_speed_m_s(const motion::Clip& clip) {
  const int step = std::max(1, static_cast<int>(0.25 * clip.frame_rate_hz()));
  double way_m = 0.0;
  int last = 0;
  for (; last + step < clip.frame_count(); last += step) {
    const Eigen::Vector3d moved =
        clip.root_positions().col(last + step) - clip.root_positions().col(last);
    way_m += std::hypot(moved.x(), moved.z());
  }
  return last > 0 ? way_m * clip.frame_rate_hz() / last : 0.0;
}

}  // namespace laban::test
