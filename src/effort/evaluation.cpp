#include "laban/effort/evaluation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>

#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "laban/math/dyadic_mean.h"
#include "laban/math/parallel.h"
#include "laban/math/statistics.h"
#include "laban/math/student_t.h"

namespace laban::effort {
namespace {

/// Columns of each blend: one column each, or those of one group, blends in order of their label.
std::vector<std::vector<int>> columns_of_blends(const StyleSamples& samples) {
  std::vector<int> order(static_cast<std::size_t>(samples.count()));
  std::iota(order.begin(), order.end(), 0);
  std::vector<std::vector<int>> blends;
  if (samples.groups.empty()) {
    for (const int column : order) blends.push_back({column});
    return blends;
  }
  const auto group = [&](int column) { return samples.groups[static_cast<std::size_t>(column)]; };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return group(a) < group(b); });
  for (const int column : order) {
    if (blends.empty() || group(blends.back().front()) != group(column)) blends.emplace_back();
    blends.back().push_back(column);
  }
  return blends;
}

std::vector<int> gather(const std::vector<std::vector<int>>& blends, std::span<const int> chosen) {
  std::vector<int> columns;
  for (const int blend : chosen) {
    const std::vector<int>& more = blends[static_cast<std::size_t>(blend)];
    columns.insert(columns.end(), more.begin(), more.end());
  }
  std::sort(columns.begin(), columns.end());
  return columns;
}

void require_valid(const std::vector<std::string>& problems) {
  if (!problems.empty()) throw base::Error(base::ErrorKind::kUsage, problems.front());
}

void require_columns(const Split& split, int count) {
  std::vector<int> seen = split.train;
  seen.insert(seen.end(), split.test.begin(), split.test.end());
  std::sort(seen.begin(), seen.end());
  const bool repeated = std::adjacent_find(seen.begin(), seen.end()) != seen.end();
  if (split.train.empty() || split.test.empty() || repeated || seen.front() < 0 ||
      seen.back() >= count) {
    throw base::Error(base::ErrorKind::kData,
                      "evaluation: a split must train and test on different columns of the " +
                          std::to_string(count) + " given, at least one each");
  }
}

/// The models to fit: those asked for, with linear interpolation for the ratios.
std::vector<RegressorKind> fitted_models(const std::vector<RegressorKind>& asked) {
  std::vector<RegressorKind> kinds = asked;
  if (std::find(kinds.begin(), kinds.end(), RegressorKind::kLinearInterpolation) == kinds.end()) {
    kinds.push_back(RegressorKind::kLinearInterpolation);
  }
  return kinds;
}

// Errors are summed in index order, one by one: a vectorised sum depends on where a column happens
// to lie in memory, and so on which models are evaluated beside it.

/// F x N squared errors of each factor.
EffortMatrix squared_errors(const EffortMatrix& predicted, const EffortMatrix& labels) {
  return (predicted - labels).array().square();
}

EffortVector mean_of_columns(const EffortMatrix& values) {
  EffortVector sum = EffortVector::Zero(values.rows());
  for (Eigen::Index n = 0; n < values.cols(); ++n) {
    for (Eigen::Index f = 0; f < values.rows(); ++f) sum[f] += values(f, n);
  }
  return sum / static_cast<double>(values.cols());
}

/// Squared errors of one run's test columns, one matrix a model.
using RunErrors = std::vector<EffortMatrix>;

RunErrors run_split(const StyleSamples& samples, const Split& split,
                    std::span<const RegressorKind> kinds, const StyleRegressorOptions& options) {
  const StyleSamples test = samples.subset(split.test);
  RunErrors errors;
  for (const StyleRegressor& model :
       fit_style_regressors(samples.subset(split.train), kinds, options)) {
    errors.push_back(squared_errors(model.predict(test.features), test.labels));
  }
  return errors;
}

constexpr double kUnknown = std::numeric_limits<double>::infinity();

