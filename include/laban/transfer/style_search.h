#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "laban/effort/effort.h"
#include "laban/transfer/style_model.h"

namespace laban::transfer {

/// The Effort asked for. A factor that is not set is left free.
struct EffortTarget {
  std::array<std::optional<double>, effort::kFactorCount> factors;     ///< flow, weight, time
  std::array<double, effort::kFactorCount> weights = {1.0, 1.0, 1.0};  ///< importance, > 0

  /// Weighted distance sqrt(sum_f w_f (asked_f - e_f)^2) over the factors asked for.
  [[nodiscard]] double distance_to(const effort::EffortVector& e) const;
  /// Broken rules: a factor outside [-3, 3], a weight not positive, no factor at all.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct SearchOptions {
  /// K content neighbours of a fragment, itself among them (METHODS 1.6). The paper gives none; ten
  /// make 45 pairs, which reach further than a few and cost milliseconds.
  int neighbors = 10;
  /// M uniform samples of alpha a pair; the paper's "modest number".
  int samples = 16;
  /// Width to which golden-section search narrows alpha.
  double alpha_tolerance = 1e-3;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// The least and greatest value of a factor among all candidates looked at.
struct FactorRange {
  double low = 0.0;
  double high = 0.0;
};

/// The blend that comes nearest to a target.
struct BlendChoice {
  int fragment_i = 0;
  int fragment_j = 0;  ///< equal to fragment_i: the fragment itself, alpha 0
  double alpha = 0.0;
  effort::Effort predicted;  ///< by the regressor; of a fragment itself, its label
  double distance = 0.0;     ///< EffortTarget::distance_to of `predicted`
  std::array<FactorRange, effort::kFactorCount> reachable;

  [[nodiscard]] bool is_seed() const { return fragment_i == fragment_j; }
};

/// Effort against alpha for pairs of fragments: Figure 1 of [Torresani06].
/// @param alphas  any values; beyond [-0.25, 1.25] the regressor extrapolates.
/// @returns 3 x alphas.size() predictions.
[[nodiscard]] Eigen::Matrix3Xd effort_curve(const StyleModel& model, int fragment_i, int fragment_j,
                                            const std::vector<double>& alphas);

/// The same with the standard error of the predicted Effort (of the function, label noise not
/// included); nullopt if the model's regressor offers none.
[[nodiscard]] std::optional<effort::StylePrediction> effort_curve_with_error(
    const StyleModel& model, int fragment_i, int fragment_j, const std::vector<double>& alphas);

/// Chooses the blend for one snippet [Torresani06, eq. 12], METHODS 1.6: over all unordered pairs
/// of the K content neighbours of `fragment` (of blendable lengths), M samples of alpha in
/// [-0.25, 1.25], then golden-section search around the best sample of each pair; and each
/// neighbour itself, whose label is known. Ties: neighbours themselves before pairs, then the order
/// of neighbours.
/// @throws Error{kUsage} if target or options have problems or there is no such fragment.
[[nodiscard]] BlendChoice search_blend(const StyleModel& model, int fragment,
                                       const EffortTarget& target,
                                       const SearchOptions& options = {});

}  // namespace laban::transfer
