#include "laban/transfer/style_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/math/cubic_interpolation.h"
#include "laban/math/golden_section.h"
#include "laban/math/statistics.h"
#include "laban/transfer/measured_misses.h"

#include "transfer/blend_search.h"

namespace laban::transfer {
namespace {

using base::Error;
using base::ErrorKind;

void require_known(const StyleModel& model, const EffortTarget& target) {
  const auto known = static_cast<std::size_t>(model.regressor.factor_count());
  for (std::size_t f = known; f < target.factors.size(); ++f) {
    if (!target.factors[f]) continue;
    throw Error(ErrorKind::kUsage, "target " + std::string(name_of(effort::kFactorsWithSpace[f])) +
                                       " is asked of a model whose labels have none; train on a "
                                       "table with that column, or leave it free");
  }
}

/// @throws Error{kUsage} unless the two may be blended in place of `fragment` at that weight.
void require_pair(const StyleModel& model, int fragment, int i, int j, double alpha) {
  const auto refuse = [](const std::string& why) {
    throw Error(ErrorKind::kUsage, "a blend by hand: " + why);
  };
  const auto count = static_cast<int>(model.fragments.size());
  for (const int known : {i, j}) {
    if (known < 0 || known >= count) refuse("there is no fragment " + std::to_string(known));
    const Fragment& shown = model.fragments[static_cast<std::size_t>(known)];
    const Fragment& wanted = model.fragments[static_cast<std::size_t>(fragment)];
    if (shown.content != wanted.content) {
      refuse("'" + shown.name + "' shows '" + shown.content + "' where '" + wanted.content +
             "' is done");
    }
  }
  const auto frames = [&](int known) {
    return model.fragments[static_cast<std::size_t>(known)].pose.frame_count();
  };
  if (!align::blendable(frames(i), frames(j)))
    refuse("the lengths of its fragments differ too much to be blended");
  if (!(alpha >= blend::kMinAlpha && alpha <= blend::kMaxAlpha))
    refuse("alpha " + std::to_string(alpha) + " must be in [-0.25, 1.25]");
  if (i == j && alpha != 0.0) refuse("alpha of a fragment by itself must be 0");
}

/// z of a pair at alpha 0.
Eigen::VectorXd features_of(const StyleModel& model, int fragment_i, int fragment_j) {
  const auto i = static_cast<std::size_t>(fragment_i);
  const auto j = static_cast<std::size_t>(fragment_j);
  const int factors = model.regressor.factor_count();
  return effort::style_features(model.coordinates[i], model.coordinates[j],
                                effort::to_vector(*model.fragments[i].effort, factors),
                                effort::to_vector(*model.fragments[j].effort, factors), 0.0);
}

/// The target for what lies `by` beside where it is asked for.
EffortTarget moved(EffortTarget target, const effort::EffortVector& by) {
  for (Eigen::Index row = 0; row < by.size(); ++row) {
    auto& asked = target.factors[static_cast<std::size_t>(row)];
    if (asked) *asked += by[row];
  }
  if (target.stay_near) {
    for (const effort::Factor factor : effort::kFactors)
      (*target.stay_near)[factor] += by[effort::index_of(factor)];
  }
  return target;
}

/// Content margins of a model's fragments; 0 for all if none of `neighbors` shows its content.
std::vector<double> margins_of(const StyleModel& model, std::span<const int> neighbors) {
  const bool any = std::any_of(neighbors.begin(), neighbors.end(), [&](int known) {
    return model.content_margins[static_cast<std::size_t>(known)] >= 0.0;
  });
  return any ? model.content_margins : std::vector<double>(model.fragments.size(), 0.0);
}

/// Where (1 - alpha) a + alpha b >= 0.
AlphaRange where_positive(double a, double b) {
  AlphaRange range;
  if (a == b) return a >= 0.0 ? range : AlphaRange{1.0, 0.0};
  const double root = a / (a - b);
  (b > a ? range.low : range.high) = root;
  return {std::max(range.low, AlphaRange{}.low), std::min(range.high, AlphaRange{}.high)};
}

std::vector<double> uniform_alphas(int samples, const AlphaRange& range) {
  std::vector<double> alphas(static_cast<std::size_t>(samples));
  for (int m = 0; m < samples; ++m) {
    alphas[static_cast<std::size_t>(m)] = range.low + (range.high - range.low) * m / (samples - 1);
  }
  alphas.back() = range.high;
  return alphas;
}

/// Blends of two as what was measured of others corrects them.
class CorrectedBlends {
 public:
  /// @param sampled  must outlive this. @param corrections  one a blend, or none.
  CorrectedBlends(const SampledBlends& sampled, std::span<const Correction> corrections)
      : sampled_(sampled), corrections_(corrections.begin(), corrections.end()) {
    const Eigen::Index factors = sampled.curves.rows();
    corrections_.resize(static_cast<std::size_t>(count()), {effort::EffortVector::Zero(factors)});
    if (corrections.empty()) return;
    curves_ = sampled.curves;
    const auto alpha = Eigen::Map<const Eigen::RowVectorXd>(alphas().data(), samples()).array();
    const Eigen::RowVectorXd middle = 4.0 * alpha * (1.0 - alpha);
    for (Eigen::Index p = 0; p < count(); ++p)
      curves_.middleCols(p * samples(), samples()).noalias() += correction(p).miss * middle;
  }