/// Fills in the 95 % interval.
Estimate with_interval(Estimate estimate) {
  if (estimate.degrees_of_freedom < 1 || !std::isfinite(estimate.corrected_standard_error)) {
    estimate.corrected_standard_error = kUnknown;
    estimate.low = -kUnknown;
    estimate.high = kUnknown;
    return estimate;
  }
  const double half = estimate.corrected_standard_error *
                      math::student_t_quantile(0.975, estimate.degrees_of_freedom);
  estimate.low = estimate.mean - half;
  estimate.high = estimate.mean + half;
  return estimate;
}

/// Of one value a run; runs share blends.
/// @param test_to_train  mean over runs of the test part's size over the training part's.
Estimate estimate_over_runs(const Eigen::VectorXd& values, double test_to_train) {
  const double runs = static_cast<double>(values.size());
  Estimate result;
  for (const double value : values) result.mean += value / runs;
  result.degrees_of_freedom = static_cast<int>(values.size()) - 1;
  result.standard_error = result.corrected_standard_error = kUnknown;
  if (values.size() < 2) return with_interval(result);
  double variance = 0.0;
  for (const double value : values) {
    variance += (value - result.mean) * (value - result.mean) / (runs - 1.0);
  }
  result.standard_error = std::sqrt(variance / runs);
  result.corrected_standard_error = std::sqrt(variance * (1.0 / runs + test_to_train));
  return with_interval(result);
}

/// Of one value a tested blend; blends share performers.
Estimate estimate_over_blends(const Eigen::VectorXd& values, const TestedBlends& blends) {
  const std::span<const double> span = math::as_span(values);
  const math::DyadicMean dyadic = math::dyadic_mean(span, blends.first, blends.second);
  Estimate result;
  result.mean = dyadic.mean;
  result.standard_error = values.size() < 2 ? kUnknown : math::standard_error(span);
  result.corrected_standard_error = dyadic.standard_error;
  result.degrees_of_freedom = dyadic.members - 1;
  return with_interval(result);
}

double ratio(double numerator, double denominator) {
  if (denominator == 0.0 && numerator == 0.0) return 1.0;
  return numerator / denominator;
}

std::optional<std::size_t> position_of(const FactorReport& report, RegressorKind kind) {
  for (std::size_t m = 0; m < report.models.size(); ++m) {
    if (report.models[m].kind == kind) return m;
  }
  return std::nullopt;
}

/// The evaluated model of least mean error that is not the fifth; nullopt if there is none.
std::optional<RegressorKind> best_of_the_others(const FactorReport& report) {
  std::optional<RegressorKind> best;
  double least = 0.0;
  for (const ModelScore& score : report.models) {
    if (score.kind == RegressorKind::kResidualKernelRidge) continue;
    if (!best || score.error.mean < least) {
      best = score.kind;
      least = score.error.mean;
    }
  }
  return best;
}

double mean_test_to_train(std::span<const Split> splits) {
  double sum = 0.0;
  for (const Split& split : splits) {
    sum += static_cast<double>(split.test.size()) / static_cast<double>(split.train.size());
  }
  return sum / static_cast<double>(splits.size());
}

/// What estimates are of: a row a run or a tested blend, a column a model.
const Eigen::MatrixXd& rows_of(const EvaluationReport& report, std::size_t factor) {
  return report.blends ? report.blends->squared_errors[factor] : report.run_errors[factor];
}

Estimate estimate(const EvaluationReport& report, const Eigen::VectorXd& values) {
  return report.blends ? estimate_over_blends(values, *report.blends)
                       : estimate_over_runs(values, report.test_to_train);
}

std::vector<ModelScore> score_models(const EvaluationReport& report, std::size_t factor,
                                     std::span<const RegressorKind> kinds) {
  std::vector<ModelScore> scores;
  double interpolation = 0.0;
  for (std::size_t m = 0; m < kinds.size(); ++m) {
    ModelScore score;
    score.kind = kinds[m];
    score.error = estimate(report, rows_of(report, factor).col(static_cast<Eigen::Index>(m)));
    score.paper = paper_mean_squared_error(kFactorsWithSpace[factor], kinds[m]);
    if (score.kind == RegressorKind::kLinearInterpolation) interpolation = score.error.mean;
    scores.push_back(score);
  }
  for (ModelScore& score : scores)
    score.ratio_to_interpolation = ratio(score.error.mean, interpolation);
  return scores;
}

