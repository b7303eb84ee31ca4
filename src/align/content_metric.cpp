#include "laban/align/content_metric.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "laban/base/error.h"
#include "laban/math/rotation.h"

#include "align/content_scatter.h"

namespace laban::align {
namespace {

using base::Error;
using base::ErrorKind;
using motion::kAngleRowCount;
using motion::PoseMatrix;

// One joint's curve begun `turns` whole turns away and kept continuous.
Eigen::Matrix3Xd shifted_branch(const Eigen::Ref<const Eigen::Matrix3Xd>& curve,
                                const Eigen::Vector3d& axis, int turns) {
  Eigen::Matrix3Xd shifted(3, curve.cols());
  Eigen::Vector3d previous = curve.col(0) + 2.0 * std::numbers::pi * turns * axis;
  for (Eigen::Index t = 0; t < curve.cols(); ++t) {
    previous = math::nearest_branch(curve.col(t), previous);
    shifted.col(t) = previous;
  }
  return shifted;
}

// The axis along which whole turns are added at a curve's first frame.
Eigen::Vector3d turn_axis(const Eigen::Vector3d& first, const Eigen::Vector3d& reference) {
  constexpr double kNoAxis = 1e-9;  // as math::nearest_branch
  if (first.norm() > kNoAxis) return first.normalized();
  return reference.norm() > kNoAxis ? Eigen::Vector3d(reference.normalized())
                                    : Eigen::Vector3d::UnitX();
}

// Without contents to tell apart: every joint weighs by its own spread, still ones not above a
// tenth of the mean spread's worth; the other rows count nothing.
Eigen::MatrixXd spread_map(const Eigen::MatrixXd& all, double shrinkage, int dimensions) {
  const Eigen::MatrixXd total = all.topLeftCorner<kAngleRowCount, kAngleRowCount>();
  const double mean_variance = total.trace() / static_cast<double>(total.rows());
  Eigen::VectorXd scale(total.rows());
  for (Eigen::Index row = 0; row < total.rows(); row += 3) {
    const double variance = total.diagonal().segment<3>(row).mean();
    scale.segment<3>(row).setConstant(
        1.0 / std::sqrt((1.0 - shrinkage) * variance + shrinkage * mean_variance + 1e-12));
  }
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(dimensions, kContentRowCount);
  if (dimensions >= kAngleRowCount) {
    map.topLeftCorner<kAngleRowCount, kAngleRowCount>() = scale.asDiagonal();
    return map;
  }
  const Eigen::MatrixXd scaled = scale.asDiagonal() * total * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scaled);
  const Eigen::MatrixXd directions = solver.eigenvectors().rightCols(dimensions).transpose();
  map.leftCols<kAngleRowCount>() = directions.colwise().reverse() * scale.asDiagonal();
  return map;
}

}  // namespace

Eigen::MatrixXd on_branch_of(const Eigen::Ref<const Eigen::MatrixXd>& angles,
                             const Eigen::Ref<const Eigen::VectorXd>& reference) {
  Eigen::MatrixXd result = angles;
  for (Eigen::Index row = 0; row + 3 <= angles.rows(); row += 3) {
    const Eigen::Matrix3Xd curve = angles.middleRows<3>(row);
    const Eigen::Vector3d target = reference.segment<3>(row);
    // |r| + |reference| <= pi: no other branch can be nearer.
    if (curve.colwise().norm().maxCoeff() + target.norm() <= std::numbers::pi) continue;
    const Eigen::Vector3d axis = turn_axis(curve.col(0), target);
    double best = (curve.colwise() - target).squaredNorm();
    for (const int turns : {-1, 1, -2, 2}) {
      const Eigen::Matrix3Xd shifted = shifted_branch(curve, axis, turns);
      const double cost = (shifted.colwise() - target).squaredNorm();
      if (cost < best) {
        best = cost;
        result.middleRows<3>(row) = shifted;
      }
    }
  }
  return result;
}