  [[nodiscard]] Eigen::Index count() const { return sampled_.features.cols(); }
  [[nodiscard]] const std::vector<double>& alphas() const { return sampled_.alphas; }
  [[nodiscard]] Eigen::Index samples() const { return std::ssize(sampled_.alphas); }
  [[nodiscard]] const Correction& correction(Eigen::Index p) const {
    return corrections_[static_cast<std::size_t>(p)];
  }
  [[nodiscard]] Eigen::VectorXd features(Eigen::Index p) const { return sampled_.features.col(p); }
  [[nodiscard]] bool may(Eigen::Index p, Eigen::Index m) const { return sampled_.may(p, m); }
  [[nodiscard]] const AlphaRange& range(Eigen::Index p) const {
    return sampled_.ranges[static_cast<std::size_t>(p)];
  }
  /// F x count() samples().
  [[nodiscard]] const effort::EffortMatrix& curves() const {
    return curves_.size() > 0 ? curves_ : sampled_.curves;
  }
  /// What is expected of blend p at the samples of alpha, and how surely.
  [[nodiscard]] auto curve(Eigen::Index p) const {
    return curves().middleCols(p * samples(), samples());
  }
  [[nodiscard]] effort::EffortMatrix errors(Eigen::Index p) const {
    return correction(p).error_share * sampled_.errors;
  }

