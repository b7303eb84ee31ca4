#include "laban/learn/kernel_ridge.h"

#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

#include "samples.h"

namespace laban::learn {
namespace {

TEST(GaussianKernel, SquaredDistancesMatchTheirDefinition) {
  const Eigen::MatrixXd x = reference_samples().x;
  const Eigen::MatrixXd y = reference_samples().queries;
  const Eigen::MatrixXd d = squared_distances(x, y);
  for (int i = 0; i < x.cols(); ++i) {
    for (int j = 0; j < y.cols(); ++j) {
      EXPECT_NEAR(d(i, j), (x.col(i) - y.col(j)).squaredNorm(), 1e-13);
    }
  }
  EXPECT_GE(squared_distances(x, x).minCoeff(), 0.0);
  EXPECT_THROW((void)squared_distances(x, Eigen::MatrixXd::Zero(2, 1)), base::Error);
}

TEST(GaussianKernel, IsExpOfMinusHalfAtOneWidth) {
  const Eigen::MatrixXd squared = Eigen::MatrixXd::Constant(1, 1, 9.0);
  EXPECT_NEAR(gaussian_kernel(squared, 3.0)(0, 0), std::exp(-0.5), 1e-15);
}

TEST(GaussianKernel, MedianDistanceIsAScaleWithItsRules) {
  Eigen::MatrixXd x(1, 3);
  x << 0.0, 1.0, 4.0;  // distances 1, 3, 4
  EXPECT_DOUBLE_EQ(median_distance(x), 3.0);
  EXPECT_DOUBLE_EQ(median_distance(10.0 * x), 30.0);
  EXPECT_DOUBLE_EQ(median_distance(x.leftCols(1)), 1.0);
  EXPECT_DOUBLE_EQ(median_distance(Eigen::MatrixXd::Ones(2, 5)), 1.0);
}

TEST(KernelRidge, MatchesScikitLearn) {
  const ReferenceSamples data = reference_samples();
  const KernelRidge model = fit_kernel_ridge(data.x, data.y, {.width = 0.8, .loss_weight = 20.0});
  const Eigen::VectorXd predicted = model.predict(data.queries);
  // reference_values.py; 15 printed digits, a well conditioned system.
  EXPECT_NEAR(predicted[0], -0.886337517632712, 1e-12);
  EXPECT_NEAR(predicted[1], -0.76967966471117, 1e-12);
  EXPECT_NEAR(predicted[2], -0.0923590851379447, 1e-12);
  EXPECT_NEAR(predicted[3], 1.59049812201724, 1e-12);
}

TEST(KernelRidge, PassesThroughTheTargetsAsTheLossOutweighsTheRidge) {
  const ReferenceSamples data = reference_samples();
  const KernelRidge model = fit_kernel_ridge(data.x, data.y, {.width = 0.3, .loss_weight = 1e9});
  EXPECT_LT((model.predict(data.x) - data.y).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(KernelRidge, GoesToTheMeanFarFromTheSamplesAndUnderAHugeRidge) {
  const ReferenceSamples data = reference_samples();
  const KernelRidge model = fit_kernel_ridge(data.x, data.y, {.width = 0.8, .loss_weight = 20.0});
  EXPECT_DOUBLE_EQ(model.predict(Eigen::MatrixXd::Constant(3, 1, 1e3))[0], data.y.mean());
  const KernelRidge stiff = fit_kernel_ridge(data.x, data.y, {.width = 0.8, .loss_weight = 1e-12});
  EXPECT_NEAR(stiff.predict(data.queries)[0], data.y.mean(), 1e-9);
}

TEST(KernelRidge, DoesNotDependOnTheOrderOfSamplesAndFollowsAShiftOfTargets) {
  const ReferenceSamples data = reference_samples();
  const KernelRidgeOptions options{.width = 0.8, .loss_weight = 5.0};
  const Eigen::VectorXd straight = fit_kernel_ridge(data.x, data.y, options).predict(data.queries);
  const Eigen::VectorXd reversed =
      fit_kernel_ridge(data.x.rowwise().reverse(), data.y.reverse(), options).predict(data.queries);
  EXPECT_LT((straight - reversed).norm(), 1e-12);
  const Eigen::VectorXd shifted =
      fit_kernel_ridge(data.x, data.y.array() + 10.0, options).predict(data.queries);
  EXPECT_LT(((shifted - straight).array() - 10.0).matrix().norm(), 1e-11);
}

TEST(KernelRidge, StandardDeviationIsTheGaussianProcessOne) {
  // Oracle: condition the joint Gaussian of (noisy targets, function value) by a plain inverse.
  const ReferenceSamples data = reference_samples();
  const KernelRidgeOptions options{.width = 0.8, .loss_weight = 20.0};
  const KernelRidgePrediction predicted =
      fit_kernel_ridge(data.x, data.y, options).predict_with_variance(data.queries);
  Eigen::MatrixXd A = gaussian_kernel(squared_distances(data.x, data.x), options.width);
  A.diagonal().array() += 1.0 / options.loss_weight;
  const Eigen::MatrixXd inverse = A.inverse();
  const Eigen::VectorXd centered = data.y.array() - data.y.mean();
  const double s2 = centered.dot(inverse * centered) / static_cast<double>(data.y.size());
  const Eigen::MatrixXd k = gaussian_kernel(squared_distances(data.x, data.queries), options.width);
  for (int q = 0; q < k.cols(); ++q) {
    const double variance = s2 * (1.0 - k.col(q).dot(inverse * k.col(q)));
    EXPECT_NEAR(predicted.standard_deviation[q], std::sqrt(variance), 1e-10);
    EXPECT_NEAR(predicted.mean[q], data.y.mean() + k.col(q).dot(inverse * centered), 1e-10);
  }
}

TEST(KernelRidge, IsSureAtSamplesAndKnowsNothingFarAway) {
  const ReferenceSamples data = reference_samples();
  const KernelRidge model = fit_kernel_ridge(data.x, data.y, {.width = 0.3, .loss_weight = 1e9});
  EXPECT_LT(model.predict_with_variance(data.x).standard_deviation.maxCoeff(), 1e-3);
  const KernelRidgePrediction far =
      model.predict_with_variance(Eigen::MatrixXd::Constant(3, 1, 1e3));
  EXPECT_GT(far.standard_deviation[0], 0.1);
}

TEST(KernelRidge, AWeightOfKIsTheSampleGivenKTimes) {
  const ReferenceSamples data = reference_samples();
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(24);
  weights[3] = 2.0;
  weights[10] = 3.0;
  std::vector<int> columns(24);
  std::iota(columns.begin(), columns.end(), 0);
  columns.insert(columns.end(), {3, 10, 10});
  const KernelRidgeOptions options{.width = 0.8, .loss_weight = 5.0};
  const Eigen::VectorXd weighted =
      fit_kernel_ridge(data.x, data.y, options, weights).predict(data.queries);
  const Eigen::VectorXd repeated =
      fit_kernel_ridge(data.x(Eigen::all, columns), data.y(columns), options).predict(data.queries);
  EXPECT_LT((weighted - repeated).norm(), 1e-12);
  EXPECT_GT((weighted - fit_kernel_ridge(data.x, data.y, options).predict(data.queries)).norm(),
            1e-3);
}

TEST(KernelRidge, EqualWeightsScaleTheLossWeight) {
  const ReferenceSamples data = reference_samples();
  const Eigen::VectorXd halves = Eigen::VectorXd::Constant(24, 0.5);
  const auto predicted = [&](double loss_weight, const Eigen::VectorXd& weights) {
    return fit_kernel_ridge(data.x, data.y, {.width = 0.8, .loss_weight = loss_weight}, weights)
        .predict(data.queries);
  };
  EXPECT_LT((predicted(10.0, halves) - predicted(5.0, Eigen::VectorXd())).norm(), 1e-12);
}

TEST(KernelRidge, RefusesWeightsThatAreNone) {
  const ReferenceSamples data = reference_samples();
  EXPECT_THROW((void)fit_kernel_ridge(data.x, data.y, {}, Eigen::VectorXd::Zero(24)), base::Error);
  EXPECT_THROW((void)fit_kernel_ridge(data.x, data.y, {}, Eigen::VectorXd::Ones(3)), base::Error);
}

TEST(KernelRidge, SaysWhenItsSystemDoesNotSolve) {
  // Not positive semi-definite: no kernel of anything.
  Eigen::Matrix2d kernel;
  kernel << 1.0, 3.0, 3.0, 1.0;
  try {
    (void)solve_kernel_ridge(kernel, Eigen::Vector2d(1.0, 2.0), 10.0);
    FAIL();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kNumeric);
    EXPECT_THAT(error.what(), testing::HasSubstr("not positive definite"));
  }
}

TEST(KernelRidge, RefusesBadOptionsAndSizes) {
  const ReferenceSamples data = reference_samples();
  const auto kind = [&](const KernelRidgeOptions& options, const Eigen::VectorXd& y) {
    try {
      (void)fit_kernel_ridge(data.x, y, options);
    } catch (const base::Error& error) {
      return error.kind();
    }
    return base::ErrorKind::kInternal;
  };
  EXPECT_EQ(kind({.width = -1.0}, data.y), base::ErrorKind::kUsage);
  EXPECT_EQ(kind({.loss_weight = 0.0}, data.y), base::ErrorKind::kUsage);
  EXPECT_EQ(kind({}, data.y.head(3)), base::ErrorKind::kData);
}

}  // namespace
}  // namespace laban::learn