/// Every model against linear interpolation, then the fifth against the others.
std::vector<PairedDifference> differences_of(const EvaluationReport& report, Factor factor) {
  constexpr auto kBaseline = RegressorKind::kLinearInterpolation;
  constexpr auto kFifth = RegressorKind::kResidualKernelRidge;
  const FactorReport& scores = report.factors[static_cast<std::size_t>(factor)];
  std::vector<PairedDifference> differences;
  for (const ModelScore& score : scores.models) {
    if (score.kind != kBaseline)
      differences.push_back(report.compare(factor, score.kind, kBaseline));
  }
  if (!position_of(scores, kFifth)) return differences;
  for (const ModelScore& score : scores.models) {
    if (score.kind != kBaseline && score.kind != kFifth)
      differences.push_back(report.compare(factor, kFifth, score.kind));
  }
  return differences;
}

/// Fills in everything about factors that follows from the errors of runs and blends.
void report_factors(EvaluationReport& report, std::span<const RegressorKind> kinds,
                    const EffortMatrix& labels) {
  report.factors.resize(static_cast<std::size_t>(labels.rows()));
  for (std::size_t f = 0; f < report.factors.size(); ++f) {
    FactorReport& factor = report.factors[f];
    const Eigen::RowVectorXd row = labels.row(static_cast<Eigen::Index>(f));
    factor.factor = kFactorsWithSpace[f];
    factor.label_variance = (row.array() - row.mean()).square().mean();
    factor.models = score_models(report, f, kinds);
    factor.differences = differences_of(report, factor.factor);
    const auto best = best_of_the_others(factor);
    if (best && position_of(factor, RegressorKind::kResidualKernelRidge)) {
      factor.fifth_against_best =
          report.compare(factor.factor, RegressorKind::kResidualKernelRidge, *best);
    }
  }
}

/// Counts finished runs and tells a listener, from whatever thread finishes one.
class RunCounter {
 public:
  RunCounter(base::Progress* progress, std::size_t runs) : progress_(progress), runs_(runs) {}
  void count_one() {
    if (progress_ == nullptr) return;
    const std::lock_guard lock(mutex_);
    ++done_;
    base::tell(progress_, static_cast<double>(done_) / static_cast<double>(runs_));
  }

 private:
  base::Progress* progress_;
  std::size_t runs_;
  std::size_t done_ = 0;
  std::mutex mutex_;
};

/// Squared errors of every run. @param features  of all columns as run r knows them; empty: those
/// of the samples.
std::vector<RunErrors> run_all(const StyleSamples& samples, std::span<const Split> splits,
                               std::span<const RegressorKind> kinds,
                               const EvaluationOptions& options, const FeaturesWithout& features,
                               base::Progress* progress) {
  std::vector<RunErrors> errors(splits.size());
  RunCounter counter(progress, splits.size());
  math::parallel_for(static_cast<int>(splits.size()), options.threads, [&](int run) {
    const auto r = static_cast<std::size_t>(run);
    // Folds of run r depend on (seed, r) only; the offset keeps their stream off the splits'.
    const std::uint64_t fold_seed =
        options.seed + 0x9e3779b97f4a7c15ULL * (static_cast<std::uint64_t>(run) + 1U);
    const StyleRegressorOptions learning{.symmetric = options.symmetric,
                                         .folds = options.folds,
                                         .seed = fold_seed,
                                         .grid = options.grid};
    if (features) {
      const StyleSamples known{features(run), samples.labels, samples.groups, samples.weights};
      known.check();
      errors[r] = run_split(known, splits[r], kinds, learning);
    } else {
      errors[r] = run_split(samples, splits[r], kinds, learning);
    }
    counter.count_one();
  });
  return errors;
}

