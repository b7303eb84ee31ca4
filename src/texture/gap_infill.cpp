#include "laban/texture/gap_infill.h"

#include <algorithm>
#include <array>
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

// Of what predicts the next frame, one that was wrong by twice the squares counts a sixteenth.
constexpr double kPredictionPower = 4.0;

/// What follows each two neighbouring frames at constant velocity, d x (F - 1).
MatrixXd steady(const MatrixXd& y) {
  const Index n = y.cols() - 1;
  return 2.0 * y.rightCols(n) - y.leftCols(n);
}

/// What a texton lets follow them; what it cannot show goes on at constant velocity.
MatrixXd continued(const Texton& texton, const MatrixXd& y) {
  const Index n = y.cols() - 1;
  const MatrixXd centered = y.colwise() - texton.mean;
  const MatrixXd x = texton.basis.transpose() * centered;
  // A1 x_t + A2 x_{t-1} + D, less what constant velocity makes of the states.
  MatrixXd bend =
      texton.dynamics.a1 * x.rightCols(n) + texton.dynamics.a2 * x.leftCols(n) - steady(x);
  bend.colwise() += texton.dynamics.offset;
  return steady(y) + texton.basis * bend;
}

constexpr std::array<int, 5> kTrustGaps{5, 15, 30, 45, 60};
constexpr int kGapsLearntFrom = 300;
constexpr std::size_t kTrustParts = 3;

/// How far a motion is from another one, given its offsets: the mean over frames.
double size_of(const MatrixXd& offsets) {
  return offsets.topRows(kStepRow).colwise().norm().mean();
}

/// The straight line through values at ascending places, level outside; 1 without any.
double read_between(const std::vector<double>& places, const std::vector<double>& values,
                    double place) {
  if (values.empty()) return 1.0;
  if (place <= places.front()) return values.front();
  for (std::size_t n = 1; n < places.size(); ++n) {
    if (place > places[n]) continue;
    const double share = (place - places[n - 1]) / std::max(1e-12, places[n] - places[n - 1]);
    return (1.0 - share) * values[n - 1] + share * values[n];
  }
  return values.back();
}

/// Arcs of rotations and straight lines of the rest over a gap. @param ends  d x 2.
MatrixXd arcs(const ObservationSpace& space, const Ref<const MatrixXd>& ends, int gap) {
  const VectorXd way = offset_between(space, ends.col(0), ends.col(1));
  MatrixXd offsets(ends.rows(), gap);
  for (int f = 0; f < gap; ++f) offsets.col(f) = (f + 1.0) / (gap + 1.0) * way;
  return with_offsets(space, ends.col(0).replicate(1, gap), offsets);
}

/// Offsets of every frame of a motion from another one's.
MatrixXd offsets_of(const ObservationSpace& space, const MatrixXd& from, const MatrixXd& to) {
  MatrixXd offsets(from.rows(), from.cols());
  for (Index f = 0; f < from.cols(); ++f) {
    offsets.col(f) = offset_between(space, from.col(f), to.col(f));
  }
  return offsets;
}

/// The two frames before and the two after a gap, told on branches that are nearest to each other.
MatrixXd ends_of(const ObservationSpace& space, const Ref<const MatrixXd>& before,
                 const Ref<const MatrixXd>& after) {
  MatrixXd ends(before.rows(), 4);
  ends << before.rightCols(2), on_branches_near(space, after.leftCols(2), before.rightCols<1>());
  return ends;
}

}  // namespace

GapInfill::GapInfill(const MotionTexture& texture, const GapInfillOptions& options)
    : options_(options), space_(texture.space), textons_(texture.textons) {
  if (options.texton_of_all) {
    textons_.push_back(texton_of_all(texture));
    learn_trust(texture);
  }
  for (const Texton& texton : textons_) likelihoods_.emplace_back(texton);
}

