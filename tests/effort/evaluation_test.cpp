#include "laban/effort/evaluation.h"

#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "support/listener.h"

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

/// Groups of parents drawn at random among `names`; some blends have both parents in one.
ParentGroups some_parents(int count, int names, std::uint64_t seed) {
  base::Rng rng(seed);
  ParentGroups groups;
  for (int g = 0; g < names; ++g)
    groups.names.push_back(std::string("p").append(std::to_string(g)));
  for (int n = 0; n < count; ++n) {
    groups.first.push_back(rng.index(names));
    groups.second.push_back(rng.index(names));
  }
  return groups;
}

TEST(LeaveOneOutSplits, HoldOutEveryBlendWithAParentInTheGroupAndCoverAllBlends) {
  const ParentGroups groups = some_parents(60, 7, 4);
  const auto splits = leave_one_out_splits(groups, 60);
  ASSERT_EQ(splits.size(), 7U);
  std::vector<int> tested(60, 0);
  for (int g = 0; g < 7; ++g) {
    const Split& split = splits[static_cast<std::size_t>(g)];
    EXPECT_EQ(split.train.size() + split.test.size(), 60U);
    for (const int n : split.train) {
      EXPECT_NE(groups.first[static_cast<std::size_t>(n)], g);
      EXPECT_NE(groups.second[static_cast<std::size_t>(n)], g);
    }
    for (const int n : split.test) ++tested[static_cast<std::size_t>(n)];
  }
  for (std::size_t n = 0; n < 60; ++n)
    EXPECT_EQ(tested[n], groups.first[n] == groups.second[n] ? 1 : 2);
}

// Oracle: the errors by hand, from interpolation, which learns nothing.
TEST(EvaluateLeavingOneOut, CountsEachBlendOnceWithItsMeanErrorOverTheRunsThatHoldItOut) {
  const StyleSamples samples = some_blends(40, 0.5);
  const ParentGroups groups = some_parents(40, 6, 2);
  EvaluationOptions options = quick(2);
  options.models = {RegressorKind::kLinearInterpolation};
  const EvaluationReport report =
      evaluate_leaving_one_out(samples, groups, Protocol::kLeavePerformerOut, {}, options);
  ASSERT_EQ(report.runs, 6);
  EXPECT_EQ(report.run_list[2].held_out, "p2");
  const Eigen::Matrix3Xd squares =
      (linear_interpolation(samples.features) - samples.labels).array().square();
  const auto splits = leave_one_out_splits(groups, 40);
  for (std::size_t f = 0; f < kFactorCount; ++f) {
    const Eigen::RowVectorXd row = squares.row(static_cast<int>(f));
    EXPECT_NEAR(report.factors[f].models[0].error.mean, row.mean(), 1e-12);
    EXPECT_EQ(report.factors[f].models[0].error.degrees_of_freedom, 5);
    double sum = 0.0;
    for (const int n : splits[2].test) sum += row[n];
    EXPECT_NEAR(report.run_errors[f](2, 0), sum / static_cast<double>(splits[2].test.size()),
                1e-12);
  }
}

TEST(EvaluateLeavingOneOut, TrainsEachRunOnWhatIsKnownWithoutItsGroup) {
  const StyleSamples samples = some_blends(50, 0.3);
  const ParentGroups groups = some_parents(50, 5, 3);
  EvaluationOptions options = quick(2);
  options.models = {RegressorKind::kKernelRidge};
  // What run 3 is told is nonsense, what the others are told is what the samples say.
  const auto told = [&](int group) {
    Eigen::MatrixXd features = samples.features;
    if (group == 3) features.topRows(6).setZero();
    return features;
  };
  const auto protocol = Protocol::kLeavePerformerOut;
  const auto plain = evaluate_leaving_one_out(samples, groups, protocol, {}, options);
  const auto misled = evaluate_leaving_one_out(samples, groups, protocol, told, options);
  for (int run = 0; run < 5; ++run) {
    EXPECT_EQ(plain.run_errors[0](run, 0) == misled.run_errors[0](run, 0), run != 3) << run;
  }
}

TEST(EvaluateLeavingOneOut, TellsTheRunsItSkips) {
  const StyleSamples samples = some_blends(30, 0.3);
  ParentGroups groups = some_parents(30, 4, 5);
  groups.names.push_back("nobody's parent");
  // Group 0 has a part in all blends but two.
  for (std::size_t n = 2; n < 30; ++n) groups.first[n] = 0;
  groups.first[0] = groups.first[1] = groups.second[0] = groups.second[1] = 1;
  EvaluationOptions options = quick(2);
  options.models = {RegressorKind::kLinearRidge};
  const auto report =
      evaluate_leaving_one_out(samples, groups, Protocol::kLeaveContentOut, {}, options);
  ASSERT_EQ(report.skipped.size(), 2U);
  EXPECT_EQ(report.runs, 3);
  EXPECT_EQ(report.skipped[0].run.held_out, "p0");
  EXPECT_EQ(report.skipped[0].reason, "2 blends to train on, at least 3");
  EXPECT_EQ(report.skipped[1].run.held_out, "nobody's parent");
  EXPECT_EQ(report.skipped[1].reason, "no blend to test on");

  const ParentGroups one{std::vector<int>(30, 0), std::vector<int>(30, 0), {"all"}};
  try {
    (void)evaluate_leaving_one_out(samples, one, Protocol::kLeaveContentOut, {}, options);
    FAIL();
  } catch (const base::Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("leave-content-out has no run of 1 to make"));
  }
  EXPECT_THROW((void)leave_one_out_splits(one, 31), base::Error);
}