/// Sizes and mean errors of the runs.
EvaluationReport report_runs(std::span<const Split> splits, const std::vector<RunErrors>& errors,
                             std::size_t model_count) {
  const auto factor_count = static_cast<std::size_t>(errors.front().front().rows());
  EvaluationReport report;
  report.run_errors.resize(factor_count);
  report.runs = static_cast<int>(splits.size());
  report.train = static_cast<int>(splits.front().train.size());
  report.test = static_cast<int>(splits.front().test.size());
  report.test_to_train = mean_test_to_train(splits);
  for (Eigen::MatrixXd& table : report.run_errors)
    table.resize(report.runs, static_cast<Eigen::Index>(model_count));
  for (std::size_t r = 0; r < splits.size(); ++r) {
    report.run_list.push_back(
        {"", static_cast<int>(splits[r].train.size()), static_cast<int>(splits[r].test.size())});
    for (std::size_t m = 0; m < model_count; ++m) {
      const EffortVector means = mean_of_columns(errors[r][m]);
      for (std::size_t f = 0; f < factor_count; ++f) {
        report.run_errors[f](static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(m)) =
            means[static_cast<Eigen::Index>(f)];
      }
    }
  }
  return report;
}

/// Every tested column once: its errors are means over the runs that test it.
TestedBlends gather_blends(std::span<const Split> splits, const std::vector<RunErrors>& errors,
                           const ParentGroups& groups, std::size_t model_count) {
  std::vector<double> times(groups.first.size(), 0.0);
  for (const Split& split : splits) {
    for (const int column : split.test) times[static_cast<std::size_t>(column)] += 1.0;
  }
  TestedBlends blends;
  std::vector<Eigen::Index> place(times.size(), -1);
  for (std::size_t n = 0; n < times.size(); ++n) {
    if (times[n] == 0.0) continue;
    place[n] = std::ssize(blends.columns);
    blends.columns.push_back(static_cast<int>(n));
    blends.first.push_back(groups.first[n]);
    blends.second.push_back(groups.second[n]);
  }
  const auto factor_count = static_cast<std::size_t>(errors.front().front().rows());
  for (std::size_t f = 0; f < factor_count; ++f) {
    Eigen::MatrixXd& table = blends.squared_errors.emplace_back();
    table.setZero(std::ssize(blends.columns), static_cast<Eigen::Index>(model_count));
    for (std::size_t r = 0; r < splits.size(); ++r) {
      for (std::size_t t = 0; t < splits[r].test.size(); ++t) {
        const auto column = static_cast<std::size_t>(splits[r].test[t]);
        for (std::size_t m = 0; m < model_count; ++m) {
          table(place[column], static_cast<Eigen::Index>(m)) +=
              errors[r][m](static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(t)) /
              times[column];
        }
      }
    }
  }
  return blends;
}

/// Regressors need as many to learn from (fit_style_regressor).
constexpr int kLeastTraining = 3;

/// Why a run cannot be made; empty if it can.
std::string reason_to_skip(const StyleSamples& samples, const Split& split) {
  const StyleSamples train = samples.subset(split.train);
  const std::size_t blends = columns_of_blends(train).size();
  if (split.test.empty()) return "no blend to test on";
  if (blends >= kLeastTraining) return {};
  return std::to_string(blends) + " blends to train on, at least " + std::to_string(kLeastTraining);
}

}  // namespace

std::optional<double> paper_mean_squared_error(Factor factor, RegressorKind kind) {
  const auto row = static_cast<std::size_t>(factor), column = static_cast<std::size_t>(kind);
  if (row >= kPaperMeanSquaredError.size() || column >= kPaperMeanSquaredError[row].size()) {
    return std::nullopt;
  }
  return kPaperMeanSquaredError[row][column];
}

std::vector<std::string> EvaluationOptions::problems() const {
  std::vector<std::string> problems = grid.problems();
  const auto at_least = [&](const char* name, int value, int least) {
    if (value >= least) return;
    problems.push_back(std::string("EvaluationOptions::") + name + " = " + std::to_string(value) +
                       " (must be >= " + std::to_string(least) + ")");
  };
  at_least("runs", runs, 2);
  at_least("train", train, 3);
  at_least("test", test, 1);
  at_least("threads", threads, 0);
  at_least("folds", folds, 2);
  if (models.empty()) problems.push_back("EvaluationOptions::models is empty (at least one)");
  return problems;
}

