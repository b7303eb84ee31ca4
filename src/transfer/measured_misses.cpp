#include "laban/transfer/measured_misses.h"

#include <algorithm>
#include <cmath>

namespace laban::transfer {
namespace {

/// Nearer blend weights are told from one another by round-off and chance.
constexpr double kSameAlpha = 0.02;
/// Of the prediction's variance: what measuring others leaves at least.
constexpr double kLeastLeft = 0.05;

FragmentPair pair_of(const BlendChoice& choice) {
  return {choice.fragment_i, choice.fragment_j};
}

/// 4 b.
double middle_of(const BlendChoice& choice) {
  double squares = 0.0;
  for (const BlendShare& share : choice.shares()) squares += share.weight * share.weight;
  return 2.0 * (1.0 - squares);
}

bool are_alike(const BlendChoice& a, const BlendChoice& b) {
  const auto same_step = [](const BlendStep& s, const BlendStep& t) {
    return s.fragment == t.fragment && std::abs(s.alpha - t.alpha) < kSameAlpha;
  };
  return pair_of(a) == pair_of(b) && std::abs(a.alpha - b.alpha) < kSameAlpha &&
         std::equal(a.further.begin(), a.further.end(), b.further.begin(), b.further.end(),
                    same_step);
}

}  // namespace

void MeasuredMisses::add(const BlendChoice& choice, const effort::EffortVector& miss) {
  measured_.push_back({choice, middle_of(choice), miss});
}

bool MeasuredMisses::has(const BlendChoice& choice) const {
  return std::any_of(measured_.begin(), measured_.end(),
                     [&](const Measured& known) { return are_alike(known.choice, choice); });
}

/// Of what was measured with the miss of a pair's blends at their middle.
Eigen::VectorXd MeasuredMisses::covariances_with(const FragmentPair& pair) const {
  Eigen::VectorXd covariances(std::ssize(measured_));
  for (std::size_t n = 0; n < measured_.size(); ++n) {
    const double own = pair_of(measured_[n].choice) == pair ? 1.0 - kCommon : 0.0;
    covariances[static_cast<Eigen::Index>(n)] = measured_[n].middle * (kCommon + own);
  }
  return covariances;
}

Correction MeasuredMisses::of_pair(const FragmentPair& pair, const Eigen::MatrixXd& inverse) const {
  const Eigen::VectorXd covariances = covariances_with(pair);
  const Eigen::VectorXd weights = inverse * covariances;
  Correction correction;
  correction.miss = weights[0] * measured_[0].miss;
  for (std::size_t n = 1; n < measured_.size(); ++n)
    correction.miss += weights[static_cast<Eigen::Index>(n)] * measured_[n].miss;
  correction.error_share = std::sqrt(std::max(kLeastLeft, 1.0 - covariances.dot(weights)));
  return correction;
}

std::vector<Correction> MeasuredMisses::of_pairs(std::span<const FragmentPair> pairs) const {
  if (measured_.empty()) return {};
  Eigen::MatrixXd covariance(std::ssize(measured_), std::ssize(measured_));
  for (std::size_t n = 0; n < measured_.size(); ++n) {
    const auto column = static_cast<Eigen::Index>(n);
    covariance.col(column) = measured_[n].middle * covariances_with(pair_of(measured_[n].choice));
    covariance(column, column) += kNoise;
  }
  const Eigen::MatrixXd inverse = covariance.inverse();
  const Correction of_others = of_pair({-1, -1}, inverse);
  std::vector<Correction> corrections(pairs.size(), of_others);
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const bool was_tried =
        std::any_of(measured_.begin(), measured_.end(),
                    [&](const Measured& known) { return pair_of(known.choice) == pairs[p]; });
    if (was_tried) corrections[p] = of_pair(pairs[p], inverse);
    corrections[p].settled =
        std::find(settled_.begin(), settled_.end(), pairs[p]) != settled_.end();
  }
  return corrections;
}

}  // namespace laban::transfer
