#include "laban/effort/evaluation.h"

#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "style_samples.h"

namespace laban::effort {
namespace {

RegressorGrid small_grid() {
  return {.relative_widths = {0.7, 1.4, 4.0},
          .loss_weights = {1e-2, 1.0, 10.0, 100.0},
          .linear_loss_weights = {0.01, 1.0, 100.0},
          .svr_relative_widths = {1.0},
          .svr_loss_weights = {10.0},
          .svr_epsilons = {0.1}};
}

EvaluationOptions quick(int runs) {
  return {.runs = runs, .train = 60, .test = 20, .threads = 2, .grid = small_grid()};
}

StyleSamples some_blends(int count, double noise) {
  base::Rng rng(1);
  return invent_blends({.count = count, .noise = noise, .beyond_interpolation = bulge}, rng);
}

class Listener : public base::Progress {
 public:
  explicit Listener(int stop_after) : stop_after_(stop_after) {}
  bool update(double fraction) override {
    fractions.push_back(fraction);
    return static_cast<int>(fractions.size()) < stop_after_;
  }
  std::vector<double> fractions;

 private:
  int stop_after_;
};

TEST(RandomSplits, AreDisjointOfTheAskedSizesAndRepeatable) {
  const StyleSamples samples = some_blends(105, 0.3);
  const EvaluationOptions options{.runs = 20};
  const auto splits = random_splits(samples, options);
  ASSERT_EQ(splits.size(), 20U);
  std::set<std::vector<int>> different;
  for (const Split& split : splits) {
    EXPECT_EQ(split.train.size(), 85U);
    EXPECT_EQ(split.test.size(), 20U);
    std::set<int> columns(split.train.begin(), split.train.end());
    columns.insert(split.test.begin(), split.test.end());
    EXPECT_EQ(columns.size(), 105U);
    EXPECT_EQ(*columns.rbegin(), 104);
    different.insert(split.test);
  }
  EXPECT_EQ(different.size(), 20U);
  EXPECT_EQ(random_splits(samples, options)[7].test, splits[7].test);
  // Split r does not depend on how many runs there are.
  EXPECT_EQ(random_splits(samples, {.runs = 8})[7].test, splits[7].test);
  EXPECT_NE(random_splits(samples, {.runs = 8, .seed = 2})[7].test, splits[7].test);
}

TEST(RandomSplits, KeepTheRowsOfOneBlendTogether) {
  StyleSamples samples = some_blends(60, 0.3);
  for (int n = 0; n < 60; ++n) samples.groups.push_back(n % 30);  // two observers a blend
  for (const Split& split : random_splits(samples, {.runs = 10, .train = 20, .test = 10})) {
    EXPECT_EQ(split.train.size(), 40U);
    std::set<int> train;
    for (const int column : split.train) train.insert(column % 30);
    for (const int column : split.test) EXPECT_EQ(train.count(column % 30), 0U);
  }
}

TEST(Evaluate, LinearTruthWithoutNoiseLeavesInterpolationNoError) {
  base::Rng rng(1);
  const StyleSamples samples = invent_blends({.count = 90, .noise = 0.0}, rng);
  const EvaluationReport report = evaluate(samples, quick(5));
  for (const FactorReport& factor : report.factors) {
    EXPECT_LT(factor.models[0].error.mean, 1e-25);
    EXPECT_LT(factor.models[4].error.mean, 1e-15);
    EXPECT_GT(factor.models[1].error.mean, 0.05);  // alpha * e is no linear function of z
  }
}

TEST(Evaluate, NoiseIsTheFloorThatEveryModelMeets) {
  base::Rng rng(1);
  const StyleSamples samples = invent_blends({.count = 90, .noise = 0.6}, rng);
  const EvaluationReport report = evaluate(samples, quick(40));
  const Eigen::MatrixXd noise = samples.labels - linear_interpolation(samples.features);
  for (const FactorReport& factor : report.factors) {
    // 40 test sets of 20 of the 90: within 3 standard errors of the noise that was drawn, which for
    // a variance of 0.36 to 0.6 is 3 * 0.8 * sqrt((1 - 20 / 90) / 800).
    const double drawn = noise.row(index_of(factor.factor)).squaredNorm() / 90.0;
    EXPECT_NEAR(factor.models[0].error.mean, drawn, 0.075);
    for (const ModelScore& score : factor.models) EXPECT_GT(score.error.mean, 0.2);
  }
}

TEST(Evaluate, AnInteractionIsWhatKernelsWinOn) {
  // Labels that turn on a product of features: interpolation and linear ridge cannot say it.
  base::Rng rng(3);
  StyleSamples samples = invent_blends({.count = 100, .noise = 0.1}, rng);
  for (int n = 0; n < 100; ++n) {
    const Eigen::VectorXd z = samples.features.col(n);
    samples.labels.col(n).setConstant(std::tanh(z[0] + z[3]) * (1.0 + std::cos(2.0 * z[12])));
  }
  const EvaluationReport report = evaluate(samples, quick(10));
  for (const FactorReport& factor : report.factors) {
    EXPECT_LT(factor.models[2].ratio_to_interpolation, 0.5);
    EXPECT_LT(factor.models[2].error.mean, factor.models[1].error.mean);
    EXPECT_LT(factor.models[3].error.mean, factor.models[1].error.mean);
  }
}

TEST(Evaluate, SplitsAndFoldsAreTheSameForEveryModel) {
  const StyleSamples samples = some_blends(90, 0.3);
  const EvaluationReport all = evaluate(samples, quick(4));
  for (std::size_t m = 0; m < kRegressorCount; ++m) {
    EvaluationOptions alone = quick(4);
    alone.models = {kRegressors[m]};
    const EvaluationReport one = evaluate(samples, alone);
    for (std::size_t f = 0; f < kFactorCount; ++f) {
      EXPECT_EQ(one.factors[f].models[0].error.mean, all.factors[f].models[m].error.mean)
          << name_of(kRegressors[m]);
      EXPECT_EQ(one.factors[f].models[0].ratio_to_interpolation,
                all.factors[f].models[m].ratio_to_interpolation);
    }
  }
}

TEST(Evaluate, DoesNotDependOnTheNumberOfThreads) {
  const StyleSamples samples = some_blends(90, 0.3);
  EvaluationOptions one = quick(6), many = quick(6);
  one.threads = 1;
  many.threads = 4;
  for (std::size_t f = 0; f < kFactorCount; ++f) {
    EXPECT_EQ(evaluate(samples, one).run_errors[f], evaluate(samples, many).run_errors[f]);
  }
}

// Oracle: one run by hand.
TEST(Evaluate, IsTheTestErrorOfModelsFittedOnTheTrainingPart) {
  const StyleSamples samples = some_blends(90, 0.3);
  EvaluationOptions options = quick(2);
  options.models = {RegressorKind::kLinearInterpolation};
  const EvaluationReport report = evaluate(samples, options);
  const auto splits = random_splits(samples, options);
  for (int run = 0; run < 2; ++run) {
    double sum = 0.0;
    for (const int n : splits[static_cast<std::size_t>(run)].test) {
      const double alpha = samples.features(12, n);
      const double mixed = (1.0 - alpha) * samples.features(7, n) + alpha * samples.features(10, n);
      sum += std::pow(mixed - samples.labels(1, n), 2);
    }
    EXPECT_NEAR(report.run_errors[1](run, 0), sum / 20.0, 1e-12);
  }
}

TEST(Evaluate, ReportsVarianceErrorsRatiosAndPairedDifferences) {
  const StyleSamples samples = some_blends(90, 0.3);
  const EvaluationReport report = evaluate(samples, quick(8));
  EXPECT_EQ(report.runs, 8);
  EXPECT_EQ(report.train, 60);
  EXPECT_EQ(report.test, 20);
  for (std::size_t f = 0; f < kFactorCount; ++f) {
    const FactorReport& factor = report.factors[f];
    const Eigen::ArrayXd labels = samples.labels.row(static_cast<int>(f)).transpose().array();
    EXPECT_NEAR(factor.label_variance, (labels - labels.mean()).square().mean(), 1e-12);
    EXPECT_EQ(factor.models[0].ratio_to_interpolation, 1.0);
    const Eigen::ArrayXd a = report.run_errors[f].col(4).array();
    const Eigen::ArrayXd b = report.run_errors[f].col(2).array();
    const Eigen::ArrayXd d = a - b;
    const double variance = (d - d.mean()).square().sum() / 7.0;
    const PairedDifference difference = report.compare(
        factor.factor, RegressorKind::kResidualKernelRidge, RegressorKind::kKernelRidge);
    EXPECT_NEAR(difference.difference.mean, d.mean(), 1e-12);
    EXPECT_NEAR(difference.difference.standard_error, std::sqrt(variance / 8.0), 1e-12);
    EXPECT_NEAR(difference.difference.corrected_standard_error,
                std::sqrt(variance * (1.0 / 8.0 + 20.0 / 60.0)), 1e-12);
    ASSERT_TRUE(factor.fifth_against_best.has_value());
    for (std::size_t m = 0; m < 4; ++m) {
      EXPECT_LE(factor.models[4].error.mean - factor.models[m].error.mean,
                factor.fifth_against_best->difference.mean + 1e-12);
    }
  }
  EXPECT_EQ(report.factors[0].models[0].paper, 0.65);
  EXPECT_EQ(report.factors[1].models[2].paper, 0.39);
  EXPECT_EQ(report.factors[2].models[3].paper, 0.61);
  EXPECT_EQ(report.factors[0].models[4].paper, std::nullopt);
}

TEST(Evaluate, TellsProgressAndCanBeStopped) {
  const StyleSamples samples = some_blends(90, 0.3);
  EvaluationOptions options = quick(5);
  options.models = {RegressorKind::kLinearRidge};
  Listener patient(100);
  (void)evaluate(samples, options, &patient);
  EXPECT_EQ(patient.fractions.size(), 5U);
  EXPECT_EQ(patient.fractions.back(), 1.0);
  Listener hasty(2);
  EXPECT_THROW((void)evaluate(samples, options, &hasty), base::Error);
}

TEST(Evaluate, NamesWhatItRefuses) {
  const StyleSamples samples = some_blends(30, 0.3);
  const auto message = [&](const EvaluationOptions& options) {
    try {
      (void)evaluate(samples, options);
    } catch (const base::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(message({.runs = 1}), testing::HasSubstr("runs = 1 (must be >= 2)"));
  EXPECT_THAT(message({}), testing::HasSubstr("85 blends to train and 20 to test on, but there "
                                              "are 30"));
  EXPECT_THAT(message({.models = {}}), testing::HasSubstr("models is empty"));
  const std::vector<Split> overlapping = {{{0, 1, 2}, {2}}};
  EXPECT_THROW((void)evaluate_splits(samples, overlapping, {}), base::Error);
  EXPECT_THROW((void)evaluate_splits(samples, {}, {}), base::Error);
  EvaluationOptions few = quick(2);
  few.train = 10;
  few.test = 5;
  few.models = {RegressorKind::kLinearRidge};
  EXPECT_THROW(
      (void)evaluate(samples, few)
          .compare(Factor::kFlow, RegressorKind::kLinearRidge, RegressorKind::kKernelRidge),
      base::Error);
}

}  // namespace
}  // namespace laban::effort