TEST(EvaluateLeavingOneOut, DoesNotDependOnTheNumberOfThreads) {
  const StyleSamples samples = some_blends(60, 0.3);
  const ParentGroups groups = some_parents(60, 6, 1);
  EvaluationOptions one = quick(2), many = quick(2);
  one.threads = 1;
  many.threads = 3;
  const auto protocol = Protocol::kLeavePerformerOut;
  const auto a = evaluate_leaving_one_out(samples, groups, protocol, {}, one);
  const auto b = evaluate_leaving_one_out(samples, groups, protocol, {}, many);
  for (std::size_t f = 0; f < kFactorCount; ++f) {
    EXPECT_EQ(a.run_errors[f], b.run_errors[f]);
    EXPECT_EQ(a.factors[f].differences[0].difference.low,
              b.factors[f].differences[0].difference.low);
  }
}

/// A report of one factor's errors, two models, as if it had been evaluated.
EvaluationReport report_of(const Eigen::MatrixXd& errors, double test_to_train) {
  EvaluationReport report;
  report.runs = static_cast<int>(errors.rows());
  report.test_to_train = test_to_train;
  report.run_errors.assign(kFactorCount, errors);
  report.factors.resize(kFactorCount);
  for (FactorReport& factor : report.factors) {
    factor.label_variance = 1.0;
    factor.models.resize(2);
    factor.models[0].kind = RegressorKind::kResidualKernelRidge;
    factor.models[1].kind = RegressorKind::kLinearInterpolation;
  }
  return report;
}

TEST(PairedDifference, HasTheIntervalOfNadeauAndBengioAsAHandFindsIt) {
  // Differences -0.1, -0.2, -0.3, -0.4: mean -0.25, variance 0.05 / 3. With 20 / 85 the standard
  // error is sqrt(0.05 / 3 * (1 / 4 + 20 / 85)) = 0.0899, times t(3) 3.182446: 0.2861.
  Eigen::MatrixXd errors(4, 2);
  errors << 0.9, 1.0, 0.5, 0.7, 0.7, 1.0, 0.6, 1.0;
  const auto paired = report_of(errors, 20.0 / 85.0)
                          .compare(Factor::kTime, RegressorKind::kResidualKernelRidge,
                                   RegressorKind::kLinearInterpolation)
                          .difference;
  EXPECT_NEAR(paired.mean, -0.25, 1e-12);
  EXPECT_NEAR(paired.standard_error, 0.0645497224, 1e-9);
  EXPECT_NEAR(paired.corrected_standard_error, 0.0899346168, 1e-9);
  EXPECT_NEAR(paired.low, -0.25 - 3.18244630528 * 0.0899346168, 1e-8);
  EXPECT_NEAR(paired.high, -0.25 + 3.18244630528 * 0.0899346168, 1e-8);
  EXPECT_EQ(paired.degrees_of_freedom, 3);
  EXPECT_EQ(paired.verdict(), Verdict::kWithinNoise);
  // Nothing but the splits' overlap makes it uncertain.
  const auto alone = report_of(errors, 0.0)
                         .compare(Factor::kTime, RegressorKind::kResidualKernelRidge,
                                  RegressorKind::kLinearInterpolation);
  EXPECT_EQ(alone.difference.verdict(), Verdict::kBelow);
  const auto turned = report_of(errors, 0.0)
                          .compare(Factor::kTime, RegressorKind::kLinearInterpolation,
                                   RegressorKind::kResidualKernelRidge);
  EXPECT_EQ(turned.difference.verdict(), Verdict::kAbove);
}

TEST(PairedDifference, OfTheSamePredictionsIsNoiseWhateverTheRoundOff) {
  Eigen::MatrixXd errors(3, 2);
  errors << 0.5, 0.5 + 1e-16, 0.7, 0.7 + 2e-16, 0.9, 0.9 + 1e-16;
  const auto paired = report_of(errors, 0.1)
                          .compare(Factor::kFlow, RegressorKind::kResidualKernelRidge,
                                   RegressorKind::kLinearInterpolation);
  EXPECT_EQ(paired.difference.mean, 0.0);
  EXPECT_EQ(paired.difference.verdict(), Verdict::kWithinNoise);
}

