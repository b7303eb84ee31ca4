#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/effort/effort.h"

namespace laban::effort {

struct SuggestionOptions {
  /// Blends to suggest; >= 1. Fewer are suggested if the pool is smaller.
  int count = 20;
  /// Width of the Gaussian in median distances between blends; > 0.
  double relative_width = 0.7;
  /// Variance of a label's noise in units of the signal's; > 0. Where it is small, a second label
  /// close to a first tells little and the choice covers the pool; where it is large, the choice
  /// keeps to the blends that are expected to be missed most.
  double noise_ratio = 0.1;
  /// Factors of the labels in z: 3, or 4 with Space.
  int factor_count = kFactorCount;

  /// Broken rules, each naming field, value and rule; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// One blend of the pool that is worth a label.
struct Suggestion {
  int column = 0;  ///< of the pool
  /// How much of the pool's mean predictive variance is gone once this one is labelled beside
  /// those labelled and suggested before it, as a share of what it was before any suggestion.
  double expected_drop = 0.0;
};

/// Which blends to label next: greedily, each time the one whose label is expected to lower the
/// predictive variance over the whole pool most (A-optimal design, [CohnGhahramaniJordan96]).
///
/// What interpolation misses is taken for a Gaussian process, the same from either end of a blend,
/// contents, efforts and alpha counting alike in its distances, and as large as the parents are
/// apart in content and Effort: any quadratic measure Q of motion is at (1 - alpha) x + alpha y
/// less than interpolated by alpha (1 - alpha) Q(x - y). (That factor of alpha is left out but at
/// the seeds, where nothing is missed: with it a little less was learnt.) Its variance depends on
/// where labels are, not on what they say: none is needed, so this works before the first one, and
/// the whole list can be labelled in one sitting.
///
/// @param labelled  D x L features z of blends that have labels; may have no column.
/// @param pool      D x P features of blends that may be labelled, P >= 1.
/// @returns the suggestions from the most useful on; of equals the first.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if D differs or is no
///         feature_count, the pool is empty or a value is not finite.
/// Time O(L^3 + P^2 (L + D + count)), memory O((P + L)^2).
[[nodiscard]] std::vector<Suggestion> suggest_blends(
    const Eigen::Ref<const Eigen::MatrixXd>& labelled,
    const Eigen::Ref<const Eigen::MatrixXd>& pool, const SuggestionOptions& options = {});

}  // namespace laban::effort