ContentMetric::ContentMetric(MetricKind kind, Eigen::MatrixXd map, Eigen::VectorXd reference)
    : kind_(kind), map_(std::move(map)), reference_(std::move(reference)) {
  const int columns = kind_ == MetricKind::kRaw ? kAngleRowCount : kContentRowCount;
  if (map_.cols() != columns || map_.rows() < 1 || map_.rows() > columns ||
      reference_.size() != kAngleRowCount) {
    throw Error(ErrorKind::kData, "ContentMetric: map " + std::to_string(map_.rows()) + " x " +
                                      std::to_string(map_.cols()) + ", reference " +
                                      std::to_string(reference_.size()) +
                                      " (must be k x 126, 1 <= k <= 126, and 63)");
  }
  if (!map_.allFinite() || !reference_.allFinite()) {
    throw Error(ErrorKind::kData, "ContentMetric: a value is not finite");
  }
}

ContentMetric::ContentMetric(Eigen::MatrixXd map, Eigen::VectorXd reference)
    : ContentMetric(MetricKind::kContent, std::move(map), std::move(reference)) {}

ContentMetric ContentMetric::raw() {
  return {MetricKind::kRaw, Eigen::MatrixXd::Identity(kAngleRowCount, kAngleRowCount),
          Eigen::VectorXd::Zero(kAngleRowCount)};
}

Eigen::VectorXd ContentMetric::mean_pose(std::span<const PoseMatrix> clips,
                                         std::span<const int> groups) const {
  if (clips.empty()) throw Error(ErrorKind::kData, "ContentMetric::mean_pose: no clip");
  require_sizes(clips.size(), groups.size(), "groups", "ContentMetric::mean_pose");
  std::vector<Eigen::MatrixXd> rows;
  for (const PoseMatrix& clip : clips) rows.push_back(content_rows(clip, reference_));
  return row_mean(rows, groups);
}

Eigen::MatrixXd ContentMetric::features(const PoseMatrix& pose,
                                        const Eigen::Ref<const Eigen::VectorXd>& mean_pose) const {
  if (kind_ == MetricKind::kRaw) return pose.angles;
  return map_ * (content_rows(pose, reference_).colwise() - mean_pose);
}

std::vector<std::string> ContentMetricOptions::problems() const {
  std::vector<std::string> found;
  if (!(shrinkage >= 0.0 && shrinkage <= 1.0)) {
    found.push_back("ContentMetricOptions::shrinkage = " + std::to_string(shrinkage) +
                    " (must be in [0, 1])");
  }
  if (dimensions < 1 || dimensions > kContentRowCount) {
    found.push_back("ContentMetricOptions::dimensions = " + std::to_string(dimensions) +
                    " (must be 1 to 126)");
  }
  if (threads < 0) {
    found.push_back("ContentMetricOptions::threads = " + std::to_string(threads) +
                    " (must be >= 0)");
  }
  return found;
}

ContentMetric fit_content_metric(std::span<const PoseMatrix> fragments, std::span<const int> groups,
                                 std::span<const int> performers,
                                 const ContentMetricOptions& options) {
  base::require_none(options.problems());
  if (fragments.empty()) throw Error(ErrorKind::kData, "fit_content_metric: no fragment");
  require_sizes(fragments.size(), groups.size(), "groups", "fit_content_metric");
  require_sizes(fragments.size(), performers.size(), "performers", "fit_content_metric");

  const int dimensions = options.dimensions;
  Eigen::VectorXd reference = common_reference(fragments);
  const std::vector<Eigen::MatrixXd> rows = centered_rows(fragments, groups, performers, reference);
  const ContentScatter scatter(rows, groups, performers, options.threads);
  const std::optional<Eigen::MatrixXd> within = scatter.within();
  Eigen::MatrixXd map =
      within ? likelihood_ratio_map(scatter.total(), *within, options.shrinkage, dimensions)
             : spread_map(scatter.total(), options.shrinkage, dimensions);
  return {std::move(map), std::move(reference)};
}

}  // namespace laban::align
