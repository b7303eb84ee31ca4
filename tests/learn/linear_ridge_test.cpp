#include "laban/learn/linear_ridge.h"

#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

#include "samples.h"

namespace laban::learn {
namespace {

TEST(LinearRidge, MatchesScikitLearn) {
  const ReferenceSamples data = reference_samples();
  const LinearRidge model = fit_linear_ridge(data.x, data.y, {.loss_weight = 4.0});
  // reference_values.py; 15 printed digits of numbers of order 1.
  EXPECT_NEAR(model.weights[0], 1.17128050797673, 1e-12);
  EXPECT_NEAR(model.weights[1], 0.216800167146451, 1e-12);
  EXPECT_NEAR(model.weights[2], 0.362492247808249, 1e-12);
  EXPECT_NEAR(model.intercept, -0.106452484647661, 1e-12);
}

TEST(LinearRidge, GradientOfTheObjectiveIsZero) {
  // E(w, b) = U sum (w'x + b - y)^2 + |w|^2; its derivatives by w and b vanish at the minimum.
  const ReferenceSamples data = reference_samples();
  for (const double U : {1e-3, 1.0, 1e4}) {
    SCOPED_TRACE(U);
    const LinearRidge model = fit_linear_ridge(data.x, data.y, {.loss_weight = U});
    const Eigen::VectorXd residual = model.predict(data.x) - data.y;
    EXPECT_NEAR((U * data.x * residual + model.weights).norm(), 0.0, 1e-9 * U + 1e-12);
    EXPECT_NEAR(residual.sum(), 0.0, 1e-12);
  }
}

TEST(LinearRidge, FindsAnExactLineAsTheLossOutweighsTheRidge) {
  base::Rng rng(3);
  Eigen::MatrixXd x(2, 10);
  for (double& value : x.reshaped()) value = rng.normal();
  const Eigen::VectorXd y = (2.0 * x.row(0) - 3.0 * x.row(1)).transpose().array() + 7.0;
  const LinearRidge model = fit_linear_ridge(x, y, {.loss_weight = 1e10});
  EXPECT_NEAR(model.weights[0], 2.0, 1e-8);
  EXPECT_NEAR(model.weights[1], -3.0, 1e-8);
  EXPECT_NEAR(model.intercept, 7.0, 1e-8);
}

TEST(LinearRidge, PredictsTheMeanFromOneSampleAndFromConstantFeatures) {
  const LinearRidge one = fit_linear_ridge(Eigen::MatrixXd::Ones(3, 1), Eigen::VectorXd::Ones(1));
  EXPECT_DOUBLE_EQ(one.predict(Eigen::MatrixXd::Zero(3, 1))[0], 1.0);
  const Eigen::Vector2d y(1.0, 3.0);
  const LinearRidge flat = fit_linear_ridge(Eigen::MatrixXd::Ones(2, 2), y);
  EXPECT_DOUBLE_EQ(flat.predict(Eigen::MatrixXd::Constant(2, 1, 9.0))[0], 2.0);
}

TEST(LinearRidge, AWeightOfKIsTheSampleGivenKTimes) {
  const ReferenceSamples data = reference_samples();
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(24);
  weights[3] = 2.0;
  weights[10] = 3.0;
  std::vector<int> columns(24);
  std::iota(columns.begin(), columns.end(), 0);
  columns.insert(columns.end(), {3, 10, 10});
  const LinearRidge weighted = fit_linear_ridge(data.x, data.y, {.loss_weight = 4.0}, weights);
  const LinearRidge repeated =
      fit_linear_ridge(data.x(Eigen::all, columns), data.y(columns), {.loss_weight = 4.0});
  EXPECT_LT((weighted.weights - repeated.weights).norm(), 1e-12);
  EXPECT_NEAR(weighted.intercept, repeated.intercept, 1e-12);
  const LinearRidge unweighted = fit_linear_ridge(data.x, data.y, {.loss_weight = 4.0});
  EXPECT_GT((weighted.weights - unweighted.weights).norm(), 1e-3);
}

TEST(LinearRidge, NamesTheOptionAndTheSizesItRefuses) {
  const Eigen::MatrixXd x = Eigen::MatrixXd::Ones(2, 3);
  const auto message = [&](double loss_weight, int targets) {
    try {
      (void)fit_linear_ridge(x, Eigen::VectorXd::Ones(targets), {.loss_weight = loss_weight});
    } catch (const base::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(message(0.0, 3), testing::HasSubstr("LinearRidgeOptions::loss_weight = 0"));
  EXPECT_THAT(message(1.0, 2), testing::HasSubstr("2 targets for 3 samples"));
}

}  // namespace
}  // namespace laban::learn
