#pragma once

#include <span>
#include <vector>

#include "laban/effort/effort.h"
#include "laban/transfer/style_search.h"

namespace laban::transfer {

/// (Ours.) What blends that were played and measured tell of others. A regressor is never quite
/// right; what it is wrong by is alike for all blends that are searched, more so for those of one
/// pair, and nothing at a fragment itself. So a miss is taken for a Gaussian process,
///
///   measured - predicted = 4 b (common + own of the pair) + noise,   b = (1 - sum_k w_k^2) / 2
///
/// of shares w, which is alpha (1 - alpha) for two, with variances kCommon, 1 - kCommon and kNoise
/// in units of the regressor's. Its mean moves predictions; its variance is what is left of theirs.
class MeasuredMisses {
 public:
  static constexpr double kCommon = 0.4;
  static constexpr double kNoise = 0.05;

  /// @param miss  measured less predicted, a value a factor.
  void add(const BlendChoice& choice, const effort::EffortVector& miss);
  /// Whether a blend was measured beside which this one would tell nothing.
  [[nodiscard]] bool has(const BlendChoice& choice) const;
  /// No blend of these two is to be tried any more.
  void settle(const FragmentPair& pair) { settled_.push_back(pair); }

  /// What is expected of the blends of each pair; nothing as long as nothing was measured.
  [[nodiscard]] std::vector<Correction> of_pairs(std::span<const FragmentPair> pairs) const;

 private:
  struct Measured {
    BlendChoice choice;
    double middle;  ///< 4 b
    effort::EffortVector miss;
  };
  [[nodiscard]] Eigen::VectorXd covariances_with(const FragmentPair& pair) const;
  [[nodiscard]] Correction of_pair(const FragmentPair& pair, const Eigen::MatrixXd& inverse) const;

  std::vector<Measured> measured_;
  std::vector<FragmentPair> settled_;
};

}  // namespace laban::transfer
