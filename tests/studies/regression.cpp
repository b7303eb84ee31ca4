// How good are the regressors and their standard errors? For each label table, over random splits
// in the proportion of the paper (85 blends to train and 20 to test on): mean squared error of each
// model, the fifth's difference to each other one with its 95 % interval (Nadeau-Bengio: splits
// share blends), and the share of test labels inside mean +- standard error, which should be 68 %.
//
// Usage: regression_study [--runs N] TABLE.csv...

#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "laban/effort/evaluation.h"
#include "laban/effort/style_regressor.h"
#include "laban/math/parallel.h"

#include "labelled_table.h"

namespace {

using namespace laban;
using effort::kFactorCount;
using effort::kRegressorCount;

/// Figures of one split, factor by model.
struct Run {
  Eigen::Matrix<double, kFactorCount, kRegressorCount> squared_error;
  Eigen::Matrix<double, kFactorCount, kRegressorCount> covered;
};

Run run_split(const effort::StyleSamples& samples, const effort::Split& split) {
  const effort::StyleSamples test = samples.subset(split.test);
  const auto models = effort::fit_style_regressors(samples.subset(split.train), effort::kRegressors,
                                                   {.symmetric = false});
  Run run;
  for (int m = 0; m < kRegressorCount; ++m) {
    const auto predicted = models[static_cast<std::size_t>(m)].predict_with_error(test.features);
    const Eigen::ArrayXXd residual = (predicted->mean - test.labels).array();
    run.squared_error.col(m) = residual.square().rowwise().mean();
    run.covered.col(m) =
        (residual.abs() <= predicted->standard_error.array()).cast<double>().rowwise().mean();
  }
  return run;
}

struct Interval {
  double mean = 0.0;
  double half_width = 0.0;
};

/// 95 % interval of a mean over splits that share blends [NadeauBengio03].
Interval interval_of(const Eigen::ArrayXd& values, double test_to_train) {
  const double runs = static_cast<double>(values.size()), mean = values.mean();
  const double variance = (values - mean).square().sum() / (runs - 1.0);
  return {mean, 1.96 * std::sqrt(variance * (1.0 / runs + test_to_train))};
}

void study(const std::string& table, int run_count) {
  const effort::StyleSamples samples = samples_of_table(table);
  effort::EvaluationOptions options;
  options.runs = run_count;
  options.train = static_cast<int>(std::lround(samples.count() * 85.0 / 105.0));
  options.test = samples.count() - options.train;
  const auto splits = effort::random_splits(samples, options);
  std::vector<Run> runs(splits.size());
  math::parallel_for(run_count, 0, [&](int r) {
    const auto at = static_cast<std::size_t>(r);
    runs[at] = run_split(samples, splits[at]);
  });
  std::printf("%s: %d runs of %d training and %d test blends\n", table.c_str(), run_count,
              options.train, options.test);
  std::printf("%-8s%-24s%8s%28s%10s\n", "", "", "error", "fifth less it, 95 %", "covered");
  const double ratio = static_cast<double>(options.test) / options.train;
  const auto values = [&](auto member, int f, int m) {
    Eigen::ArrayXd column(run_count);
    for (int r = 0; r < run_count; ++r)
      column[r] = (runs[static_cast<std::size_t>(r)].*member)(f, m);
    return column;
  };
  for (int f = 0; f < kFactorCount; ++f) {
    const Eigen::ArrayXd fifth = values(&Run::squared_error, f, kRegressorCount - 1);
    for (int m = 0; m < kRegressorCount; ++m) {
      const Eigen::ArrayXd error = values(&Run::squared_error, f, m);
      const Interval difference = interval_of(fifth - error, ratio);
      std::printf(
          "%-8s%-24s%8.4f    %+9.4f [%+.4f, %+.4f]%8.1f %%\n",
          m == 0
              ? std::string(effort::name_of(effort::kFactors[static_cast<std::size_t>(f)])).c_str()
              : "",
          std::string(effort::name_of(effort::kRegressors[static_cast<std::size_t>(m)])).c_str(),
          error.mean(), difference.mean, difference.mean - difference.half_width,
          difference.mean + difference.half_width, 100.0 * values(&Run::covered, f, m).mean());
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  int runs = 100, first = 1;
  if (argc > 2 && std::string(argv[1]) == "--runs") {
    runs = std::atoi(argv[2]);
    first = 3;
  }
  if (argc <= first || runs < 2) {
    std::fprintf(stderr, "usage: regression_study [--runs N] TABLE.csv...\n");
    return 2;
  }
  try {
    for (int n = first; n < argc; ++n) {
      study(argv[n], runs);
      std::fflush(stdout);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "regression_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