 private:
  const SampledBlends& sampled_;
  std::vector<Correction> corrections_;
  effort::EffortMatrix curves_;  ///< empty if nothing corrects them
};

/// What each blend costs at the samples, infinity where it may not be chosen: samples() x count().
Eigen::MatrixXd costs_of(const CorrectedBlends& blends, const BlendCost& cost) {
  Eigen::MatrixXd squares =
      cost.squared_misses(blends.curves()).reshaped(blends.samples(), blends.count());
  for (Eigen::Index p = 0; p < blends.count(); ++p)
    squares.col(p) += cost.squared_errors(blends.errors(p)).transpose();
  for (Eigen::Index p = 0; p < blends.count(); ++p) {
    for (Eigen::Index m = 0; m < blends.samples(); ++m)
      if (!blends.may(p, m)) squares(m, p) = math::kInfinity;
  }
  return squares.cwiseSqrt();
}

/// A blend and what it costs.
struct Candidate {
  Eigen::Index index = 0;
  Eigen::VectorXd costs;  ///< at the samples of alpha
  double hope = 0.0;      ///< the least cost that there may be between them
};

Candidate candidate_of(Eigen::Index index, Eigen::VectorXd costs, const CorrectedBlends& blends,
                       const BlendCost& cost) {
  // Between samples a curve may bend, but hardly moves so much more than from sample to sample.
  constexpr double kMostBend = 1.5;
  Eigen::Index at = 0;
  const double least = costs.minCoeff(&at);
  const auto curve = blends.curve(index);
  const effort::EffortMatrix errors = blends.errors(index);
  const BlendCost::Missed missed = cost.missed(curve.col(at), errors.col(at));
  double step = 0.0;
  for (const Eigen::Index next : {at - 1, at + 1}) {
    if (next >= 0 && next < curve.cols())
      step = std::max(step, (cost.missed(curve.col(next), errors.col(next)) - missed).norm());
  }
  return {index, std::move(costs), std::max(0.0, least - kMostBend * step)};
}

/// All candidates that are not settled and may be chosen somewhere.
std::vector<Candidate> candidates_of(const CorrectedBlends& blends, const BlendCost& cost) {
  if (blends.count() == 0) return {};
  const Eigen::MatrixXd costs = costs_of(blends, cost);
  std::vector<Candidate> candidates;
  for (Eigen::Index p = 0; p < blends.count(); ++p) {
    if (!blends.correction(p).settled && std::isfinite(costs.col(p).minCoeff()))
      candidates.push_back(candidate_of(p, costs.col(p), blends, cost));
  }
  return candidates;
}

/// The least cost near a candidate's best sample, on the curve through the samples.
math::Minimum between_samples(const CorrectedBlends& blends, const Candidate& candidate,
                              const BlendCost& cost, const SearchOptions& options) {
  const std::vector<double>& alphas = blends.alphas();
  const double per_sample =
      (alphas.back() - alphas.front()) / static_cast<double>(blends.samples() - 1);
  const auto curve = blends.curve(candidate.index);
  const effort::EffortMatrix errors = blends.errors(candidate.index);
  const auto cost_at = [&](double alpha) {
    if (!blends.range(candidate.index).holds(alpha)) return math::kInfinity;
    const double sample = (alpha - alphas.front()) / per_sample;
    return cost(math::interpolate(curve, sample), math::interpolate(errors, sample));
  };
  return math::refine_best_sample(cost_at, alphas, math::as_span(candidate.costs),
                                  options.alpha_tolerance);
}

/// A candidate's blend at `alpha`, as the regressor itself predicts it.
FoundBlend blend_at(const StyleModel& model, const CorrectedBlends& blends, Eigen::Index candidate,
                    double alpha, const BlendCost& cost) {
  Eigen::VectorXd z = blends.features(candidate);
  z[z.size() - 1] = alpha;
  const Correction& correction = blends.correction(candidate);
  const effort::EffortVector predicted = model.regressor.predict(z).col(0);
  const effort::EffortVector expected = predicted + correction.at(alpha);
  const effort::EffortVector error =
      correction.error_share * model.regressor.typical_errors(std::span(&alpha, 1)).col(0);
  return {candidate, alpha, predicted, expected, cost(expected, error)};
}

}  // namespace

double EffortTarget::distance_to(const effort::EffortVector& e) const {
  double sum = 0.0;
  for (Eigen::Index row = 0; row < e.size(); ++row) {
    const auto f = static_cast<std::size_t>(row);
    if (!factors[f]) continue;
    const double d = *factors[f] - e[row];
    sum += weights[f] * d * d;
  }
  return std::sqrt(sum);
}

bool EffortTarget::is_free() const {
  return std::none_of(factors.begin(), factors.end(),
                      [](const auto& factor) { return factor.has_value(); });
}

std::vector<std::string> EffortTarget::problems() const {
  std::vector<std::string> found;
  for (const effort::Factor factor : effort::kFactorsWithSpace) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    const std::string name(effort::name_of(factor));
    if (factors[f] && !(*factors[f] >= effort::kEffortMin && *factors[f] <= effort::kEffortMax)) {
      found.push_back("target " + name + " = " + std::to_string(*factors[f]) +
                      " (must be in [-3, 3])");
    }
    if (!(weights[f] > 0.0 && std::isfinite(weights[f]))) {
      found.push_back("weight of " + name + " = " + std::to_string(weights[f]) +
                      " (must be a finite number > 0)");
    }
  }
  if (is_free()) {
    found.emplace_back("no target given; ask for at least one of flow, weight, time, space");
  }
  return found;
}

