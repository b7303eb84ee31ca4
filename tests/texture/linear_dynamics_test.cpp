#include "laban/texture/linear_dynamics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "samples.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::draw_states;
using test::normal_matrix;
using test::swinging;

struct Errors {
  double dynamics = 0.0;
  double covariance = 0.0;
};

Errors errors(const LinearDynamics& truth, int frames, std::uint64_t seed) {
  base::Rng rng(seed);
  const std::vector<MatrixXd> segments = {draw_states(truth, frames, rng)};
  const LinearDynamics fit = fit_dynamics(segments);
  return {std::max({(fit.a1 - truth.a1).cwiseAbs().maxCoeff(),
                    (fit.a2 - truth.a2).cwiseAbs().maxCoeff(),
                    (fit.offset - truth.offset).cwiseAbs().maxCoeff()}),
          (fit.covariance - truth.covariance).cwiseAbs().maxCoeff() /
              truth.covariance.cwiseAbs().maxCoeff()};
}

// The errors of a least-squares fit fall with the root of the number of rows: 100 times the data, a
// tenth of the error. Half of that is asked for, as single draws scatter.
TEST(LinearDynamics, RecoversAKnownSystemAsTheDataGrow) {
  base::Rng rng(3);
  const LinearDynamics truth = swinging(4, 0.1, rng);
  const Errors few = errors(truth, 1000, 4);
  const Errors many = errors(truth, 100000, 5);
  EXPECT_LT(many.dynamics, 0.02);
  EXPECT_LT(many.covariance, 0.02);
  EXPECT_LT(many.dynamics, few.dynamics / 5.0);
  EXPECT_LT(many.covariance, few.covariance / 2.0);
}

// Oracle: rows stacked by hand, ordinary least squares with a column of ones.
TEST(LinearDynamics, AFitOverSeveralSegmentsIsThatOfTheirStackedRows) {
  base::Rng rng(7);
  const Index m = 3;
  const LinearDynamics truth = swinging(static_cast<int>(m), 0.2, rng);
  std::vector<MatrixXd> segments;
  for (const int frames : {40, 3, 17, 90}) segments.push_back(draw_states(truth, frames, rng));
  MatrixXd rows(2 * m + 1, 0);
  MatrixXd targets(m, 0);
  for (const MatrixXd& x : segments) {
    for (Index t = 2; t < x.cols(); ++t) {
      rows.conservativeResize(Eigen::NoChange, rows.cols() + 1);
      targets.conservativeResize(Eigen::NoChange, targets.cols() + 1);
      rows.rightCols(1) << x.col(t - 1), x.col(t - 2), 1.0;
      targets.rightCols(1) = x.col(t);
    }
  }
  const MatrixXd solved =
      rows.transpose().colPivHouseholderQr().solve(targets.transpose()).transpose();
  const MatrixXd left = targets - solved * rows;
  const LinearDynamics fit = fit_dynamics(segments);
  EXPECT_TRUE(fit.a1.isApprox(solved.leftCols(m), 1e-9));
  EXPECT_TRUE(fit.a2.isApprox(solved.middleCols(m, m), 1e-9));
  EXPECT_TRUE(fit.offset.isApprox(solved.rightCols(1), 1e-7));
  EXPECT_TRUE(
      fit.covariance.isApprox(left * left.transpose() / static_cast<double>(targets.cols()), 1e-9));
}

TEST(LinearDynamics, AStrongRidgeGoesOnAtConstantVelocity) {
  base::Rng rng(9);
  const std::vector<MatrixXd> segments = {draw_states(swinging(2, 0.1, rng), 200, rng)};
  const LinearDynamics fit = fit_dynamics(segments, {.ridge = 1e9});
  EXPECT_TRUE(fit.a1.isApprox(2.0 * MatrixXd::Identity(2, 2), 1e-6));
  EXPECT_TRUE(fit.a2.isApprox(-MatrixXd::Identity(2, 2), 1e-6));
}

// Thirty regressors of two rows: the fit is not unique, the covariance has rank 0 without a floor.
TEST(LinearDynamics, FewerRowsThanRegressorsStillGiveAFloor) {
  base::Rng rng(11);
  const std::vector<MatrixXd> segments = {normal_matrix(15, 4, rng)};
  const LinearDynamics fit = fit_dynamics(segments, {.ridge = 1e-3, .variance_floor = 0.01});
  EXPECT_TRUE(fit.a1.allFinite());
  EXPECT_GE(Eigen::SelfAdjointEigenSolver<MatrixXd>(fit.covariance).eigenvalues().minCoeff(),
            0.01 - 1e-12);
}

TEST(LinearDynamics, StillStatesStayWhereTheyAre) {
  const std::vector<MatrixXd> segments = {MatrixXd::Constant(2, 30, 0.7)};
  const LinearDynamics fit = fit_dynamics(segments, {.variance_floor = 1e-6});
  const VectorXd x = VectorXd::Constant(2, 0.7);
  EXPECT_TRUE((fit.a1 * x + fit.a2 * x + fit.offset).isApprox(x, 1e-9));
}

TEST(LinearDynamics, RefusesSegmentsThatDoNotFit) {
  const auto message = [](std::vector<MatrixXd> segments) -> std::string {
    try {
      (void)fit_dynamics(segments);
    } catch (const base::Error& error) {
      EXPECT_EQ(error.kind(), base::ErrorKind::kData);
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message({}), ::testing::HasSubstr("no segment"));
  EXPECT_THAT(message({MatrixXd::Ones(2, 5), MatrixXd::Ones(2, 2)}),
              ::testing::HasSubstr("segment 1 has 2 frames"));
  EXPECT_THAT(message({MatrixXd::Ones(2, 5), MatrixXd::Ones(3, 5)}),
              ::testing::HasSubstr("segment 1 has 3 rows"));
  EXPECT_THAT(message({MatrixXd::Constant(2, 5, std::nan(""))}),
              ::testing::HasSubstr("not finite"));
}

}  // namespace
}  // namespace laban::texture
