#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "laban/effort/effort.h"
#include "laban/transfer/style_model.h"

namespace laban::transfer {

/// The Effort asked for. A factor that is not set is left free.
struct EffortTarget {
  /// flow, weight, time, and space where the model knows it.
  std::array<std::optional<double>, effort::kMaxFactorCount> factors;
  std::array<double, effort::kMaxFactorCount> weights = {1.0, 1.0, 1.0, 1.0};  ///< importance, > 0
  /// What the factors left free stay near, as far as the others let them: the Effort of what is
  /// restyled, without its Space, which is not measured. nullopt: they may go anywhere.
  std::optional<effort::Effort> stay_near;

  /// Weighted distance sqrt(sum_f w_f (asked_f - e_f)^2) over the factors of e asked for.
  [[nodiscard]] double distance_to(const effort::EffortVector& e) const;
  /// True if it asks for nothing.
  [[nodiscard]] bool is_free() const;
  /// Broken rules: a factor outside [-3, 3], a weight not positive and finite, no factor at all.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Most fragments of one blend.
inline constexpr int kMostWays = 4;

struct SearchOptions {
  /// K content neighbours of a fragment, itself among them (METHODS 1.6). The paper gives none;
  /// twenty-five make 300 pairs, among which there is one that moves little but what is asked for.
  int neighbors = 25;
  /// M uniform samples of alpha a pair; the paper's "modest number".
  int samples = 16;
  /// Width to which golden-section search narrows alpha.
  double alpha_tolerance = 1e-3;
  /// Most fragments that are blended, 2 .. kMostWays. The paper's is 2; more are (ours) tried
  /// where a pair misses the target, see search_blend.
  int way = 2;
  /// (Ours.) How much the expected error of a prediction counts, >= 0: 1 looks for the least
  /// expected squared distance, 0 for the nearest prediction, however unsure, as the paper does.
  double caution = 1.0;
  /// (Ours.) Weight of a factor left free, where the target says what it is to stay near, >= 0; 0
  /// leaves it free to go anywhere, as the paper does.
  double stay = 0.15;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
  [[nodiscard]] bool operator==(const SearchOptions&) const = default;
};

/// The least and greatest value of a factor among all candidates looked at.
struct FactorRange {
  double low = 0.0;
  double high = 0.0;
};

/// A further fragment in a blend: what was blended so far counts as one fragment, at alpha = 0.
struct BlendStep {
  int fragment = 0;
  double alpha = 0.0;
};

/// How much of a blend is one fragment; negative where a blend leads away from it.
struct BlendShare {
  int fragment = 0;
  double weight = 0.0;
};

/// The blend that comes nearest to a target.
struct BlendChoice {
  int fragment_i = 0;
  int fragment_j = 0;  ///< equal to fragment_i: the fragment itself, alpha 0
  double alpha = 0.0;
  effort::Effort predicted;            ///< by the regressor; of a fragment itself, its label
  double distance = 0.0;               ///< EffortTarget::distance_to of `predicted`, errors aside
  std::vector<FactorRange> reachable;  ///< of each factor of the model

  /// Blended in this order into the pair; empty unless SearchOptions::way > 2.
  std::vector<BlendStep> further;
  /// z of the last blend (of what was blended so far with the last fragment), as the regressor saw
  /// it; empty of a fragment itself.
  Eigen::VectorXd features;

  [[nodiscard]] bool is_seed() const { return fragment_i == fragment_j; }
  /// Barycentric weights: they sum to 1. One a fragment, in the order in which they are blended.
  [[nodiscard]] std::vector<BlendShare> shares() const;
};

/// Two fragments that may be blended.
struct FragmentPair {
  int i = 0;
  int j = 0;
  [[nodiscard]] bool operator==(const FragmentPair&) const = default;
};

/// What is known of the blends of a pair beside what the regressor predicts (see MeasuredMisses).
struct Correction {
  effort::EffortVector miss;  ///< F: what the prediction at alpha = 1/2 is to be moved by
  double error_share = 1.0;   ///< of the prediction's standard error: what is left of it
  bool settled = false;       ///< the pair is not to be chosen

