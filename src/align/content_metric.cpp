#include "laban/align/content_metric.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/math/parallel.h"
#include "laban/math/rotation.h"
#include "laban/math/statistics.h"

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

// How much a frame of each sequence counts: the same; or, with groups, so that every group counts
// the same.
std::vector<double> frame_weights(std::span<const Eigen::MatrixXd> sequences,
                                  std::span<const int> groups) {
  std::vector<double> weights(sequences.size(), 1.0);
  if (groups.empty()) return weights;
  std::map<int, double> frames_of;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    frames_of[groups[i]] += static_cast<double>(sequences[i].cols());
  }
  for (std::size_t i = 0; i < sequences.size(); ++i) weights[i] = 1.0 / frames_of[groups[i]];
  return weights;
}

Eigen::VectorXd row_mean(std::span<const Eigen::MatrixXd> sequences,
                         std::span<const int> groups = {}) {
  const std::vector<double> weights = frame_weights(sequences, groups);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(sequences[0].rows());
  double total = 0.0;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    sum += weights[i] * sequences[i].rowwise().sum();
    total += weights[i] * static_cast<double>(sequences[i].cols());
  }
  return sum / total;
}

// A pose from which few clips are whole turns away: the median of the clips' mean poses, then the
// mean of what that puts on one branch.
Eigen::VectorXd common_reference(std::span<const PoseMatrix> clips) {
  const auto count = static_cast<Eigen::Index>(clips.size());
  Eigen::MatrixXd means(kAngleRowCount, count);
  for (Eigen::Index c = 0; c < count; ++c) {
    means.col(c) = clips[static_cast<std::size_t>(c)].angles.rowwise().mean();
  }
  Eigen::VectorXd reference(kAngleRowCount);
  for (int row = 0; row < kAngleRowCount; ++row) {
    const Eigen::VectorXd values = means.row(row).transpose();
    reference(row) = math::median(math::as_span(values));
  }
  std::vector<Eigen::MatrixXd> angles;
  for (const PoseMatrix& clip : clips) angles.push_back(on_branch_of(clip.angles, reference));
  return row_mean(angles);
}

// The angles of one joint on the branches nearest to `reference`: one branch for each stretch
// without a cut. Across a cut (of an edited capture) unwrapping would go on from another pose and
// may leave all that follows a whole turn away.
Eigen::Matrix3Xd on_branches_between_cuts(const Eigen::Ref<const Eigen::Matrix3Xd>& curve,
                                          const Eigen::Vector3d& reference) {
  constexpr double kCut = 1.0;  // radians from one frame to the next
  Eigen::Matrix3Xd result(3, curve.cols());
  Eigen::Index begin = 0;
  for (Eigen::Index t = 1; t <= curve.cols(); ++t) {
    if (t < curve.cols() &&
        math::angle_between(math::exp(curve.col(t - 1)), math::exp(curve.col(t))) <= kCut)
      continue;
    result.middleCols(begin, t - begin) =
        on_branch_of(curve.middleCols(begin, t - begin), reference);
    begin = t;
  }
  return result;
}

// kContentRowCount x F: angles on the reference's branches, height.
Eigen::MatrixXd content_rows(const PoseMatrix& pose, const Eigen::VectorXd& reference) {
  Eigen::MatrixXd rows(kContentRowCount, pose.angles.cols());
  for (Eigen::Index row = 0; row < kAngleRowCount; row += 3) {
    rows.middleRows<3>(row) =
        on_branches_between_cuts(pose.angles.middleRows<3>(row), reference.segment<3>(row));
  }
  rows.bottomRows<1>() = pose.height;
  return rows;
}

// The fragments' rows, each less its performer's mean pose.
std::vector<Eigen::MatrixXd> centered_rows(std::span<const PoseMatrix> fragments,
                                           std::span<const int> groups,
                                           std::span<const int> performers,
                                           const Eigen::VectorXd& reference) {
  std::vector<Eigen::MatrixXd> rows;
  std::map<int, std::vector<std::size_t>> fragments_of;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    rows.push_back(content_rows(fragments[i], reference));
    fragments_of[performers.empty() ? static_cast<int>(i) : performers[i]].push_back(i);
  }
  for (const auto& [performer, members] : fragments_of) {
    std::vector<Eigen::MatrixXd> own;
    std::vector<int> own_groups;
    for (const std::size_t i : members) {
      own.push_back(rows[i]);
      if (!groups.empty()) own_groups.push_back(groups[i]);
    }
    const Eigen::VectorXd mean = row_mean(own, own_groups);
    for (const std::size_t i : members) rows[i].colwise() -= mean;
  }
  return rows;
}

Eigen::MatrixXd covariance(std::span<const Eigen::MatrixXd> sequences,
                           std::span<const int> groups) {
  const std::vector<double> weights = frame_weights(sequences, groups);
  const Eigen::VectorXd mean = row_mean(sequences, groups);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(mean.size(), mean.size());
  double total = 0.0;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    const Eigen::MatrixXd centered = sequences[i].colwise() - mean;
    sum += weights[i] * (centered * centered.transpose());
    total += weights[i] * static_cast<double>(centered.cols());
  }
  return sum / total;
}

struct Pair {
  std::size_t i;
  std::size_t j;
  double weight;  // the pairs of a group together weigh 1
};

