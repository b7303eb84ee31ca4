#include "align/content_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "laban/math/rotation.h"
#include "laban/motion/standard_body.h"

namespace laban::align {
namespace {

constexpr double kTravelReachS = 0.1;

// Of an even count, the upper of the two in the middle.
double middle_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Eigen::MatrixXd joint_places(const motion::PoseMatrix& pose) {
  const motion::Skeleton& body = *motion::standard_skeleton();
  Eigen::MatrixXd places(kPlaceRowCount, pose.frame_count());
  std::array<Eigen::Matrix3d, motion::kStandardJointCount> rotations;
  std::array<Eigen::Vector3d, motion::kStandardJointCount> at;
  for (Eigen::Index t = 0; t < places.cols(); ++t) {
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      const auto joint = static_cast<std::size_t>(s);
      const Eigen::Matrix3d own =
          math::exp(pose.angles.col(t).segment<3>(3 * s)).toRotationMatrix();
      if (s == 0) {  // the hips, of no heading
        rotations[joint] = own;
        at[joint].setZero();
        continue;
      }
      const auto parent = static_cast<std::size_t>(motion::kStandardParents[joint]);
      rotations[joint].noalias() = rotations[parent] * own;
      at[joint] = at[parent] + rotations[parent] * body.joint(s).rest_offset;
      places.col(t).segment<3>(3 * (s - 1)) = at[joint] / motion::kStandardLegLengthM;
    }
  }
  return places;
}

Eigen::MatrixXd travel(const motion::PoseMatrix& pose) {
  const Eigen::Index frames = pose.steps.cols();
  const auto reach = static_cast<Eigen::Index>(std::lround(kTravelReachS * pose.frame_rate_hz));
  Eigen::MatrixXd rates(kTravelRowCount, frames);
  std::vector<double> near;
  for (int row = 0; row < kTravelRowCount; ++row) {  // x and z; the third row of steps is yaw
    for (Eigen::Index t = 0; t < frames; ++t) {
      near.clear();
      const Eigen::Index end = std::min(frames, t + reach + 1);
      for (Eigen::Index k = std::max<Eigen::Index>(0, t - reach); k < end; ++k) {
        near.push_back(pose.steps(row, k));
      }
      rates(row, t) = pose.frame_rate_hz * middle_of(near);
    }
  }
  return rates;
}

}  // namespace laban::align