  /// What the prediction at `alpha` is to be moved by: nothing at either fragment.
  [[nodiscard]] effort::EffortVector at(double alpha) const {
    return 4.0 * alpha * (1.0 - alpha) * miss;
  }
};

class MeasuredMisses;

/// With fewer Effort points of distance to the target, no further fragment is tried.
inline constexpr double kMissedBy = 0.05;
/// Effort points by which a further fragment has to lower the distance.
inline constexpr double kLeastGain = 0.02;

/// Standard error of each choice's prediction (of the function, label noise not included), by the
/// regressor as a Gaussian process; nullopt for a fragment itself, whose label is known, and where
/// the regressor gives none. Give it all choices at once: the cost is that of one.
[[nodiscard]] std::vector<std::optional<effort::Effort>> standard_errors(
    const StyleModel& model, std::span<const BlendChoice> choices);

/// Effort against alpha for pairs of fragments: Figure 1 of [Torresani06].
/// @param alphas  any values; beyond [-0.25, 1.25] the regressor extrapolates.
/// @returns F x alphas.size() predictions, F the factors of the model.
[[nodiscard]] effort::EffortMatrix effort_curve(const StyleModel& model, int fragment_i,
                                                int fragment_j, const std::vector<double>& alphas);

/// The same with the standard error of the predicted Effort (of the function, label noise not
/// included); nullopt if the model's regressor offers none.
[[nodiscard]] std::optional<effort::StylePrediction> effort_curve_with_error(
    const StyleModel& model, int fragment_i, int fragment_j, const std::vector<double>& alphas);

/// Chooses the blend for one snippet [Torresani06, eq. 12], METHODS 1.6: over all unordered pairs
/// of the K content neighbours of `fragment` (of blendable lengths), M samples of alpha in
/// [-0.25, 1.25], then golden-section search around the best sample of each pair; and each
/// neighbour itself, whose label is known. Ties: neighbours themselves before pairs, then the order
/// of neighbours.
///
/// (Ours.) What is lowered is the expected squared distance, sum_f w_f ((asked_f - f(z))^2 +
/// caution s_f(alpha)^2) with s the regressor's typical standard error: where many blends are
/// predicted to hit the target, those near a fragment hit it more surely. Factors left free enter
/// with weight `stay` and EffortTarget::stay_near as what is asked. caution = stay = 0 is
/// [Torresani06, eq. 12].
///
/// (Ours.) A blend is to show the content of its fragments. Its squared distances to other motions
/// are linear in alpha but for a term that all have in common, so by how much its own content is
/// nearer than any other is taken to be (1 - alpha) m_i + alpha m_j, m being
/// StyleModel::content_margins; where that is negative, nothing is chosen. (Of 917 snippets made of
/// Bandai's captures that held for 12, 11 of them all those that a nearest-group classifier took
/// for another action.) Not asked where no neighbour has a margin.
///
/// Pairs are refined from the most promising on, as long as the steps between samples leave hope
/// for better. (Where many pairs meet the target, the one that meets it to the last digit is one
/// whose Effort changes little with alpha. Taking the first that comes near enough is twice as
/// fast, but what is measured then misses the target by up to half as much again.)
///
/// (Ours.) With `way` > 2 a pair that misses the target by more than kMissedBy gets a further
/// fragment: the best pair is made into motion and counts as a fragment, with the content
/// coordinates of that motion and the Effort predicted for it, and is paired with each neighbour as
/// above, but in [0, 1] only; then its own alpha and the new one are improved in turn. What does
/// not lower the distance by kLeastGain is not taken. The regressor has learnt from pairs only:
/// errors of its prediction for the pair go into that for the whole.
/// @throws Error{kUsage} if target or options have problems, there is no such fragment, or Space is
///         asked of a model that does not know it.
[[nodiscard]] BlendChoice search_blend(const StyleModel& model, int fragment,
                                       const EffortTarget& target,
                                       const SearchOptions& options = {});

/// Blend weights between which a search looks; none if high < low.
struct AlphaRange {
  double low = blend::kMinAlpha;
  double high = blend::kMaxAlpha;
  [[nodiscard]] bool holds(double alpha) const { return alpha >= low && alpha <= high; }
};

/// Blends of two and what is expected of them at samples of alpha, whatever the target.
struct SampledBlends {
  Eigen::MatrixXd features;        ///< D x P columns z; their alpha means nothing
  std::vector<double> alphas;      ///< M, ascending
  effort::EffortMatrix curves;     ///< F x P M predictions: blend p at alphas[m] is column p M + m
  effort::EffortMatrix errors;     ///< F x M, their typical standard errors
  std::vector<AlphaRange> ranges;  ///< P, what each may be chosen at