// Pairs of one group: by two performers where there are such, else all.
std::vector<Pair> same_content_pairs(std::span<const int> groups, std::span<const int> performers) {
  std::map<int, std::array<std::vector<Pair>, 2>> pairs_of;  // [by one performer, by two]
  for (std::size_t i = 0; i < groups.size(); ++i) {
    for (std::size_t j = i + 1; j < groups.size(); ++j) {
      if (groups[i] != groups[j]) continue;
      const bool two = performers.empty() || performers[i] != performers[j];
      pairs_of[groups[i]][two ? 1 : 0].push_back({i, j, 0.0});
    }
  }
  std::vector<Pair> pairs;
  for (const auto& [group, kinds] : pairs_of) {
    for (Pair pair : kinds[1].empty() ? kinds[0] : kinds[1]) {
      pair.weight = 1.0 / static_cast<double>((kinds[1].empty() ? kinds[0] : kinds[1]).size());
      pairs.push_back(pair);
    }
  }
  return pairs;
}

// Mean over a pair's path, found by the angles, of the outer product of frame differences.
Eigen::MatrixXd path_scatter(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  const std::vector<FramePair> path =
      dtw(x.topRows<kAngleRowCount>(), y.topRows<kAngleRowCount>()).path;
  Eigen::MatrixXd difference(x.rows(), static_cast<Eigen::Index>(path.size()));
  for (std::size_t n = 0; n < path.size(); ++n) {
    difference.col(static_cast<Eigen::Index>(n)) = x.col(path[n].p) - y.col(path[n].q);
  }
  return difference * difference.transpose() / static_cast<double>(path.size());
}

// S_w: every group counts the same, every pair in it too, whatever its length.
Eigen::MatrixXd within_scatter(std::span<const Eigen::MatrixXd> rows, std::span<const Pair> pairs,
                               int threads) {
  std::vector<Eigen::MatrixXd> scatters(pairs.size());
  math::parallel_for(static_cast<int>(pairs.size()), threads, [&](int n) {
    const Pair& pair = pairs[static_cast<std::size_t>(n)];
    scatters[static_cast<std::size_t>(n)] = pair.weight * path_scatter(rows[pair.i], rows[pair.j]);
  });
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(kContentRowCount, kContentRowCount);
  double total = 0.0;
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    sum += scatters[n];
    total += pairs[n].weight;
  }
  return sum / total;
}

// Part of S_w's own spread replaced by the same everywhere: among the angles, and for the height.
Eigen::MatrixXd shrunk(const Eigen::MatrixXd& within, double shrinkage) {
  const double floor = 1e-12;        // radians^2: motionless fragments still give a metric
  const double height_floor = 4e-4;  // leg lengths^2: 2 % of a leg, about 2 cm, says nothing
  Eigen::MatrixXd result = (1.0 - shrinkage) * within;
  result.diagonal().head<kAngleRowCount>().array() +=
      shrinkage * within.diagonal().head<kAngleRowCount>().mean();
  result.diagonal().tail<1>().array() +=
      shrinkage * within.diagonal().tail<1>().value() + height_floor;
  result.diagonal().array() += floor;
  return result;
}

// Two frames of one content differ by N(0, S_w), two unrelated ones by N(0, 2 S_t). The quadratic
// part of the log-likelihood ratio is the metric M = S_w^-1 - (2 S_t)^-1 [Koestinger12]. With
// S_t v = lambda S_w v, v' S_w v = 1 it is sum (1 - 1 / (2 lambda)) v v': what tells contents apart
// counts about 1 whatever its size, what does not counts nothing (lambda <= 1/2: dropped).
Eigen::MatrixXd likelihood_ratio_map(const Eigen::MatrixXd& total, const Eigen::MatrixXd& within,
                                     double shrinkage, int dimensions) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(total,
                                                                         shrunk(within, shrinkage));
  if (solver.info() != Eigen::Success) {
    throw Error(ErrorKind::kNumeric,
                "fit_content_metric: the scatter within contents has no square root; raise "
                "ContentMetricOptions::shrinkage");
  }
  const Eigen::VectorXd lambda = solver.eigenvalues().cwiseMax(0.5);
  const Eigen::VectorXd scale = (1.0 - 0.5 * lambda.array().inverse()).sqrt();
  const Eigen::MatrixXd rows = scale.asDiagonal() * solver.eigenvectors().transpose();
  return rows.colwise().reverse().topRows(dimensions);
}

// Without contents to tell apart: every joint weighs by its own spread, still ones not above a
// tenth of the mean spread's worth; height counts nothing.
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

void require_sizes(std::size_t fragments, std::size_t given, const std::string& what,
                   const std::string& place) {
  if (given != 0 && given != fragments) {
    throw Error(ErrorKind::kUsage, place + ": " + std::to_string(given) + " " + what + " for " +
                                       std::to_string(fragments) + " fragments");
  }
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
                                      " (must be k x 64, 1 <= k <= 64, and 63)");
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
                    " (must be 1 to 64)");
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
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
  if (fragments.empty()) throw Error(ErrorKind::kData, "fit_content_metric: no fragment");
  require_sizes(fragments.size(), groups.size(), "groups", "fit_content_metric");
  require_sizes(fragments.size(), performers.size(), "performers", "fit_content_metric");

  const int dimensions = options.dimensions;
  Eigen::VectorXd reference = common_reference(fragments);
  const std::vector<Eigen::MatrixXd> rows = centered_rows(fragments, groups, performers, reference);
  const Eigen::MatrixXd total = covariance(rows, groups);
  const std::vector<Pair> pairs = same_content_pairs(groups, performers);
  Eigen::MatrixXd map =
      pairs.empty() ? spread_map(total, options.shrinkage, dimensions)
                    : likelihood_ratio_map(total, within_scatter(rows, pairs, options.threads),
                                           options.shrinkage, dimensions);
  return {std::move(map), std::move(reference)};
}

}  // namespace laban::align
