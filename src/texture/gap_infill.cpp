#include "laban/texture/gap_infill.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/motion/pose_matrix.h"
#include "laban/texture/constrained_synthesis.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Ref;
using Eigen::VectorXd;

/// One texton's way over a gap.
struct Bridge {
  MatrixXd filled;  ///< d x gap
  double log_density = 0.0;
};

/// @param ends  d x 4: the frames before and after the gap.
Bridge bridge(const Texton& texton, const MatrixXd& ends, int gap) {
  const MatrixXd centered = ends.colwise() - texton.mean;
  const MatrixXd states = texton.basis.transpose() * centered;
  const MatrixXd beside = centered - texton.basis * states;
  const int length = gap + 4;
  MatrixXd known = MatrixXd::Zero(texton.dimension(), length);
  known.leftCols(2) = states.leftCols(2);
  known.rightCols(2) = states.rightCols(2);
  const ConstrainedStates system(texton.dynamics, length, {0, 1, length - 2, length - 1});
  const MatrixXd x = system.solve(known, MatrixXd());
  Bridge found;
  found.filled = (texton.basis * x.middleCols(2, gap)).colwise() + texton.mean;
  for (int f = 0; f < gap; ++f) {
    const double share = (f + 1.0) / (gap + 1.0);
    found.filled.col(f) += (1.0 - share) * beside.col(1) + share * beside.col(2);
  }
  const double outside = static_cast<double>(ends.rows() - texton.dimension());
  found.log_density =
      system.log_density(x) -
      0.5 * (beside.rightCols(2).squaredNorm() / texton.residual_variance +
             2.0 * outside * (math::kLogTwoPi + std::log(texton.residual_variance)));
  return found;
}

/// Steps of a root path that keeps its course and ends after `way`.
/// @param steps  3 x n, leg lengths and radians.
Eigen::Matrix3Xd closed(const Eigen::Matrix3Xd& steps, const Eigen::Vector3d& way) {
  motion::PoseMatrix pose;
  pose.angles.resize(0, steps.cols() + 1);
  pose.steps.resize(3, steps.cols() + 1);
  pose.steps.col(0).setZero();
  pose.steps.rightCols(steps.cols()) = steps;
  const Index last = steps.cols();
  const auto share = [&](Index t) {
    const double x = static_cast<double>(t) / static_cast<double>(last);
    return x * x * (3.0 - 2.0 * x);
  };
  const double turn = way[2] - steps.row(2).sum();
  for (Index t = 1; t <= last; ++t) pose.steps(2, t) += turn * (share(t) - share(t - 1));
  Eigen::Matrix3Xd path = motion::planar_path(pose);
  const Eigen::Vector2d off = way.head<2>() - path.col(last).head<2>();
  for (Index t = 1; t <= last; ++t) path.col(t).head<2>() += share(t) * off;
  return motion::planar_steps(path).rightCols(last);
}

Texton texton_of_all(const MotionTexture& texture) {
  std::vector<Segment> takes;
  for (const Take& take : texture.takes) {
    if (take.length >= 3) takes.push_back({take.begin, take.length, 0});
  }
  TextonFit fit;
  fit.max_dimension = kObservationRows;
  fit.explained_share = 0.9999;
  fit.ridge = 1e-6;
  return fit_texton(texture.observations, takes, fit);
}

}  // namespace

GapInfill::GapInfill(const MotionTexture& texture, const GapInfillOptions& options)
    : options_(options), step_scale_(texture.space.scale.tail<3>()), textons_(texture.textons) {
  if (options.texton_of_all) textons_.push_back(texton_of_all(texture));
  for (const Texton& texton : textons_) likelihoods_.emplace_back(texton);
}

MatrixXd GapInfill::fill(const Ref<const MatrixXd>& y, int begin, int end,
                         const Eigen::Vector3d& way) const {
  const auto frames = static_cast<int>(y.cols());
  if (begin < 2 || end <= begin || end + 2 > frames) {
    throw Error(ErrorKind::kUsage, "a gap of frames [" + std::to_string(begin) + ", " +
                                       std::to_string(end) + ") in " + std::to_string(frames) +
                                       " has no two frames on either side");
  }
  const int gap = end - begin;
  const int before = std::min(begin, std::max(2, options_.context));
  const int after = std::min(frames - end, std::max(2, options_.context));
  const MatrixXd left = y.middleCols(begin - before, before);
  MatrixXd right = y.middleCols(end, after);
  right.col(0).tail<3>() = right.col(1).tail<3>();  // the step out of the gap is not known
  MatrixXd ends(y.rows(), 4);
  ends << left.rightCols(2), right.leftCols(2);

  const auto count = static_cast<int>(likelihoods_.size());
  VectorXd context(count);
  for (int i = 0; i < count; ++i) {
    const TextonLikelihood& one = likelihoods_[static_cast<std::size_t>(i)];
    context[i] = one.segment(left) + one.step_terms(right).tail(after - 2).sum();
  }
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  const auto kept =
      std::min<std::size_t>(order.size(), 4 * static_cast<std::size_t>(options_.textons));
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(kept), order.end(),
                    [&](int a, int b) { return context[a] > context[b]; });
  order.resize(kept);
  std::vector<Bridge> bridges;
  VectorXd score(std::ssize(order));
  for (std::size_t n = 0; n < order.size(); ++n) {
    bridges.push_back(bridge(textons_[static_cast<std::size_t>(order[n])], ends, gap));
    score[static_cast<Index>(n)] = context[order[n]] + bridges.back().log_density;
  }
  const VectorXd weights = ((score.array() - score.maxCoeff()) / options_.temperature).exp();
  MatrixXd filled = MatrixXd::Zero(y.rows(), gap);
  for (std::size_t n = 0; n < bridges.size(); ++n) {
    filled += (weights[static_cast<Index>(n)] / weights.sum()) * bridges[n].filled;
  }
  MatrixXd result = y;
  result.middleCols(begin, gap) = filled;
  result.col(end).tail<3>() = right.col(0).tail<3>();
  const Eigen::Vector3d scale = step_scale_;
  auto steps = result.block(kStepRow, begin, 3, gap + 1);
  steps = scale.asDiagonal() * closed(scale.cwiseInverse().asDiagonal() * MatrixXd(steps), way);
  return result;
}

}  // namespace laban::texture