std::vector<std::string> SearchOptions::problems() const {
  std::vector<std::string> found;
  if (neighbors < 1)
    found.push_back("SearchOptions::neighbors = " + std::to_string(neighbors) + " (must be >= 1)");
  if (samples < 2)
    found.push_back("SearchOptions::samples = " + std::to_string(samples) + " (must be >= 2)");
  if (way < 2 || way > kMostWays)
    found.push_back("SearchOptions::way = " + std::to_string(way) + " (must be 2, 3 or 4)");
  if (!(caution >= 0.0 && std::isfinite(caution)))
    found.emplace_back("SearchOptions::caution (must be a finite number >= 0)");
  if (!(stay >= 0.0 && std::isfinite(stay)))
    found.emplace_back("SearchOptions::stay (must be a finite number >= 0)");
  if (!(alpha_tolerance > 0.0)) found.emplace_back("SearchOptions::alpha_tolerance (must be > 0)");
  return found;
}

effort::EffortMatrix effort_curve(const StyleModel& model, int fragment_i, int fragment_j,
                                  const std::vector<double>& alphas) {
  const Eigen::VectorXd z = features_of(model, fragment_i, fragment_j);
  effort::StyleScratch scratch;
  return model.regressor.predict_curves(z.head(z.size() - 1), alphas, scratch);
}

std::optional<effort::StylePrediction> effort_curve_with_error(const StyleModel& model,
                                                               int fragment_i, int fragment_j,
                                                               const std::vector<double>& alphas) {
  Eigen::MatrixXd z = features_of(model, fragment_i, fragment_j)
                          .replicate(1, static_cast<Eigen::Index>(alphas.size()));
  z.bottomRows(1) =
      Eigen::Map<const Eigen::RowVectorXd>(alphas.data(), static_cast<Eigen::Index>(alphas.size()));
  return model.regressor.predict_with_error(z);
}

std::vector<BlendShare> BlendChoice::shares() const {
  if (is_seed()) return {{fragment_i, 1.0}};
  std::vector<BlendShare> shares = {{fragment_i, 1.0 - alpha}, {fragment_j, alpha}};
  for (const BlendStep& step : further) {
    for (BlendShare& share : shares) share.weight *= 1.0 - step.alpha;
    shares.push_back({step.fragment, step.alpha});
  }
  return shares;
}

void extend(Reachable& reachable, const effort::EffortVector& e) {
  for (std::size_t f = 0; f < reachable.size(); ++f) {
    reachable[f].low = std::min(reachable[f].low, e[static_cast<Eigen::Index>(f)]);
    reachable[f].high = std::max(reachable[f].high, e[static_cast<Eigen::Index>(f)]);
  }
}

void extend(Reachable& reachable, const SampledBlends& sampled) {
  const Eigen::Index samples = std::ssize(sampled.alphas);
  for (Eigen::Index c = 0; c < sampled.curves.cols(); ++c)
    if (sampled.may(c / samples, c % samples)) extend(reachable, sampled.curves.col(c));
}

