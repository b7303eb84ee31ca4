#include "laban/transfer/closed_loop.h"

#include <algorithm>
#include <cmath>

#include "laban/base/rng.h"
#include "laban/math/parallel.h"
#include "laban/math/statistics.h"
#include "laban/transfer/apply_style.h"

namespace laban::transfer {
namespace {

ClosedLoopTrial try_target(const StyleModel& model, int fragment, const EffortTarget& target,
                           const ClosedLoopOptions& options) {
  PlayMemory memory(model);
  const effort::Effort predicted = memory.search(fragment, options.search).best(target).predicted;
  const ChosenBlend chosen = choose_blend(memory, fragment, target, options.search, options.tries);
  return {fragment, target, predicted, chosen.measured.effort};
}

/// Predictions over all pairs of one content and alphas: F x (pairs * alphas).
effort::EffortMatrix predictions_of(const StyleModel& model, int group) {
  std::vector<double> alphas;
  for (int m = 0; m <= 30; ++m) alphas.push_back(blend::kMinAlpha + 0.05 * m);
  std::vector<effort::EffortMatrix> curves;
  const int count = static_cast<int>(model.fragments.size());
  for (int i = 0; i < count; ++i) {
    for (int j = i + 1; j < count; ++j) {
      const auto a = static_cast<std::size_t>(i);
      const auto b = static_cast<std::size_t>(j);
      if (model.contents.numbers[a] != group || model.contents.numbers[b] != group) continue;
      if (!align::blendable(model.fragments[a].pose.frame_count(),
                            model.fragments[b].pose.frame_count()))
        continue;
      curves.push_back(effort_curve(model, i, j, alphas));
    }
  }
  effort::EffortMatrix all(model.regressor.factor_count(),
                           static_cast<Eigen::Index>(curves.size() * alphas.size()));
  for (std::size_t n = 0; n < curves.size(); ++n) {
    all.middleCols(static_cast<Eigen::Index>(n * alphas.size()), curves[n].cols()) = curves[n];
  }
  return all;
}

struct Span {
  double low = 0.0;
  double high = 0.0;
};

/// 5th to 95th percentile of each factor's predictions in one content group.
std::array<Span, effort::kFactorCount> target_spans(const StyleModel& model, int group) {
  const effort::EffortMatrix predictions = predictions_of(model, group);
  std::array<Span, effort::kFactorCount> spans;
  for (std::size_t f = 0; f < spans.size(); ++f) {
    const Eigen::VectorXd row = predictions.row(static_cast<Eigen::Index>(f)).transpose();
    if (row.size() == 0) continue;
    const auto clip = [](double value) {
      return std::clamp(value, effort::kEffortMin, effort::kEffortMax);
    };
    spans[f] = {clip(math::percentile(math::as_span(row), 5.0)),
                clip(math::percentile(math::as_span(row), 95.0))};
  }
  return spans;
}

/// The model as it would be had one fragment never been captured: it is nobody's neighbour, and no
/// blend of it was learnt from. (Metric and observer are the full corpus's: they know no labels.)
StyleModel without(const StyleModel& model, const StyleCorpus& corpus, int left_out) {
  StyleModel rest = model;
  for (std::vector<int>& neighbors : rest.neighbors) std::erase(neighbors, left_out);
  StyleCorpus others = corpus;
  std::erase_if(others.blends, [&](const CorpusBlend& blend) {
    return blend.fragment_i == left_out || blend.fragment_j == left_out;
  });
  rest.regressor =
      effort::fit_style_regressor(style_samples(others, model.coordinates), model.regressor.kind(),
                                  {.symmetric = model.regressor.symmetric()});
  return rest;
}

/// A random fragment of the content of `like`, other than it; -1 if there is none.
int random_companion(const StyleModel& model, int like, base::Rng& rng) {
  std::vector<int> others = model.neighbors[static_cast<std::size_t>(like)];
  std::erase(others, like);
  return others.empty()
             ? -1
             : others[static_cast<std::size_t>(rng.index(static_cast<int>(others.size())))];
}

}  // namespace

std::vector<ClosedLoopTrial> single_factor_trials(const StyleModel& model,
                                                  const ClosedLoopOptions& options) {
  std::vector<std::array<Span, effort::kFactorCount>> spans;
  for (int g = 0; g < static_cast<int>(model.contents.names.size()); ++g)
    spans.push_back(target_spans(model, g));
  std::vector<ClosedLoopTrial> trials(static_cast<std::size_t>(options.targets) *
                                      effort::kFactorCount);
  math::parallel_for(static_cast<int>(trials.size()), options.threads, [&](int n) {
    base::Rng rng = base::Rng::for_stream(options.seed, static_cast<std::uint64_t>(n));
    const auto factor = static_cast<std::size_t>(n / options.targets);
    const int fragment = rng.index(static_cast<int>(model.fragments.size()));
    const Span span =
        spans[static_cast<std::size_t>(model.contents.numbers[static_cast<std::size_t>(fragment)])]
             [factor];
    EffortTarget target;
    target.factors[factor] = rng.uniform(span.low, span.high);
    target.stay_near = model.fragments[static_cast<std::size_t>(fragment)].effort;
    trials[static_cast<std::size_t>(n)] = try_target(model, fragment, target, options);
  });
  return trials;
}

std::vector<ClosedLoopTrial> left_out_trials(const StyleModel& model, const StyleCorpus& corpus,
                                             const ClosedLoopOptions& options) {
  std::vector<std::optional<ClosedLoopTrial>> trials(static_cast<std::size_t>(options.targets));
  math::parallel_for(options.targets, options.threads, [&](int n) {
    base::Rng rng = base::Rng::for_stream(options.seed, static_cast<std::uint64_t>(n));
    const int left_out = rng.index(static_cast<int>(model.fragments.size()));
    const int fragment = random_companion(model, left_out, rng);
    if (fragment < 0) return;
    const effort::Effort& label = *model.fragments[static_cast<std::size_t>(left_out)].effort;
    EffortTarget target;
    target.factors = {label.flow, label.weight, label.time};
    trials[static_cast<std::size_t>(n)] =
        try_target(without(model, corpus, left_out), fragment, target, options);
  });
  std::vector<ClosedLoopTrial> made;
  for (const auto& trial : trials) {
    if (trial) made.push_back(*trial);
  }
  return made;
}

std::array<ClosedLoopScore, effort::kFactorCount> closed_loop_scores(
    const std::vector<ClosedLoopTrial>& trials) {
  std::array<ClosedLoopScore, effort::kFactorCount> scores;
  for (const effort::Factor factor : effort::kFactors) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    std::vector<double> asked;
    std::vector<double> measured;
    ClosedLoopScore& score = scores[f];
    for (const ClosedLoopTrial& trial : trials) {
      if (!trial.target.factors[f]) continue;
      asked.push_back(*trial.target.factors[f]);
      measured.push_back(trial.measured[factor]);
      score.asked_predicted_error += std::abs(asked.back() - trial.predicted[factor]);
      score.asked_measured_error += std::abs(asked.back() - measured.back());
    }
    score.trials = static_cast<int>(asked.size());
    if (asked.empty()) continue;
    score.asked_predicted_error /= score.trials;
    score.asked_measured_error /= score.trials;
    if (asked.size() > 1) score.rank_correlation = math::spearman(asked, measured);
  }
  return scores;
}

}  // namespace laban::transfer
