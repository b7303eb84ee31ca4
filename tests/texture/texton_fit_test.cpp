#include "laban/texture/texton_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "samples.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::HasSubstr;

double log_normal(const VectorXd& x, const MatrixXd& covariance) {
  const double log_two_pi = std::log(2.0 * M_PI);
  return -0.5 * (static_cast<double>(x.size()) * log_two_pi + std::log(covariance.determinant()) +
                 x.dot(covariance.inverse() * x));
}

TEST(TextonFit, FindsTheSubspaceAndNoiseOfAKnownTexton) {
  base::Rng rng(4);
  const Texton truth = test::known_texton(20, 4, rng);
  const MatrixXd y = test::draw_observations(truth, 20000, rng);
  const Segment all{0, 20000, 0};
  const Texton fit = fit_texton(y, {&all, 1}, {.min_dimension = 4, .max_dimension = 4});
  // All of the true basis lies in the one found: cosines of the principal angles.
  const VectorXd cosines = (fit.basis.transpose() * truth.basis).jacobiSvd().singularValues();
  EXPECT_GT(cosines.minCoeff(), 0.999);
  EXPECT_NEAR(fit.residual_variance, truth.residual_variance, 0.02 * truth.residual_variance);
  EXPECT_TRUE((fit.basis.transpose() * fit.basis).isIdentity(1e-12));
}

// Worked by the definition, with determinants and inverses: METHODS' two terms, one frame each.
TEST(TextonLikelihood, IsTheNormalDensityOfStatesAndResiduals) {
  base::Rng rng(5);
  const Texton truth = test::known_texton(6, 2, rng);
  const MatrixXd y = test::draw_observations(truth, 400, rng);
  const Segment all{0, 400, 0};
  const Texton fit = fit_texton(y, {&all, 1}, {.min_dimension = 2, .max_dimension = 2});
  const TextonLikelihood likelihood(fit);
  const MatrixXd centered = y.colwise() - fit.mean;
  const MatrixXd x = fit.basis.transpose() * centered;
  const MatrixXd outside = MatrixXd::Identity(6, 6) - fit.basis * fit.basis.transpose();
  const auto residual = [&](Index t) {
    // The d - m directions outside the basis have variance s^2 each.
    return -0.5 * (4.0 * std::log(2.0 * M_PI * fit.residual_variance) +
                   (outside * centered.col(t)).squaredNorm() / fit.residual_variance);
  };
  const VectorXd step = likelihood.step_terms(y);
  const VectorXd start = likelihood.start_terms(y);
  EXPECT_EQ(step[0], 0.0);
  EXPECT_EQ(step[1], 0.0);
  EXPECT_EQ(start[399], 0.0);
  for (const Index t : {Index{2}, Index{77}, Index{398}}) {
    const VectorXd innovation = x.col(t) - fit.dynamics.a1 * x.col(t - 1) -
                                fit.dynamics.a2 * x.col(t - 2) - fit.dynamics.offset;
    EXPECT_NEAR(step[t], log_normal(innovation, fit.dynamics.covariance) + residual(t), 1e-8);
    VectorXd pair(4);
    pair << x.col(t), x.col(t + 1);
    EXPECT_NEAR(
        start[t],
        log_normal(pair - fit.start_mean, fit.start_covariance) + residual(t) + residual(t + 1),
        1e-7);
  }
  EXPECT_NEAR(likelihood.segment(y.middleCols(50, 30)),
              likelihood.start_terms(y.middleCols(50, 30))[0] + step.segment(52, 28).sum(), 1e-8);
}

TEST(TextonFit, TakesAsManyStatesAsTheVarianceNeedsAndTheFramesAllow) {
  base::Rng rng(6);
  const MatrixXd y = test::draw_observations(test::known_texton(20, 4, rng), 400, rng);
  const auto states = [&](int frames, const TextonFit& options) {
    const Segment part{0, frames, 0};
    return fit_texton(y, {&part, 1}, options).dimension();
  };
  EXPECT_EQ(states(400, {.min_dimension = 1, .max_dimension = 15, .explained_share = 1e-9}), 1);
  EXPECT_EQ(states(400, {.min_dimension = 1, .max_dimension = 15, .explained_share = 1.0}), 15);
  EXPECT_EQ(states(400, {.min_dimension = 12, .max_dimension = 15, .explained_share = 0.5}), 12);
  EXPECT_EQ(states(40, {}), 10);  // four frames a state
  EXPECT_EQ(states(3, {}), 1);
}

TEST(TextonFit, AStillTextonHasTheFloorForVariance) {
  const MatrixXd y = MatrixXd::Constant(8, 60, 0.3);
  const Segment all{0, 60, 0};
  const Texton fit = fit_texton(y, {&all, 1}, {.variance_floor = 1e-4});
  EXPECT_EQ(fit.residual_variance, 1e-4);
  EXPECT_TRUE(std::isfinite(TextonLikelihood(fit).segment(y)));
}

TEST(TextonFit, OneStepPredictionsErrByTheInnovationAndTheResidual) {
  base::Rng rng(8);
  const Texton truth = test::known_texton(20, 4, rng);
  const MatrixXd y = test::draw_observations(truth, 2000, rng);
  const MatrixXd errors = y - one_step_predictions(truth, y);
  EXPECT_EQ(errors.leftCols(2).norm(), 0.0);
  // A sum of 2000 squares scatters by a few per cent.
  const double expected = truth.dynamics.covariance.trace() + 16.0 * truth.residual_variance;
  EXPECT_NEAR(errors.rightCols(1998).squaredNorm() / 1998.0, expected, 0.05 * expected);
}

TEST(TextonFit, RefusesWhatItCannotFit) {
  const MatrixXd y = MatrixXd::Ones(4, 10);
  const auto message = [&](const Segment& segment, const TextonFit& options) -> std::string {
    try {
      (void)fit_texton(y, {&segment, 1}, options);
    } catch (const base::Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(message({0, 2, 0}, {}), HasSubstr("frames [0, 2) are fewer than three"));
  EXPECT_THAT(message({5, 6, 0}, {}), HasSubstr("not among the 10"));
  EXPECT_THAT(message({0, 10, 0}, {.min_dimension = 0}), HasSubstr("min_dimension must be >= 1"));
  EXPECT_THAT(message({0, 10, 0}, {.variance_floor = 0.0}), HasSubstr("variance_floor"));
  EXPECT_THROW((void)fit_texton(y, {}, {}), base::Error);
}

}  // namespace
}  // namespace laban::texture
