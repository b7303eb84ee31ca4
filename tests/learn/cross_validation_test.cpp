#include "laban/learn/cross_validation.h"

#include <limits>
#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/learn/kernel_ridge.h"
#include "laban/learn/linear_ridge.h"

#include "samples.h"

namespace laban::learn {
namespace {

std::vector<int> others(const std::vector<int>& folds, int fold, bool held_out) {
  std::vector<int> result;
  for (std::size_t n = 0; n < folds.size(); ++n) {
    if ((folds[n] == fold) == held_out) result.push_back(static_cast<int>(n));
  }
  return result;
}

TEST(AssignFolds, FoldsDifferByAtMostOneGroupAndHoldGroupsWhole) {
  base::Rng rng(1);
  std::vector<int> groups;
  for (int n = 0; n < 47; ++n) groups.push_back(100 - n / 2);  // 24 groups, pairs
  const std::vector<int> folds = assign_folds(groups, 10, rng);
  std::map<int, std::set<int>> folds_of_group, groups_of_fold;
  for (std::size_t n = 0; n < groups.size(); ++n) {
    folds_of_group[groups[n]].insert(folds[n]);
    groups_of_fold[folds[n]].insert(groups[n]);
  }
  for (const auto& [group, in] : folds_of_group) EXPECT_EQ(in.size(), 1U) << group;
  EXPECT_EQ(groups_of_fold.size(), 10U);
  for (const auto& [fold, in] : groups_of_fold) {
    EXPECT_GE(in.size(), 2U) << fold;
    EXPECT_LE(in.size(), 3U) << fold;
  }
}

TEST(AssignFolds, DependsOnTheSeedAlone) {
  base::Rng a(9), b(9), c(10);
  const std::vector<int> first = assign_folds(85, 10, a);
  EXPECT_EQ(first, assign_folds(85, 10, b));
  EXPECT_NE(first, assign_folds(85, 10, c));
}

TEST(AssignFolds, RefusesOneFoldAndOneGroup) {
  base::Rng rng(1);
  EXPECT_THROW((void)assign_folds(5, 1, rng), base::Error);
  EXPECT_THROW((void)assign_folds(1, 2, rng), base::Error);
}

// Oracle: the model refitted without each fold.
TEST(KernelRidgeHeldOutResiduals, EqualExplicitRefits) {
  base::Rng rng(4);
  for (int trial = 0; trial < 10; ++trial) {
    SCOPED_TRACE(trial);
    const int count = 6 + rng.index(40);
    Eigen::MatrixXd x(3, count), targets(count, 2);
    for (double& value : x.reshaped()) value = rng.normal();
    for (double& value : targets.reshaped()) value = 5.0 + rng.normal();
    const KernelRidgeOptions options{.width = rng.uniform(0.5, 3.0),
                                     .loss_weight = std::pow(10.0, rng.uniform(-2.0, 3.0))};
    const std::vector<int> folds = assign_folds(count, 2 + rng.index(9), rng);
    const Eigen::MatrixXd fast =
        kernel_ridge_held_out_residuals(gaussian_kernel(squared_distances(x, x), options.width),
                                        targets, options.loss_weight, folds);
    for (int fold = 0; fold < 11; ++fold) {
      const std::vector<int> held_out = others(folds, fold, true);
      const std::vector<int> rest = others(folds, fold, false);
      if (held_out.empty()) continue;
      for (int target = 0; target < 2; ++target) {
        const Eigen::VectorXd y = targets.col(target);
        const KernelRidge refit = fit_kernel_ridge(x(Eigen::all, rest), y(rest), options);
        const Eigen::VectorXd slow = y(held_out) - refit.predict(x(Eigen::all, held_out));
        // Condition number up to 1e3 * count.
        EXPECT_LT((fast(held_out, target) - slow).norm(), 1e-9);
      }
    }
  }
}

// Oracle: the weighted model refitted without each fold.
TEST(KernelRidgeHeldOutResiduals, EqualExplicitRefitsWithWeights) {
  base::Rng rng(5);
  for (int trial = 0; trial < 10; ++trial) {
    SCOPED_TRACE(trial);
    const int count = 6 + rng.index(40);
    Eigen::MatrixXd x(3, count), targets(count, 1);
    Eigen::VectorXd weights(count);
    for (double& value : x.reshaped()) value = rng.normal();
    for (double& value : targets.reshaped()) value = 5.0 + rng.normal();
    for (double& value : weights) value = rng.uniform(0.1, 3.0);
    const KernelRidgeOptions options{.width = rng.uniform(0.5, 3.0),
                                     .loss_weight = std::pow(10.0, rng.uniform(-2.0, 2.0))};
    const std::vector<int> folds = assign_folds(count, 2 + rng.index(9), rng);
    const Eigen::MatrixXd fast =
        kernel_ridge_held_out_residuals(gaussian_kernel(squared_distances(x, x), options.width),
                                        targets, options.loss_weight, folds, weights);
    for (int fold = 0; fold < 11; ++fold) {
      const std::vector<int> held_out = others(folds, fold, true);
      const std::vector<int> rest = others(folds, fold, false);
      if (held_out.empty()) continue;
      const Eigen::VectorXd y = targets.col(0);
      const KernelRidge refit =
          fit_kernel_ridge(x(Eigen::all, rest), y(rest), options, weights(rest));
      const Eigen::VectorXd slow = y(held_out) - refit.predict(x(Eigen::all, held_out));
      // Condition number up to 1e2 * 3 * count.
      EXPECT_LT((fast(held_out, 0) - slow).norm(), 1e-9);
    }
  }
}

/// Columns 0 .. count - 1, each as often as its weight says.
std::vector<int> repeated(const Eigen::VectorXd& weights) {
  std::vector<int> columns;
  for (int n = 0; n < static_cast<int>(weights.size()); ++n) {
    columns.insert(columns.end(), static_cast<std::size_t>(weights[n]), n);
  }
  return columns;
}

TEST(SelectRidge, AWeightOfKIsTheSampleGivenKTimesInItsFold) {
  const ReferenceSamples data = reference_samples();
  base::Rng rng(3);
  Eigen::VectorXd weights(24);
  for (double& weight : weights) weight = 1.0 + rng.index(3);
  const std::vector<int> copies = repeated(weights);
  const std::vector<int> folds = assign_folds(24, 6, rng);
  std::vector<int> copied_folds;
  for (const int column : copies) copied_folds.push_back(folds[static_cast<std::size_t>(column)]);
  const Eigen::MatrixXd y = data.y, x = data.x;
  const Eigen::MatrixXd copied_x = x(Eigen::all, copies), copied_y = y(copies, Eigen::all);
  const std::vector<double> loss_weights = {0.1, 1.0, 10.0};

  const auto kernels = [](const Eigen::MatrixXd& samples) {
    std::vector<Eigen::MatrixXd> result;
    for (const double width : {0.2, 0.8, 3.0}) {
      result.push_back(gaussian_kernel(squared_distances(samples, samples), width));
    }
    return result;
  };
  const auto ours = select_kernel_ridge(kernels(x), y, loss_weights, folds, weights).front();
  const auto copied =
      select_kernel_ridge(kernels(copied_x), copied_y, loss_weights, copied_folds).front();
  EXPECT_EQ(ours.kernel, copied.kernel);
  EXPECT_EQ(ours.loss_weight, copied.loss_weight);
  EXPECT_NEAR(ours.mean_squared_error, copied.mean_squared_error, 1e-10);
  const auto unweighted = select_kernel_ridge(kernels(x), y, loss_weights, folds).front();
  EXPECT_GT(std::abs(ours.mean_squared_error - unweighted.mean_squared_error), 1e-4);

  const auto linear = select_linear_ridge(x, y, loss_weights, folds, weights).front();
  const auto copied_linear =
      select_linear_ridge(copied_x, copied_y, loss_weights, copied_folds).front();
  EXPECT_EQ(linear.loss_weight, copied_linear.loss_weight);
  EXPECT_NEAR(linear.mean_squared_error, copied_linear.mean_squared_error, 1e-10);
}

TEST(KernelRidgeHeldOutResiduals, RefuseOneFoldAndWrongSizes) {
  const Eigen::MatrixXd K = Eigen::MatrixXd::Identity(3, 3);
  const Eigen::MatrixXd y = Eigen::MatrixXd::Ones(3, 1);
  const std::vector<int> same = {1, 1, 1}, two = {0, 1};
  EXPECT_THROW((void)kernel_ridge_held_out_residuals(K, y, 1.0, same), base::Error);
  EXPECT_THROW((void)kernel_ridge_held_out_residuals(K, y, 1.0, two), base::Error);
}

TEST(SelectKernelRidge, PicksTheLeastPooledErrorForEachTargetByItself) {
  const ReferenceSamples data = reference_samples();
  base::Rng rng(2);
  Eigen::MatrixXd targets(24, 2);
  targets.col(0) = data.y;
  for (int n = 0; n < 24; ++n) targets(n, 1) = rng.normal();  // nothing to learn
  const std::vector<int> folds = assign_folds(24, 10, rng);
  std::vector<Eigen::MatrixXd> kernels;
  for (const double width : {0.2, 0.8, 3.0}) {
    kernels.push_back(gaussian_kernel(squared_distances(data.x, data.x), width));
  }
  const std::vector<double> loss_weights = {1e-4, 1.0, 100.0};
  const auto chosen = select_kernel_ridge(kernels, targets, loss_weights, folds);
  ASSERT_EQ(chosen.size(), 2U);
  for (int target = 0; target < 2; ++target) {
    double least = std::numeric_limits<double>::infinity();
    for (const Eigen::MatrixXd& K : kernels) {
      for (const double U : loss_weights) {
        const double error =
            kernel_ridge_held_out_residuals(K, targets, U, folds).col(target).squaredNorm() / 24.0;
        least = std::min(least, error);
      }
    }
    const CrossValidationChoice& choice = chosen[static_cast<std::size_t>(target)];
    EXPECT_DOUBLE_EQ(choice.mean_squared_error, least);
  }
  EXPECT_GT(chosen[0].loss_weight, chosen[1].loss_weight);
}

TEST(SelectKernelRidge, PassesOverPointsThatDoNotSolve) {
  Eigen::MatrixXd K(4, 4);  // indefinite, so only a large ridge solves
  K << 0, 2, 0, 0, 2, 0, 0, 0, 0, 0, 0, 2, 0, 0, 2, 0;
  const std::vector<Eigen::MatrixXd> kernels = {K};
  const std::vector<int> folds = {0, 0, 1, 1};
  const Eigen::MatrixXd y = Eigen::Vector4d(1, 2, 3, 4);
  const std::vector<double> both = {100.0, 0.1}, bad = {100.0};
  EXPECT_EQ(select_kernel_ridge(kernels, y, both, folds).front().loss_weight, 0.1);
  EXPECT_THROW((void)select_kernel_ridge(kernels, y, bad, folds), base::Error);
  EXPECT_THROW((void)select_kernel_ridge({}, y, both, folds), base::Error);
}

TEST(SelectLinearRidge, MatchesKernelRidgeWithALinearKernelOnCentredSamples) {
  // With K = X'X kernel ridge is linear ridge through 0; both centre targets by the other folds.
  // Fold means of x are 0 here by symmetry (each fold holds x and -x), so centring x is idle.
  Eigen::MatrixXd x(2, 8);
  x << 1, -1, 2, -2, 0.5, -0.5, 3, -3, 0, 0, 1, -1, 2, -2, 1, -1;
  Eigen::MatrixXd y(8, 1);
  y << 1, 0, 2.5, -1, 1, 1, 4, -2;
  const std::vector<int> folds = {0, 0, 1, 1, 2, 2, 3, 3};
  const std::vector<double> loss_weights = {0.01, 0.1, 1.0};
  const std::vector<Eigen::MatrixXd> kernels = {x.transpose() * x};
  const auto linear = select_linear_ridge(x, y, loss_weights, folds);
  const auto kernel = select_kernel_ridge(kernels, y, loss_weights, folds);
  EXPECT_EQ(linear.front().loss_weight, kernel.front().loss_weight);
  EXPECT_NEAR(linear.front().mean_squared_error, kernel.front().mean_squared_error, 1e-12);
}

TEST(SelectSupportVectorRegression, ReportsTheErrorOfExplicitRefits) {
  const ReferenceSamples data = reference_samples();
  base::Rng rng(2);
  const std::vector<int> folds = assign_folds(24, 5, rng);
  std::vector<SupportVectorKernel> kernels;
  const std::vector<double> widths = {0.3, 0.8};
  for (const double width : widths) {
    kernels.emplace_back(gaussian_kernel(squared_distances(data.x, data.x), width));
  }
  const std::vector<double> loss_weights = {0.5, 5.0}, epsilons = {0.05, 0.3};
  const CrossValidationChoice chosen =
      select_support_vector_regression(kernels, data.y, loss_weights, epsilons, folds);
  double sum = 0.0;
  for (int fold = 0; fold < 5; ++fold) {
    const std::vector<int> held_out = others(folds, fold, true);
    const std::vector<int> rest = others(folds, fold, false);
    const KernelExpansion refit =
        fit_support_vector_regression(data.x(Eigen::all, rest), data.y(rest),
                                      {.width = widths[static_cast<std::size_t>(chosen.kernel)],
                                       .loss_weight = chosen.loss_weight,
                                       .epsilon = chosen.epsilon});
    sum += (data.y(held_out) - refit.predict(data.x(Eigen::all, held_out))).squaredNorm();
  }
  EXPECT_NEAR(chosen.mean_squared_error, sum / 24.0, 1e-9);
}

}  // namespace
}  // namespace laban::learn
