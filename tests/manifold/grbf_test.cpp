#include "laban/manifold/grbf.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

namespace laban::manifold {
namespace {

using Eigen::Matrix2Xd;
using Eigen::MatrixXd;
using Eigen::Vector2d;

const Region kPlane{Vector2d(0.0, 0.0), Vector2d(64.0, 32.0)};

Matrix2Xd random_points(int count, unsigned seed) {
  base::Rng rng(seed);
  Matrix2Xd x(2, count);
  for (int n = 0; n < count; ++n) x.col(n) << rng.uniform(0.0, 64.0), rng.uniform(0.0, 32.0);
  return x;
}

MatrixXd wave(const Matrix2Xd& x) {
  MatrixXd y(2, x.cols());
  y.row(0) = (x.row(0).array() * 0.1).sin() * (x.row(1).array() * 0.15).cos();
  y.row(1) = 0.5 * x.row(0) - 0.25 * x.row(1);
  return y;
}

class BothBases : public ::testing::TestWithParam<RadialBasis> {};
INSTANTIATE_TEST_SUITE_P(Grbf, BothBases,
                         ::testing::Values(RadialBasis::kThinPlate, RadialBasis::kGaussian));

TEST_P(BothBases, FollowsASmoothMapBetweenItsSamples) {
  GrbfOptions options;
  options.basis = GetParam();
  const Matrix2Xd x = random_points(800, 1);
  const Grbf grbf = fit_grbf(x, wave(x), kPlane, options);
  const Matrix2Xd between = random_points(200, 2);
  // The wave has amplitude 1; its shortest period is 42 of 64 units, centres are 4.6 apart.
  EXPECT_LT((grbf.at_all(between) - wave(between)).row(0).cwiseAbs().maxCoeff(), 0.02);
}

TEST_P(BothBases, AnAffineMapIsItsAffinePart) {
  GrbfOptions options;
  options.basis = GetParam();
  const Matrix2Xd x = random_points(300, 3);
  MatrixXd y(3, x.cols());
  y.row(0) = 2.0 * x.row(0) + x.row(1);
  y.row(1) = x.row(1).array() - 5.0;
  y.row(2) = -x.row(0);
  const Grbf grbf = fit_grbf(x, y, kPlane, options);
  EXPECT_LT(grbf.coefficients().leftCols(15 * 15).cwiseAbs().maxCoeff(), 1e-4);
  const Vector2d point(13.0, 27.0);
  EXPECT_LT((grbf.affine_inverse(grbf.at(point)) - point).norm(), 1e-3);
  // Beyond the plane the inverse stays at its edge.
  EXPECT_LT((grbf.affine_inverse(grbf.at(Vector2d(-40.0, 16.0))) - Vector2d(0.0, 16.0)).norm(),
            1e-2);
}

TEST_P(BothBases, RadialWeightsKeepTheSideCondition) {
  GrbfOptions options;
  options.basis = GetParam();
  options.centers_a_side = 5;
  const Matrix2Xd x = random_points(100, 4);
  const Grbf grbf = fit_grbf(x, wave(x), kPlane, options);
  const MatrixXd w = grbf.coefficients().leftCols(25);
  for (int row = 0; row < w.rows(); ++row) {
    double sum = 0.0, along = 0.0, across = 0.0;
    for (int c = 0; c < 25; ++c) {
      sum += w(row, c);
      along += w(row, c) * (c % 5);
      across += w(row, c) * (c / 5);
    }
    const double scale = w.row(row).cwiseAbs().maxCoeff();
    EXPECT_LT(std::abs(sum), 1e-9 * scale);
    EXPECT_LT(std::abs(along), 1e-9 * scale);
    EXPECT_LT(std::abs(across), 1e-9 * scale);
  }
}

// Oracle: psi written out for two by two centres, which the side condition leaves one degree.
TEST(Grbf, ValuesAreTheSumOfItsTerms) {
  GrbfOptions options;
  options.centers_a_side = 2;
  MatrixXd B(1, 7);
  B << 1.0, -2.0, 3.0, 0.5, 4.0, 5.0, 6.0;
  const Grbf grbf(options, {Vector2d(-1.0, -1.0), Vector2d(1.0, 1.0)}, B);
  const Vector2d p(0.25, -0.5);
  double expected = 4.0 + 5.0 * p.x() + 6.0 * p.y();
  const Vector2d centers[] = {{-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
  for (int c = 0; c < 4; ++c) {
    const double u = (p - centers[c]).norm();
    expected += B(0, c) * u * u * std::log(u);
  }
  EXPECT_NEAR(grbf.at(p)[0], expected, 1e-12);
  // u^2 log u is 0 at a centre.
  EXPECT_TRUE(std::isfinite(grbf.at(Vector2d(1.0, 1.0))[0]));
}

TEST(Grbf, AShortWalkIsSolvedByTheRidge) {
  // Three samples on a line for 228 terms.
  Matrix2Xd x(2, 3);
  x << 0.0, 32.0, 64.0, 16.0, 16.0, 16.0;
  MatrixXd y(1, 3);
  y << 1.0, 3.0, 2.0;
  const Grbf grbf = fit_grbf(x, y, kPlane, {});
  EXPECT_LT((grbf.at_all(x) - y).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(Grbf, RefusesWhatItCannotFit) {
  const Matrix2Xd x = random_points(5, 5);
  EXPECT_THROW((void)fit_grbf(x, MatrixXd::Zero(1, 4), kPlane), base::Error);
  EXPECT_THROW((void)fit_grbf(Matrix2Xd(2, 0), MatrixXd(1, 0), kPlane), base::Error);
  EXPECT_THROW((void)fit_grbf(x, wave(x), {Vector2d(0, 0), Vector2d(0, 1)}), base::Error);
  EXPECT_THROW((void)fit_grbf(x, wave(x), kPlane, {.centers_a_side = 1}), base::Error);
  EXPECT_THROW((void)Grbf({}, kPlane, MatrixXd::Zero(1, 3)), base::Error);
  const Grbf grbf = fit_grbf(x, wave(x), kPlane);
  EXPECT_THROW((void)grbf.affine_inverse(Eigen::VectorXd::Zero(3)), base::Error);
}

}  // namespace
}  // namespace laban::manifold
