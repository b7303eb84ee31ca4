#include "align/content_rows.h"

#include <algorithm>
#include <cmath>
#include <vector>

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
  motion::PoseMatrix still = pose;
  still.steps.setZero();
  still.height.setZero();
  const Eigen::MatrixXd joints = motion::standard_joint_positions(still);
  return (joints.bottomRows(kPlaceRowCount) -
          joints.topRows<3>().replicate(kPlaceRowCount / 3, 1)) /
         motion::kStandardLegLengthM;
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