BlendCost::BlendCost(const EffortTarget& target, const SearchOptions& options, int factor_count)
    : wanted_(effort::EffortVector::Zero(factor_count)),
      weight_(effort::EffortVector::Zero(factor_count)),
      caution_(std::sqrt(options.caution)) {
  for (const effort::Factor factor : effort::factors_of(factor_count)) {
    const int row = effort::index_of(factor);
    const auto f = static_cast<std::size_t>(row);
    const bool can_stay = target.stay_near && factor != effort::Factor::kSpace;
    if (!target.factors[f] && !can_stay) continue;
    wanted_[row] = target.factors[f] ? *target.factors[f] : (*target.stay_near)[factor];
    weight_[row] = std::sqrt(target.factors[f] ? target.weights[f] : options.stay);
  }
}

Eigen::RowVectorXd BlendCost::squared_misses(const effort::EffortMatrix& predicted) const {
  return (weight_.asDiagonal() * (predicted.colwise() - wanted_)).colwise().squaredNorm();
}

Eigen::RowVectorXd BlendCost::squared_errors(const effort::EffortMatrix& errors) const {
  return (caution_ * weight_.asDiagonal() * errors).colwise().squaredNorm();
}

BlendCost::Missed BlendCost::missed(const effort::EffortVector& predicted,
                                    const effort::EffortVector& error) const {
  Missed all(2 * predicted.size());
  all << weight_.cwiseProduct(wanted_ - predicted), caution_ * weight_.cwiseProduct(error);
  return all;
}

SampledBlends sample_blends(const StyleModel& model, Eigen::MatrixXd z, int samples,
                            const AlphaRange& range) {
  const auto count = static_cast<std::size_t>(z.cols());
  SampledBlends sampled{std::move(z), uniform_alphas(samples, range), {}, {}, {count, range}};
  if (sampled.features.cols() == 0) return sampled;
  effort::StyleScratch scratch;
  sampled.curves = model.regressor.predict_curves(
      sampled.features.topRows(sampled.features.rows() - 1), sampled.alphas, scratch);
  sampled.errors = model.regressor.typical_errors(sampled.alphas);
  return sampled;
}

namespace {

/// Sorts candidates by one of their figures; equals stay in order.
template <typename Figure>
void sort_by(std::vector<Candidate>& candidates, const Figure& figure) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](const Candidate& a, const Candidate& b) { return figure(a) < figure(b); });
}

}  // namespace

std::optional<FoundBlend> find_blend(const StyleModel& model, const SampledBlends& sampled,
                                     std::span<const Correction> corrections,
                                     const EffortTarget& target, const SearchOptions& options,
                                     Reachable& reachable) {
  const BlendCost cost(target, options, model.regressor.factor_count());
  const CorrectedBlends blends(sampled, corrections);
  extend(reachable, sampled);
  std::vector<Candidate> candidates = candidates_of(blends, cost);
  sort_by(candidates, [](const Candidate& candidate) { return candidate.hope; });
  const Candidate* best = nullptr;
  math::Minimum least{0.0, math::kInfinity};
  for (const Candidate& candidate : candidates) {
    if (candidate.hope >= least.value) break;
    const math::Minimum own = between_samples(blends, candidate, cost, options);
    if (own.value >= least.value) continue;
    least = own;
    best = &candidate;
  }
  if (best == nullptr) return std::nullopt;
  const FoundBlend found = blend_at(model, blends, best->index, least.x, cost);
  extend(reachable, found.predicted);
  return found;
}

std::vector<FoundBlend> rank_blends(const StyleModel& model, const SampledBlends& sampled,
                                    const EffortTarget& target, const SearchOptions& options,
                                    int count) {
  const BlendCost cost(target, options, model.regressor.factor_count());
  const CorrectedBlends blends(sampled, {});
  std::vector<Candidate> candidates = candidates_of(blends, cost);
  sort_by(candidates, [](const Candidate& candidate) { return candidate.costs.minCoeff(); });
  candidates.resize(std::min(candidates.size(), static_cast<std::size_t>(count)));
  std::vector<FoundBlend> ranked;
  for (const Candidate& candidate : candidates) {
    const double alpha = between_samples(blends, candidate, cost, options).x;
    ranked.push_back(blend_at(model, blends, candidate.index, alpha, cost));
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const FoundBlend& a, const FoundBlend& b) { return a.cost < b.cost; });
  return ranked;
}

