#include "laban/math/cubic_interpolation.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

namespace laban::math {
namespace {

Eigen::MatrixXd random_columns(int rows, int cols, std::uint64_t seed) {
  base::Rng rng(seed);
  Eigen::MatrixXd columns(rows, cols);
  for (double& value : columns.reshaped()) value = rng.normal();
  return columns;
}

TEST(CubicInterpolation, IsExactAtWholeFrames) {
  for (int cols = 1; cols <= 7; ++cols) {
    const Eigen::MatrixXd columns = random_columns(3, cols, 1);
    for (int f = 0; f < cols; ++f) {
      EXPECT_EQ(interpolate(columns, f), columns.col(f)) << f << " of " << cols;
    }
  }
}

TEST(CubicInterpolation, ReproducesAParabolaUpToTheEnds) {
  const auto parabola = [](double t) { return 0.3 * t * t - 2.0 * t + 1.0; };
  for (int cols = 3; cols <= 6; ++cols) {
    Eigen::RowVectorXd columns(cols);
    for (int f = 0; f < cols; ++f) columns(f) = parabola(f);
    for (double t = 0.0; t <= cols - 1; t += 0.05) {
      EXPECT_NEAR(interpolate(columns, t)(0), parabola(t), 1e-13) << t << " of " << cols;
    }
  }
}

TEST(CubicInterpolation, TwoFramesAreJoinedByALine) {
  const Eigen::RowVector2d columns(1.0, 3.0);
  EXPECT_NEAR(interpolate(columns, 0.25)(0), 1.5, 1e-15);
}

TEST(CubicInterpolation, ClampsToTheEnds) {
  const Eigen::MatrixXd columns = random_columns(2, 5, 2);
  EXPECT_EQ(interpolate(columns, -3.0), columns.col(0));
  EXPECT_EQ(interpolate(columns, 17.0), columns.col(4));
}

TEST(CubicInterpolation, HasAContinuousDerivativeAtWholeFrames) {
  const Eigen::MatrixXd columns = random_columns(4, 8, 3);
  constexpr double h = 1e-6;
  for (int f = 1; f < 7; ++f) {
    const Eigen::VectorXd here = interpolate(columns, f);
    const Eigen::VectorXd before = (here - interpolate(columns, f - h)) / h;
    const Eigen::VectorXd after = (interpolate(columns, f + h) - here) / h;
    EXPECT_LT((after - before).norm(), 1e-4) << f;  // curvature of O(10) times h
  }
}

TEST(CubicInterpolation, BackwardsIsTheSameCurve) {
  const Eigen::MatrixXd columns = random_columns(2, 6, 4);
  const Eigen::MatrixXd reversed = columns.rowwise().reverse();
  for (double t = 0.0; t <= 5.0; t += 0.1) {
    EXPECT_LT((interpolate(columns, t) - interpolate(reversed, 5.0 - t)).norm(), 1e-13) << t;
  }
}

TEST(CubicInterpolation, ManyFramesAreOneByOne) {
  const Eigen::MatrixXd columns = random_columns(3, 6, 5);
  const std::vector<double> frames = {4.7, 0.0, 2.2, 9.0};
  const Eigen::MatrixXd values = interpolate(columns, frames);
  ASSERT_EQ(values.cols(), 4);
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(values.col(k), interpolate(columns, frames[static_cast<std::size_t>(k)]));
  }
}

TEST(CubicInterpolation, RefusesNoFramesAndNoNumber) {
  EXPECT_THROW((void)interpolate(Eigen::MatrixXd(3, 0), 0.0), base::Error);
  EXPECT_THROW(
      (void)interpolate(Eigen::MatrixXd::Zero(3, 2), std::numeric_limits<double>::quiet_NaN()),
      base::Error);
}

}  // namespace
}  // namespace laban::math
