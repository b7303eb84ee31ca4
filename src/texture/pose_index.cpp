#include "texture/pose_index.h"

#include <algorithm>
#include <cmath>

#include "laban/math/rotation.h"
#include "laban/math/statistics.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXf;
using motion::kAngleRowCount;
using motion::kStandardJointCount;

constexpr double kVelocityS = 0.15;
constexpr double kUsualS = 0.25;
constexpr int kPoseRows = 6 * kStandardJointCount;
constexpr int kFeatureRows = 2 * kPoseRows + 4;
constexpr int kCalmReach = 2;
constexpr double kCalmPercent = 90.0;
constexpr Index kMostRotations = 16384;

Eigen::VectorXf pose_of(const MotionTexture& texture, int frame) {
  Eigen::VectorXf pose(kPoseRows);
  for (int s = 0; s < kStandardJointCount; ++s) {
    const Eigen::Matrix3d r = captured_rotation(texture, s, frame).toRotationMatrix();
    pose.segment<6>(static_cast<Index>(6) * s) = r.leftCols<2>().reshaped().cast<float>();
  }
  return pose;
}

}  // namespace

Eigen::Quaterniond captured_rotation(const MotionTexture& texture, int joint, int frame) {
  const Index row = static_cast<Index>(3) * joint;
  return math::exp(texture.observations.block<3, 1>(row, frame)
                       .cwiseQuotient(texture.space.scale.segment<3>(row)));
}

MatrixXf squared_distances(const MatrixXf& a, const MatrixXf& b) {
  MatrixXf d = -2.0F * a.transpose() * b;
  d.colwise() += a.colwise().squaredNorm().transpose();
  d.rowwise() += b.colwise().squaredNorm();
  return d.cwiseMax(0.0F);
}

// Two rotations by an angle t apart differ by 8 sin^2(t / 2) in the squares of all three columns,
// and by two thirds of that in two, on average over axes.
MatrixXf largest_turns(const MatrixXf& a, const MatrixXf& b) {
  MatrixXf largest = MatrixXf::Zero(a.cols(), b.cols());
  for (Index row = 0; row < kPoseRows; row += 6) {
    largest = largest.cwiseMax(squared_distances(a.middleRows<6>(row), b.middleRows<6>(row)));
  }
  return largest.unaryExpr([](float squares) {
    return 2.0F * std::asin(std::sqrt(std::min(1.0F, squares * 3.0F / 16.0F)));
  });
}

PoseIndex::PoseIndex(const MotionTexture& texture) : texture_(texture) {
  const int apart = std::max(1, static_cast<int>(std::lround(kUsualS * texture.frame_rate_hz)));
  std::vector<MatrixXf> parts;
  std::vector<double> distances;
  Index count = 0;
  for (const Take& take : texture.takes) {
    if (take.length < 2) continue;
    parts.push_back(features(take.begin, take.length - 1, kIndexStride));
    const MatrixXf& part = parts.back();
    const Index step = std::max<Index>(1, apart / kIndexStride);
    for (Index n = 0; n < part.cols(); ++n) {
      coarse_frames_.push_back(take.begin + static_cast<int>(n) * kIndexStride);
      if (n + step < part.cols()) {
        distances.push_back(static_cast<double>((part.col(n + step) - part.col(n)).norm()));
      }
    }
    count += part.cols();
  }
  coarse_.resize(kFeatureRows, count);
  Index at = 0;
  for (const MatrixXf& part : parts) {
    coarse_.middleCols(at, part.cols()) = part;
    at += part.cols();
  }
  if (!distances.empty()) usual_ = math::median(distances);
  find_calm_frames();
}

void PoseIndex::find_calm_frames() {
  const auto frames = static_cast<std::size_t>(texture_.observations.cols());
  std::vector<float> changes(frames, 0.0F);
  for (const Take& take : texture_.takes) {
    const motion::Clip clip = motion::to_standard_clip(
        poses_of(texture_.space, texture_.observations.middleCols(take.begin, take.length),
                 texture_.frame_rate_hz, texture_.leg_length_m));
    const Eigen::MatrixXd p =
        motion::joint_positions(clip).reshaped(3 * clip.joint_count(), clip.frame_count());
    for (Index f = 1; f + 1 < p.cols(); ++f) {
      changes[static_cast<std::size_t>(take.begin + f)] =
          static_cast<float>((p.col(f + 1) - 2.0 * p.col(f) + p.col(f - 1)).norm());
    }
  }
  restless_.resize(frames);
  for (const Take& take : texture_.takes) {
    for (int f = take.begin; f < take.begin + take.length; ++f) {
      const auto from = changes.begin() + std::max(take.begin, f - kCalmReach);
      const auto to = changes.begin() + std::min(take.begin + take.length, f + kCalmReach + 1);
      restless_[static_cast<std::size_t>(f)] = *std::max_element(from, to);
    }
  }
  if (!restless_.empty()) {
    const std::vector<double> all(restless_.begin(), restless_.end());
    calm_ = static_cast<float>(math::percentile(all, kCalmPercent));
  }
}

MatrixXf PoseIndex::features(int begin, int count, int stride) const {
  const auto weight = static_cast<float>(kVelocityS * texture_.frame_rate_hz);
  MatrixXf features(kFeatureRows, (count + stride - 1) / stride);
  Eigen::VectorXf next;
  int known = -1;  // the frame that `next` is of
  for (Index n = 0; n < features.cols(); ++n) {
    const int frame = begin + static_cast<int>(n) * stride;
    const Eigen::VectorXf pose = known == frame ? next : pose_of(texture_, frame);
    next = pose_of(texture_, frame + 1);
    known = frame + 1;
    features.col(n) << pose, weight * (next - pose),
        texture_.observations.col(frame).tail<4>().cast<float>();
  }
  return features;
}

int PoseIndex::take_of(int frame) const {
  const auto after =
      std::upper_bound(texture_.takes.begin(), texture_.takes.end(), frame,
                       [](int value, const Take& take) { return value < take.begin; });
  return static_cast<int>(after - texture_.takes.begin()) - 1;
}

RotationRange::RotationRange(const MotionTexture& texture) {
  const Index stride = std::max<Index>(1, texture.observations.cols() / kMostRotations);
  const Index rows = (texture.observations.cols() + stride - 1) / stride;
  for (int s = 0; s < kStandardJointCount; ++s) {
    Eigen::MatrixX4f& all = captured_.emplace_back(rows, 4);
    for (Index n = 0; n < rows; ++n) {
      all.row(n) = captured_rotation(texture, s, static_cast<int>(n * stride))
                       .coeffs()
                       .cast<float>()
                       .transpose();
    }
  }
}

double RotationRange::distance(int joint, const Eigen::Quaterniond& rotation) const {
  const Eigen::Vector4f q = rotation.coeffs().cast<float>();
  const float nearest = (captured_[static_cast<std::size_t>(joint)] * q).cwiseAbs().maxCoeff();
  return 2.0 * std::acos(std::min(1.0, static_cast<double>(nearest)));
}

Eigen::Quaterniond RotationRange::nearest(int joint, const Eigen::Quaterniond& rotation) const {
  const Eigen::MatrixX4f& all = captured(joint);
  Index row = 0;
  (all * rotation.coeffs().cast<float>()).cwiseAbs().maxCoeff(&row);
  const Eigen::Vector4d coefficients = all.row(row).transpose().cast<double>();
  return Eigen::Quaterniond(coefficients).normalized();
}

}  // namespace laban::texture