// Of arcs + w (texton - arcs) the w, to a twentieth, that leaves the least error, summed over
// frames as it is, not squared: a few frames of broken capture would else decide. Each third of the
// gaps by how far texton and arcs are apart has its own.
void GapInfill::learn_trust(const MotionTexture& texture) {
  constexpr int kShares = 20;
  const int step = std::max(1, static_cast<int>(texture.observations.cols()) / kGapsLearntFrom);
  struct Gap {
    double size;
    VectorXd errors;
  };
  for (const int gap : kTrustGaps) {
    std::vector<Gap> gaps;
    for (const Take& take : texture.takes) {
      const int room = take.length - gap - 4;
      const int count = room < 0 ? 0 : std::max(1, take.length / step);
      for (int k = 0; k < count; ++k) {  // evenly spread: takes begin and end in stillness
        const int begin = take.begin + 2 + static_cast<int>((k + 0.5) / count * room);
        const MatrixXd ends = ends_of(space_, texture.observations.middleCols(begin - 2, 2),
                                      texture.observations.middleCols(begin + gap, 2));
        const MatrixXd straight = arcs(space_, ends.middleCols(1, 2), gap);
        const MatrixXd made =
            offsets_of(space_, straight, bridge(textons_.back(), ends, gap).filled);
        const MatrixXd truth =
            offsets_of(space_, straight, texture.observations.middleCols(begin, gap));
        VectorXd errors(kShares + 1);
        for (int n = 0; n <= kShares; ++n) {
          const double share = static_cast<double>(n) / kShares;
          errors[n] = (share * made - truth).topRows(kStepRow).colwise().norm().sum();
        }
        gaps.push_back({size_of(made), std::move(errors)});
      }
    }
    std::sort(gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) { return a.size < b.size; });
    Trust trust;
    for (std::size_t part = 0; part < kTrustParts; ++part) {
      const std::size_t from = part * gaps.size() / kTrustParts;
      const std::size_t to = (part + 1) * gaps.size() / kTrustParts;
      if (from == to) continue;
      VectorXd errors = VectorXd::Zero(kShares + 1);
      for (std::size_t n = from; n < to; ++n) errors += gaps[n].errors;
      Index best = 0;
      const double least = errors.minCoeff(&best);
      trust.sizes.push_back(gaps[(from + to) / 2].size);
      trust.shares.push_back(least > 0.0 ? static_cast<double>(best) / kShares : 1.0);
    }
    trusts_.push_back(std::move(trust));
  }
}

double GapInfill::trust(int gap, double size) const {
  if (trusts_.empty()) return 1.0;
  std::vector<double> gaps(kTrustGaps.begin(), kTrustGaps.end());
  std::vector<double> shares;
  for (const Trust& one : trusts_) shares.push_back(read_between(one.sizes, one.shares, size));
  return read_between(gaps, shares, gap);
}

VectorXd GapInfill::next(const Ref<const MatrixXd>& y) const {
  if (y.cols() < 3) throw Error(ErrorKind::kUsage, "GapInfill::next needs at least three frames");
  const MatrixXd context = y.rightCols(std::min<Index>(y.cols(), std::max(3, options_.context)));
  const Index known = context.cols() - 2;
  std::vector<MatrixXd> predictions{steady(context)};
  for (const Texton& texton : textons_) predictions.push_back(continued(texton, context));
  VectorXd squares(std::ssize(predictions));
  for (Index i = 0; i < squares.size(); ++i) {
    const MatrixXd& one = predictions[static_cast<std::size_t>(i)];
    squares[i] = (one.leftCols(known) - context.rightCols(known)).squaredNorm();
  }
  const double least = squares.minCoeff();
  if (least == 0.0) return predictions.front().col(known);  // nothing moves but evenly
  const VectorXd weights = (squares / least).array().pow(-kPredictionPower);
  VectorXd predicted = VectorXd::Zero(y.rows());
  for (Index i = 0; i < squares.size(); ++i) {
    predicted += weights[i] / weights.sum() * predictions[static_cast<std::size_t>(i)].col(known);
  }
  return predicted;
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
  MatrixXd right = on_branches_near(space_, y.middleCols(end, after), left.rightCols<1>());
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
  const MatrixXd straight = arcs(space_, ends.middleCols(1, 2), gap);
  MatrixXd result = y;
  const MatrixXd offsets = offsets_of(space_, straight, filled);
  result.middleCols(begin, gap) =
      with_offsets(space_, straight, trust(gap, size_of(offsets)) * offsets);
  result.col(end).tail<3>() = right.col(0).tail<3>();
  const Eigen::Vector3d scale = space_.scale.tail<3>();
  auto steps = result.block(kStepRow, begin, 3, gap + 1);
  steps = scale.asDiagonal() * closed(scale.cwiseInverse().asDiagonal() * MatrixXd(steps), way);
  return result;
}

}  // namespace laban::texture
