#pragma once

#include <array>
#include <optional>
#include <span>

#include <Eigen/Dense>

#include "laban/transfer/style_search.h"

namespace laban::transfer {

using Reachable = std::vector<FactorRange>;

/// Widens the ranges to hold a prediction.
void extend(Reachable& reachable, const effort::EffortVector& e);
/// Widens the ranges to hold what blends are expected to be where they may be chosen.
void extend(Reachable& reachable, const SampledBlends& sampled);

/// What a search lowers (see search_blend): the length of what a blend misses, is unsure of, and
/// moves that was to stay.
class BlendCost {
 public:
  using Missed = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 2 * effort::kMaxFactorCount, 1>;

  /// @param factor_count  of the predictions.
  BlendCost(const EffortTarget& target, const SearchOptions& options, int factor_count);

  /// @param error  the prediction's standard error, 0 where the Effort is known.
  [[nodiscard]] Missed missed(const effort::EffortVector& predicted,
                              const effort::EffortVector& error) const;
  [[nodiscard]] double operator()(const effort::EffortVector& predicted,
                                  const effort::EffortVector& error) const {
    return missed(predicted, error).norm();
  }
  /// What operator() is the root of, of many predictions and of their errors, a column each.
  [[nodiscard]] Eigen::RowVectorXd squared_misses(const effort::EffortMatrix& predicted) const;
  [[nodiscard]] Eigen::RowVectorXd squared_errors(const effort::EffortMatrix& errors) const;

 private:
  effort::EffortVector wanted_;
  effort::EffortVector weight_;  ///< square roots
  double caution_ = 0.0;         ///< square root
};

/// @param z  columns of style_features; their alpha is not looked at.
/// @param samples  M >= 2, uniform over `range`, which all may be chosen in.
[[nodiscard]] SampledBlends sample_blends(const StyleModel& model, Eigen::MatrixXd z, int samples,
                                          const AlphaRange& range = {});

/// Golden-section search around the best sample of each candidate, from the most promising on, on
/// the curve through the samples; what the best is worth is told by the regressor itself. Ties: the
/// first candidate.
/// @param corrections  one a candidate, or none.
/// @param reachable  widened by every sample and by what is found.
/// @returns nothing if there is no candidate that is not settled.
[[nodiscard]] std::optional<FoundBlend> find_blend(
    const StyleModel& model, const SampledBlends& sampled, std::span<const Correction> corrections,
    const EffortTarget& target, const SearchOptions& options, Reachable& reachable);

/// The candidates whose best samples cost least, each refined as by find_blend,
/// from the least cost on; at most `count`.
[[nodiscard]] std::vector<FoundBlend> rank_blends(const StyleModel& model,
                                                  const SampledBlends& sampled,
                                                  const EffortTarget& target,
                                                  const SearchOptions& options, int count);

/// Blends further neighbours into a pair, up to `options.way` fragments (see search_blend).
/// @returns the pair itself if none brings it nearer to the target by kLeastGain.
[[nodiscard]] BlendChoice blend_further(const StyleModel& model, std::span<const int> neighbors,
                                        const BlendChoice& pair, const EffortTarget& target,
                                        const SearchOptions& options, Reachable& reachable);

}  // namespace laban::transfer