std::string_view name_of(Protocol protocol) {
  switch (protocol) {
    case Protocol::kRandom:
      return "random";
    case Protocol::kLeavePerformerOut:
      return "leave-performer-out";
    case Protocol::kLeaveContentOut:
      return "leave-content-out";
  }
  return {};
}

std::optional<Protocol> protocol_named(std::string_view name) {
  for (const Protocol protocol : kProtocols) {
    if (name_of(protocol) == name) return protocol;
  }
  return std::nullopt;
}

std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kBelow:
      return "below";
    case Verdict::kWithinNoise:
      return "within noise";
    case Verdict::kAbove:
      return "above";
  }
  return {};
}

void ParentGroups::check(int count) const {
  const auto known = [this](int group) { return group >= 0 && group < std::ssize(names); };
  if (std::ssize(first) != count || std::ssize(second) != count ||
      !std::all_of(first.begin(), first.end(), known) ||
      !std::all_of(second.begin(), second.end(), known)) {
    throw base::Error(base::ErrorKind::kData, "evaluation: the parents of each of the " +
                                                  std::to_string(count) +
                                                  " columns must belong to one of the " +
                                                  std::to_string(names.size()) + " groups");
  }
}

Verdict Estimate::verdict() const noexcept {
  if (high < 0.0) return Verdict::kBelow;
  return low > 0.0 ? Verdict::kAbove : Verdict::kWithinNoise;
}

std::optional<FifthStanding> FactorReport::fifth_standing() const {
  std::optional<FifthStanding> standing;
  const auto interpolation = position_of(*this, RegressorKind::kLinearInterpolation);
  for (const PairedDifference& paired : differences) {
    if (paired.model != RegressorKind::kResidualKernelRidge) continue;
    if (!standing) standing.emplace();
    const Verdict verdict = paired.difference.verdict();
    if (paired.against == RegressorKind::kLinearInterpolation) {
      standing->below_interpolation = verdict == Verdict::kBelow;
      standing->could_be_below = models[*interpolation].error.verdict() == Verdict::kAbove;
    } else if (verdict == Verdict::kAbove) {
      standing->not_above_others = false;
    }
  }
  return standing;
}

PairedDifference EvaluationReport::compare(Factor factor, RegressorKind model,
                                           RegressorKind against) const {
  const auto f = static_cast<std::size_t>(factor);
  const FactorReport& report = factors[f];
  const auto a = position_of(report, model), b = position_of(report, against);
  if (!a || !b) {
    throw base::Error(base::ErrorKind::kUsage,
                      "evaluation: " + std::string(name_of(a ? against : model)) +
                          " was not evaluated, name it among the models");
  }
  const Eigen::MatrixXd& errors = rows_of(*this, f);
  Eigen::VectorXd difference =
      errors.col(static_cast<Eigen::Index>(*a)) - errors.col(static_cast<Eigen::Index>(*b));
  // Two models that predict the same but for round-off would else be told apart by it.
  const double round_off = 1e-12 * report.label_variance;
  for (double& value : difference) {
    if (std::abs(value) <= round_off) value = 0.0;
  }
  return {model, against, estimate(*this, difference)};
}

std::vector<Split> random_splits(const StyleSamples& samples, const EvaluationOptions& options) {
  require_valid(options.problems());
  samples.check();
  const std::vector<std::vector<int>> blends = columns_of_blends(samples);
  const int count = static_cast<int>(blends.size());
  if (options.train + options.test > count) {
    throw base::Error(base::ErrorKind::kData,
                      "evaluation: " + std::to_string(options.train) + " blends to train and " +
                          std::to_string(options.test) + " to test on, but there are " +
                          std::to_string(count) + "; lower them");
  }
  std::vector<Split> splits;
  splits.reserve(static_cast<std::size_t>(options.runs));
  for (int run = 0; run < options.runs; ++run) {
    base::Rng rng = base::Rng::for_stream(options.seed, static_cast<std::uint64_t>(run));
    const std::vector<int> order = rng.permutation(count);
    const std::span<const int> shuffled(order);
    const auto train = static_cast<std::size_t>(options.train);
    splits.push_back(
        {gather(blends, shuffled.first(train)),
         gather(blends, shuffled.subspan(train, static_cast<std::size_t>(options.test)))});
  }
  return splits;
}

