#include "laban/effort/evaluation.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>

#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "laban/math/parallel.h"

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

/// Mean squared error of each factor.
Eigen::Vector3d mean_squared_errors(const Eigen::Matrix3Xd& predicted,
                                    const Eigen::Matrix3Xd& labels) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index n = 0; n < labels.cols(); ++n) {
    for (int f = 0; f < kFactorCount; ++f) {
      const double residual = predicted(f, n) - labels(f, n);
      sum[f] += residual * residual;
    }
  }
  return sum / static_cast<double>(labels.cols());
}

/// 3 x models mean squared errors of one run.
Eigen::Matrix3Xd run_split(const StyleSamples& samples, const Split& split,
                           std::span<const RegressorKind> kinds,
                           const StyleRegressorOptions& options) {
  const StyleSamples test = samples.subset(split.test);
  const std::vector<StyleRegressor> models =
      fit_style_regressors(samples.subset(split.train), kinds, options);
  Eigen::Matrix3Xd errors(kFactorCount, static_cast<Eigen::Index>(models.size()));
  for (std::size_t m = 0; m < models.size(); ++m) {
    errors.col(static_cast<Eigen::Index>(m)) =
        mean_squared_errors(models[m].predict(test.features), test.labels);
  }
  return errors;
}

/// @param test_to_train  mean over runs of the test part's size over the training part's.
Estimate estimate(const Eigen::Ref<const Eigen::VectorXd>& values, double test_to_train) {
  const double runs = static_cast<double>(values.size());
  Estimate result;
  for (const double value : values) result.mean += value / runs;
  if (values.size() < 2) return result;
  double variance = 0.0;
  for (const double value : values) {
    variance += (value - result.mean) * (value - result.mean) / (runs - 1.0);
  }
  result.standard_error = std::sqrt(variance / runs);
  result.corrected_standard_error = std::sqrt(variance * (1.0 / runs + test_to_train));
  return result;
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

FactorReport report_factor(Factor factor, const Eigen::MatrixXd& errors,
                           std::span<const RegressorKind> kinds, const Eigen::RowVectorXd& labels,
                           double test_to_train) {
  FactorReport report;
  report.factor = factor;
  report.label_variance = (labels.array() - labels.mean()).square().mean();
  for (std::size_t m = 0; m < kinds.size(); ++m) {
    ModelScore score;
    score.kind = kinds[m];
    score.error = estimate(errors.col(static_cast<Eigen::Index>(m)), test_to_train);
    score.paper = paper_mean_squared_error(factor, kinds[m]);
    report.models.push_back(score);
  }
  const std::size_t baseline = *position_of(report, RegressorKind::kLinearInterpolation);
  const double reference = report.models[baseline].error.mean;
  for (ModelScore& score : report.models) {
    score.ratio_to_interpolation = ratio(score.error.mean, reference);
  }
  return report;
}

/// Counts finished runs and tells a listener, from whatever thread finishes one.
class RunCounter {
 public:
  RunCounter(base::Progress* progress, std::size_t runs) : progress_(progress), runs_(runs) {}
  void count_one() {
    if (progress_ == nullptr) return;
    const std::lock_guard lock(mutex_);
    ++done_;
    if (!progress_->update(static_cast<double>(done_) / static_cast<double>(runs_))) {
      throw base::Error(base::ErrorKind::kUsage, "evaluation: interrupted");
    }
  }

 private:
  base::Progress* progress_;
  std::size_t runs_;
  std::size_t done_ = 0;
  std::mutex mutex_;
};

}  // namespace

std::optional<double> paper_mean_squared_error(Factor factor, RegressorKind kind) {
  const auto row = static_cast<std::size_t>(factor), column = static_cast<std::size_t>(kind);
  if (column >= kPaperMeanSquaredError[row].size()) return std::nullopt;
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

PairedDifference EvaluationReport::compare(Factor factor, RegressorKind model,
                                           RegressorKind against) const {
  const FactorReport& report = factors[static_cast<std::size_t>(factor)];
  const auto a = position_of(report, model), b = position_of(report, against);
  if (!a || !b) {
    throw base::Error(base::ErrorKind::kUsage,
                      "evaluation: " + std::string(name_of(a ? against : model)) +
                          " was not evaluated, name it among the models");
  }
  const Eigen::MatrixXd& errors = run_errors[static_cast<std::size_t>(factor)];
  return {model, against,
          estimate(
              errors.col(static_cast<Eigen::Index>(*a)) - errors.col(static_cast<Eigen::Index>(*b)),
              test_to_train)};
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
  const int runs = static_cast<int>(splits.size());
  std::vector<Eigen::Matrix3Xd> errors(splits.size());
  RunCounter counter(progress, splits.size());
  math::parallel_for(runs, options.threads, [&](int run) {
    const auto r = static_cast<std::size_t>(run);
    // Folds of run r depend on (seed, r) only; the offset keeps their stream off the splits'.
    const std::uint64_t fold_seed =
        options.seed + 0x9e3779b97f4a7c15ULL * (static_cast<std::uint64_t>(run) + 1U);
    errors[r] = run_split(samples, splits[r], kinds,
                          {.symmetric = options.symmetric,
                           .folds = options.folds,
                           .seed = fold_seed,
                           .grid = options.grid});
    counter.count_one();
  });

  EvaluationReport report;
  report.runs = runs;
  report.train = static_cast<int>(splits.front().train.size());
  report.test = static_cast<int>(splits.front().test.size());
  report.test_to_train = mean_test_to_train(splits);
  for (std::size_t f = 0; f < kFactorCount; ++f) {
    const auto row = static_cast<Eigen::Index>(f);
    Eigen::MatrixXd& table = report.run_errors[f];
    table.resize(runs, static_cast<Eigen::Index>(kinds.size()));
    for (int run = 0; run < runs; ++run) {
      table.row(run) = errors[static_cast<std::size_t>(run)].row(row);
    }
    report.factors[f] =
        report_factor(kFactors[f], table, kinds, samples.labels.row(row), report.test_to_train);
    const auto best = best_of_the_others(report.factors[f]);
    if (best && position_of(report.factors[f], RegressorKind::kResidualKernelRidge)) {
      report.factors[f].fifth_against_best =
          report.compare(kFactors[f], RegressorKind::kResidualKernelRidge, *best);
    }
  }
  return report;
}

}  // namespace laban::effort