TEST(PairedDifference, OfOneRunIsNotKnown) {
  const Eigen::MatrixXd errors = Eigen::RowVector2d(0.1, 5.0);
  const auto paired = report_of(errors, 0.1)
                          .compare(Factor::kFlow, RegressorKind::kResidualKernelRidge,
                                   RegressorKind::kLinearInterpolation);
  EXPECT_NEAR(paired.difference.mean, -4.9, 1e-12);
  EXPECT_EQ(paired.difference.verdict(), Verdict::kWithinNoise);
}

TEST(Evaluate, FindsTheFifthBelowInterpolationWhereTheTruthIsAndWithinNoiseWhereItIsNot) {
  // The truth is an interpolation, or everywhere one more than it, which is soon learnt: what the
  // intervals should find is known.
  const auto more = [](const Eigen::VectorXd&) -> EffortVector {
    return EffortVector::Constant(kFactorCount, 1.0);
  };
  for (const auto protocol : {Protocol::kRandom, Protocol::kLeavePerformerOut}) {
    for (const bool beyond : {true, false}) {
      base::Rng rng(1);
      InventedBlends recipe{.count = 105, .noise = 0.3};
      if (beyond) recipe.beyond_interpolation = more;
      const StyleSamples samples = invent_blends(recipe, rng);
      EvaluationOptions options = quick(30);
      options.models = {RegressorKind::kLinearInterpolation, RegressorKind::kLinearRidge,
                        RegressorKind::kKernelRidge, RegressorKind::kResidualKernelRidge};
      const EvaluationReport report =
          protocol == Protocol::kRandom
              ? evaluate(samples, options)
              : evaluate_leaving_one_out(samples, some_parents(105, 12, 6), protocol, {}, options);
      for (const FactorReport& factor : report.factors) {
        SCOPED_TRACE(testing::Message() << name_of(protocol) << " " << name_of(factor.factor)
                                        << (beyond ? " and more" : ""));
        ASSERT_EQ(factor.differences.size(), 5U);  // three against interpolation, fifth against two
        ASSERT_TRUE(factor.fifth_standing().has_value());
        EXPECT_EQ(factor.fifth_standing()->below_interpolation, beyond);
        EXPECT_TRUE(factor.fifth_standing()->could_be_below);
        EXPECT_TRUE(factor.fifth_standing()->not_above_others);
        for (const PairedDifference& paired : factor.differences) {
          EXPECT_LE(paired.difference.low, paired.difference.mean);
          EXPECT_GE(paired.difference.high, paired.difference.mean);
        }
      }
    }
  }
}

TEST(Evaluate, TellsWhetherAModelWithoutErrorWouldBeBelowInterpolation) {
  // Four performers, 26 blends each of their own. Noise everywhere is missed by as much in each of
  // them: a model without error would be surely better. Interpolation that errs with one performer
  // alone may be right with all others that there are: nothing can be surely better.
  ParentGroups performers;
  performers.names = {"a", "b", "c", "d"};
  for (int n = 0; n < 104; ++n) performers.first.push_back(n % 4);
  performers.second = performers.first;
  for (const bool everywhere : {true, false}) {
    SCOPED_TRACE(everywhere ? "noise everywhere" : "one performer apart");
    base::Rng rng(2);
    StyleSamples samples = invent_blends({.count = 104, .noise = everywhere ? 1.0 : 0.0}, rng);
    for (int n = 0; n < 104 && !everywhere; n += 4) samples.labels.col(n).array() += rng.normal();
    EvaluationOptions options = quick(2);
    options.models = {RegressorKind::kResidualKernelRidge};
    const EvaluationReport report =
        evaluate_leaving_one_out(samples, performers, Protocol::kLeavePerformerOut, {}, options);
    for (const FactorReport& factor : report.factors) {
      ASSERT_TRUE(factor.fifth_standing().has_value());
      EXPECT_FALSE(factor.fifth_standing()->below_interpolation);
      EXPECT_EQ(factor.fifth_standing()->could_be_below, everywhere);
    }
  }
}

TEST(Protocol, HasANameEach) {
  for (const Protocol protocol : kProtocols) EXPECT_EQ(protocol_named(name_of(protocol)), protocol);
  EXPECT_EQ(protocol_named("leave-one-out"), std::nullopt);
}

TEST(Evaluate, LinearTruthWithoutNoiseLeavesInterpolationNoError) {
  base::Rng rng(1);
  StyleSamples samples = invent_blends({.count = 90, .noise = 0.0}, rng);
  // Blends beyond their seeds stay on the scale of labels, at whose ends the fifth cuts.
  samples.features.middleRows(6, 6) *= 0.6;
  samples.labels *= 0.6;
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
  test::Listener patient;
  (void)evaluate(samples, options, &patient);
  EXPECT_EQ(patient.fractions.size(), 5U);
  EXPECT_EQ(patient.fractions.back(), 1.0);
  test::Listener hasty(2);
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