EvaluationReport evaluate(const StyleSamples& samples, const EvaluationOptions& options,
                          base::Progress* progress) {
  EvaluationReport report =
      evaluate_splits(samples, random_splits(samples, options), options, progress);
  report.train = options.train;
  report.test = options.test;
  return report;
}

EvaluationReport evaluate_splits(const StyleSamples& samples, std::span<const Split> splits,
                                 const EvaluationOptions& options, base::Progress* progress) {
  require_valid(options.problems());
  samples.check();
  if (splits.empty()) {
    throw base::Error(base::ErrorKind::kData, "evaluation: no split, at least one");
  }
  for (const Split& split : splits) require_columns(split, samples.count());
  const std::vector<RegressorKind> kinds = fitted_models(options.models);
  const auto errors = run_all(samples, splits, kinds, options, {}, progress);
  EvaluationReport report = report_runs(splits, errors, kinds.size());
  report_factors(report, kinds, samples.labels);
  return report;
}

std::vector<Split> leave_one_out_splits(const ParentGroups& groups, int count) {
  groups.check(count);
  std::vector<Split> splits(groups.names.size());
  for (int group = 0; group < std::ssize(groups.names); ++group) {
    Split& split = splits[static_cast<std::size_t>(group)];
    for (int column = 0; column < count; ++column) {
      const auto n = static_cast<std::size_t>(column);
      const bool held_out = groups.first[n] == group || groups.second[n] == group;
      (held_out ? split.test : split.train).push_back(column);
    }
  }
  return splits;
}

EvaluationReport evaluate_leaving_one_out(const StyleSamples& samples, const ParentGroups& groups,
                                          Protocol protocol,
                                          const FeaturesWithout& features_without,
                                          const EvaluationOptions& options,
                                          base::Progress* progress) {
  require_valid(options.problems());
  samples.check();
  const std::vector<Split> all = leave_one_out_splits(groups, samples.count());
  std::vector<Split> splits;
  std::vector<int> group_of_run;
  std::vector<SkippedRun> skipped;
  for (std::size_t g = 0; g < all.size(); ++g) {
    const std::string reason = reason_to_skip(samples, all[g]);
    if (reason.empty()) {
      splits.push_back(all[g]);
      group_of_run.push_back(static_cast<int>(g));
    } else {
      skipped.push_back({{groups.names[g], static_cast<int>(all[g].train.size()),
                          static_cast<int>(all[g].test.size())},
                         reason});
    }
  }
  if (splits.empty()) {
    throw base::Error(base::ErrorKind::kData,
                      "evaluation: " + std::string(name_of(protocol)) + " has no run of " +
                          std::to_string(all.size()) +
                          " to make: each leaves too few blends to train on or none to test on");
  }
  const std::vector<RegressorKind> kinds = fitted_models(options.models);
  FeaturesWithout features;
  if (features_without) {
    features = [&](int run) {
      return features_without(group_of_run[static_cast<std::size_t>(run)]);
    };
  }
  const auto errors = run_all(samples, splits, kinds, options, features, progress);
  EvaluationReport report = report_runs(splits, errors, kinds.size());
  report.protocol = protocol;
  report.skipped = std::move(skipped);
  for (std::size_t r = 0; r < splits.size(); ++r) {
    report.run_list[r].held_out = groups.names[static_cast<std::size_t>(group_of_run[r])];
  }
  report.blends = gather_blends(splits, errors, groups, kinds.size());
  report_factors(report, kinds, samples.labels);
  return report;
}

}  // namespace laban::effort