BlendSearch::BlendSearch(const StyleModel& model, int fragment, const SearchOptions& options)
    : model_(&model), fragment_(fragment), options_(options) {
  base::require_none(options.problems());
  if (fragment < 0 || fragment >= static_cast<int>(model.fragments.size())) {
    throw Error(ErrorKind::kUsage,
                "search_blend: there is no fragment " + std::to_string(fragment));
  }
  neighbors_ = model.neighbors[static_cast<std::size_t>(fragment)];
  neighbors_.resize(std::min(neighbors_.size(), static_cast<std::size_t>(options.neighbors)));
  const auto frames = [&](int known) {
    return model.fragments[static_cast<std::size_t>(known)].pose.frame_count();
  };
  for (std::size_t k = 0; k < neighbors_.size(); ++k) {
    for (std::size_t l = k + 1; l < neighbors_.size(); ++l) {
      if (align::blendable(frames(neighbors_[k]), frames(neighbors_[l])))
        pairs_.push_back({neighbors_[k], neighbors_[l]});
    }
  }
  Eigen::MatrixXd z(model.regressor.feature_rows(), std::ssize(pairs_));
  for (std::size_t p = 0; p < pairs_.size(); ++p)
    z.col(static_cast<Eigen::Index>(p)) = features_of(model, pairs_[p].i, pairs_[p].j);
  sampled_ = sample_blends(model, std::move(z), options.samples);
  const std::vector<double> margins = margins_of(model, neighbors_);
  const auto margin = [&](int known) { return margins[static_cast<std::size_t>(known)]; };
  for (std::size_t p = 0; p < pairs_.size(); ++p)
    sampled_.ranges[p] = where_positive(margin(pairs_[p].i), margin(pairs_[p].j));
  std::erase_if(neighbors_, [&](int known) { return margin(known) < 0.0; });
}

BlendChoice BlendSearch::best(const EffortTarget& target) const {
  return best(target, {});
}

BlendChoice BlendSearch::best(const EffortTarget& target, const MeasuredMisses& misses) const {
  base::require_none(target.problems());
  require_known(*model_, target);
  const int factors = model_->regressor.factor_count();
  Reachable reachable(static_cast<std::size_t>(factors), {math::kInfinity, -math::kInfinity});
  const BlendCost cost(target, options_, factors);
  BlendChoice best;
  double least = math::kInfinity;
  for (const int k : neighbors_) {
    const effort::Effort label = *model_->fragments[static_cast<std::size_t>(k)].effort;
    const effort::EffortVector e = effort::to_vector(label, factors);
    extend(reachable, e);
    const double own = cost(e, effort::EffortVector::Zero(factors));
    if (own < least) {
      least = own;
      best = {k, k, 0.0, label, target.distance_to(e), {}, {}, {}};
    }
  }
  if (const auto found =
          find_blend(*model_, sampled_, misses.of_pairs(pairs_), target, options_, reachable)) {
    if (auto more = further(*found, target, best.distance, reachable)) {
      best = std::move(*more);
    } else if (found->cost < least) {
      best = of_found(*found, target);
    }
  }
  best.reachable = reachable;
  return best;
}

std::optional<BlendChoice> BlendSearch::further(const FoundBlend& found, const EffortTarget& target,
                                                double nearest_seed, Reachable& reachable) const {
  const double nearest = std::min(nearest_seed, target.distance_to(found.expected));
  if (options_.way <= 2 || nearest <= kMissedBy) return std::nullopt;
  // What the pair is expected to be beside its prediction goes into the whole.
  const EffortTarget asked = moved(target, found.predicted - found.expected);
  BlendChoice more =
      blend_further(*model_, neighbors_, of_found(found, asked), asked, options_, reachable);
  if (more.further.empty() || more.distance >= nearest - kLeastGain) return std::nullopt;
  more.distance =
      target.distance_to(effort::to_vector(more.predicted, model_->regressor.factor_count()));
  return more;
}

