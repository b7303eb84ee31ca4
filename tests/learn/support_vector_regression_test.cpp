#include "laban/learn/support_vector_regression.h"

#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

#include "samples.h"

namespace laban::learn {
namespace {

TEST(SupportVectorRegression, MatchesScikitLearn) {
  const ReferenceSamples data = reference_samples();
  const KernelExpansion model = fit_support_vector_regression(
      data.x, data.y, {.width = 0.8, .loss_weight = 3.0, .epsilon = 0.1, .tolerance = 1e-8});
  EXPECT_EQ(model.centers.cols(), 20);
  const Eigen::VectorXd predicted = model.predict(data.queries);
  // reference_values.py; libsvm holds kernel values in single precision.
  EXPECT_NEAR(predicted[0], -0.89573060714885, 1e-5);
  EXPECT_NEAR(predicted[1], -0.764405156281436, 1e-5);
  EXPECT_NEAR(predicted[2], -0.0458664806326834, 1e-5);
  EXPECT_NEAR(predicted[3], 1.57650090015761, 1e-5);
}

// The Karush-Kuhn-Tucker conditions of the epsilon-insensitive problem, with r = y - f:
//   a = 0 -> |r| <= epsilon;  0 < |a| < C -> r = sign(a) epsilon;  |a| = C -> sign(a) r >= epsilon.
TEST(SupportVectorRegression, MeetsTheOptimalityConditions) {
  base::Rng rng(5);
  const double tolerance = 1e-6;
  for (int trial = 0; trial < 20; ++trial) {
    SCOPED_TRACE(trial);
    const int count = 5 + rng.index(40);
    Eigen::MatrixXd x(4, count);
    for (double& value : x.reshaped()) value = rng.normal();
    Eigen::VectorXd y = x.row(0).transpose();
    for (double& value : y) value += 0.5 * rng.normal();
    const double C = std::pow(10.0, rng.uniform(-1.0, 1.5)), epsilon = rng.uniform(0.0, 0.5);

    const Eigen::MatrixXd K = gaussian_kernel(squared_distances(x, x), 2.0);
    std::vector<int> rows(static_cast<std::size_t>(count));
    std::iota(rows.begin(), rows.end(), 0);
    const SupportVectorSolution solution = SupportVectorKernel(K).solve(
        rows, y, {.loss_weight = C, .epsilon = epsilon, .tolerance = tolerance});
    const Eigen::VectorXd& a = solution.coefficients;
    const Eigen::VectorXd r = y - ((K * a).array() - solution.rho).matrix();
    EXPECT_NEAR(a.sum(), 0.0, 1e-9 * C * count);
    // libsvm's kernel is single precision: 6e-8 a term of a sum of up to count * C.
    const double slack = 2.0 * tolerance + 1e-7 * C * count;
    for (int n = 0; n < count; ++n) {
      const double sign = a[n] > 0.0 ? 1.0 : -1.0;
      EXPECT_LE(std::abs(a[n]), C * (1.0 + 1e-12));
      if (a[n] == 0.0) {
        EXPECT_LE(std::abs(r[n]), epsilon + slack);
      } else if (std::abs(a[n]) < C * (1.0 - 1e-9)) {
        EXPECT_NEAR(sign * r[n], epsilon, slack);
      } else {
        EXPECT_GE(sign * r[n], epsilon - slack);
      }
    }
  }
}

TEST(SupportVectorRegression, KernelServesASubsetOfItsSamples) {
  const ReferenceSamples data = reference_samples();
  const SupportVectorOptions options{
      .width = 0.8, .loss_weight = 3.0, .epsilon = 0.05, .tolerance = 1e-8};
  const SupportVectorKernel whole(
      gaussian_kernel(squared_distances(data.x, data.x), options.width));
  const std::vector<int> rows = {20, 3, 4, 9, 17, 11, 0, 23};
  const std::vector<int> at = {1, 22};
  const SupportVectorSolution solution = whole.solve(rows, data.y(rows), options);
  const KernelExpansion refit =
      fit_support_vector_regression(data.x(Eigen::all, rows), data.y(rows), options);
  EXPECT_LT((whole.predict(rows, solution, at) - refit.predict(data.x(Eigen::all, at))).norm(),
            1e-5);
}

TEST(SupportVectorRegression, AWideTubeLeavesNoSupportVectors) {
  const ReferenceSamples data = reference_samples();
  const KernelExpansion model = fit_support_vector_regression(data.x, data.y, {.epsilon = 10.0});
  EXPECT_EQ(model.centers.cols(), 0);
  EXPECT_TRUE(model.predict(data.queries).allFinite());
}

TEST(SupportVectorRegression, PrintsNothing) {
  const ReferenceSamples data = reference_samples();
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  (void)fit_support_vector_regression(data.x, data.y);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(SupportVectorRegression, RefusesBadOptionsAndIndices) {
  const ReferenceSamples data = reference_samples();
  EXPECT_THAT((SupportVectorOptions{.width = 0.0, .epsilon = -1.0}.problems()),
              testing::ElementsAre(testing::HasSubstr("width"), testing::HasSubstr("epsilon")));
  const SupportVectorKernel kernel(Eigen::MatrixXd::Identity(3, 3));
  const std::vector<int> rows = {0, 3};
  EXPECT_THROW((void)kernel.solve(rows, Eigen::Vector2d::Ones(), {}), base::Error);
  EXPECT_THROW((void)kernel.solve({}, Eigen::VectorXd(0), {}), base::Error);
  EXPECT_THROW((void)fit_support_vector_regression(data.x, data.y.head(2)), base::Error);
}

}  // namespace
}  // namespace laban::learn
