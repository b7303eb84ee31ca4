#include "laban/manifold/map_spline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"

namespace laban::manifold {
namespace {

using Eigen::Matrix2Xd;
using Eigen::Vector2d;

Matrix2Xd some_points() {
  Matrix2Xd points(2, 5);
  points << 10.0, 40.0, 20.0, 20.0, 60.0, 12.0, 31.0, 55.0, 54.0, 0.0;
  return points;
}

TEST(MapSpline, PassesItsPointsAtItsKnots) {
  const MapSpline spline(some_points());
  ASSERT_EQ(spline.knots().size(), 5);
  for (int k = 0; k < 5; ++k) {
    EXPECT_LT((spline.at(spline.knots()[k]) - some_points().col(k)).norm(), 1e-12);
  }
  EXPECT_EQ(spline.at(-1.0), some_points().col(0));
  EXPECT_EQ(spline.at(1e9), some_points().col(4));
}

// Across a knot neither value, slope nor curvature jumps, and at the ends there is no curvature.
TEST(MapSpline, IsTwiceContinuouslyDifferentiableAndNatural) {
  const MapSpline spline(some_points());
  constexpr double kStep = 1e-3;
  const auto second = [&](double u) -> Vector2d {
    return (spline.at(u - kStep) - 2.0 * spline.at(u) + spline.at(u + kStep)) / (kStep * kStep);
  };
  for (int k = 1; k < 4; ++k) {
    const double u = spline.knots()[k];
    // Third derivatives times two steps are all that may differ.
    EXPECT_LT((second(u - 2.0 * kStep) - second(u + 2.0 * kStep)).norm(),
              1e-2 * (1.0 + second(u).norm()));
    const Vector2d before = (spline.at(u) - spline.at(u - kStep)) / kStep;
    const Vector2d after = (spline.at(u + kStep) - spline.at(u)) / kStep;
    EXPECT_LT((after - before).norm(), 2.0 * kStep * (1.0 + second(u).norm()));
  }
  EXPECT_LT(second(2.0 * kStep).norm(), 0.1);
}

TEST(MapSpline, TwoPointsAreALineAndRepeatsArePassedOnce) {
  Matrix2Xd points(2, 4);
  points << 0.0, 0.0, 4.0, 4.0, 1.0, 1.0, 1.0, 1.0;
  const MapSpline spline(points);
  EXPECT_EQ(spline.knots().size(), 2);
  EXPECT_DOUBLE_EQ(spline.length(), 2.0);  // the root of the distance
  EXPECT_LT((spline.at(1.0) - Vector2d(2.0, 1.0)).norm(), 1e-12);
  const MapSpline still(points.leftCols(2));
  EXPECT_EQ(still.length(), 0.0);
  EXPECT_EQ(still.at(3.0), Vector2d(0.0, 1.0));
  EXPECT_THROW((void)MapSpline(Matrix2Xd(2, 0)), base::Error);
  EXPECT_THROW((void)MapSpline(Matrix2Xd::Constant(2, 1, std::nan(""))), base::Error);
}

}  // namespace
}  // namespace laban::manifold