BlendChoice BlendSearch::of_found(const FoundBlend& found, const EffortTarget& target) const {
  Eigen::VectorXd features = sampled_.features.col(found.candidate);
  features[features.size() - 1] = found.alpha;
  const FragmentPair& pair = pairs_[static_cast<std::size_t>(found.candidate)];
  return {pair.i,
          pair.j,
          found.alpha,
          effort::to_effort(found.predicted),
          target.distance_to(found.predicted),
          {},
          {},
          std::move(features)};
}

std::vector<FactorRange> BlendSearch::reachable() const {
  const int factors = model_->regressor.factor_count();
  Reachable reachable(static_cast<std::size_t>(factors), {math::kInfinity, -math::kInfinity});
  for (const int k : neighbors_) {
    const auto& label = model_->fragments[static_cast<std::size_t>(k)].effort;
    extend(reachable, effort::to_vector(*label, factors));
  }
  extend(reachable, sampled_);
  return reachable;
}

std::vector<BlendChoice> BlendSearch::nearest_pairs(const EffortTarget& target, int count) const {
  base::require_none(target.problems());
  require_known(*model_, target);
  const Reachable range = reachable();
  std::vector<BlendChoice> choices;
  for (const FoundBlend& found : rank_blends(*model_, sampled_, target, options_, count)) {
    choices.push_back(of_found(found, target));
    choices.back().reachable = range;
  }
  return choices;
}

BlendChoice BlendSearch::of_pair(int fragment_i, int fragment_j, double alpha,
                                 const EffortTarget& target) const {
  require_pair(*model_, fragment_, fragment_i, fragment_j, alpha);
  const int factors = model_->regressor.factor_count();
  BlendChoice choice{fragment_i, fragment_j, alpha, {}, 0.0, reachable(), {}, {}};
  effort::EffortVector predicted;
  if (choice.is_seed()) {
    const auto& label = model_->fragments[static_cast<std::size_t>(fragment_i)].effort;
    predicted = effort::to_vector(*label, factors);
  } else {
    choice.features = features_of(*model_, fragment_i, fragment_j);
    choice.features[choice.features.size() - 1] = alpha;
    effort::StyleScratch scratch;
    predicted = model_->regressor.predict(choice.features, scratch).col(0);
  }
  choice.predicted = effort::to_effort(predicted);
  choice.distance = target.distance_to(predicted);
  return choice;
}

BlendChoice search_blend(const StyleModel& model, int fragment, const EffortTarget& target,
                         const SearchOptions& options) {
  base::require_none(target.problems());
  return BlendSearch(model, fragment, options).best(target);
}

std::vector<std::optional<effort::Effort>> standard_errors(const StyleModel& model,
                                                           std::span<const BlendChoice> choices) {
  std::vector<std::optional<effort::Effort>> errors(choices.size());
  std::vector<std::size_t> blends;
  for (std::size_t n = 0; n < choices.size(); ++n) {
    if (choices[n].features.size() > 0) blends.push_back(n);
  }
  if (blends.empty()) return errors;
  Eigen::MatrixXd z(model.regressor.feature_rows(), std::ssize(blends));
  for (std::size_t b = 0; b < blends.size(); ++b)
    z.col(static_cast<Eigen::Index>(b)) = choices[blends[b]].features;
  const auto predicted = model.regressor.predict_with_error(z);
  if (!predicted) return errors;
  for (std::size_t b = 0; b < blends.size(); ++b) {
    errors[blends[b]] =
        effort::to_effort(predicted->standard_error.col(static_cast<Eigen::Index>(b)));
  }
  return errors;
}

}  // namespace laban::transfer