  /// Whether blend p may be chosen at alphas[m].
  [[nodiscard]] bool may(Eigen::Index p, Eigen::Index m) const {
    return ranges[static_cast<std::size_t>(p)].holds(alphas[static_cast<std::size_t>(m)]);
  }
};

/// The best of some blends of two.
struct FoundBlend {
  Eigen::Index candidate = 0;  ///< column of z
  double alpha = 0.0;
  effort::EffortVector predicted;  ///< by the regressor
  effort::EffortVector expected;   ///< the same, corrected
  double cost = 0.0;               ///< of what is expected
};

/// search_blend for target after target: what does not hang on the target is found once. Immutable;
/// safe to use from many threads.
class BlendSearch {
 public:
  /// @param model  must outlive this.
  /// @throws Error{kUsage} if options have problems or there is no such fragment.
  BlendSearch(const StyleModel& model, int fragment, const SearchOptions& options = {});

  /// @throws Error{kUsage} if the target has problems or asks Space of a model that does not know
  ///         it.
  [[nodiscard]] BlendChoice best(const EffortTarget& target) const;
  /// The same, knowing what blends of these neighbours were measured to be.
  [[nodiscard]] BlendChoice best(const EffortTarget& target, const MeasuredMisses& misses) const;
  /// What else could have been chosen: the pairs that come nearest to the target, each at its best
  /// alpha, from the best on; at most `count`. What is lowered is as in best(), with pairs only.
  /// @throws as best.
  [[nodiscard]] std::vector<BlendChoice> nearest_pairs(const EffortTarget& target, int count) const;
  /// A blend chosen by hand, reported as best() reports its own: any two fragments of this
  /// fragment's content, neighbours or not; i and j may be equal, and alpha is then 0.
  /// @param target  what its distance is measured to; it may ask for nothing.
  /// @throws Error{kUsage} naming the rule if there are no such fragments, one shows another
  ///         content, their lengths are not blendable, or alpha lies outside [-0.25, 1.25].
  [[nodiscard]] BlendChoice of_pair(int fragment_i, int fragment_j, double alpha,
                                    const EffortTarget& target) const;
  [[nodiscard]] const SearchOptions& options() const noexcept { return options_; }

 private:
  [[nodiscard]] BlendChoice of_found(const FoundBlend& found, const EffortTarget& target) const;
  /// With further fragments, if that is asked for and nearer than the pair and than a fragment that
  /// misses by `nearest_seed`.
  [[nodiscard]] std::optional<BlendChoice> further(const FoundBlend& found,
                                                   const EffortTarget& target, double nearest_seed,
                                                   std::vector<FactorRange>& reachable) const;
  [[nodiscard]] std::vector<FactorRange> reachable() const;

  const StyleModel* model_;
  int fragment_;
  SearchOptions options_;
  std::vector<int> neighbors_;
  std::vector<FragmentPair> pairs_;
  SampledBlends sampled_;  ///< of the pairs
};

}  // namespace laban::transfer
