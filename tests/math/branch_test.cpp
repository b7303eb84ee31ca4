#include "laban/math/branch.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "laban/math/rotation.h"

namespace laban::math {
namespace {

constexpr double kPi = std::numbers::pi;

/// A turn about a slowly tilting axis whose angle runs through `from` .. `to`.
Eigen::Matrix3Xd turning_curve(double from, double to, int frames) {
  Eigen::Matrix3Xd curve(3, frames);
  for (int f = 0; f < frames; ++f) {
    const double s = static_cast<double>(f) / (frames - 1);
    const Eigen::Vector3d axis(std::cos(0.3 * s), 0.2, std::sin(0.3 * s));
    curve.col(f) = (from + s * (to - from)) * axis.normalized();
  }
  return curve;
}

TEST(Branch, AShiftKeepsEveryRotationAndContinuity) {
  const Eigen::Matrix3Xd curve = turning_curve(1.0, 4.0, 40);
  for (const int turns : {-2, -1, 1, 2}) {
    const Eigen::Matrix3Xd shifted = shift_branch(curve, turns);
    for (int f = 0; f < 40; ++f) {
      EXPECT_LT(angle_between(exp(curve.col(f)), exp(shifted.col(f))), 1e-12);
      EXPECT_NEAR((shifted.col(f) - curve.col(f)).norm(), std::abs(turns) * 2.0 * kPi, 1e-12);
      if (f > 0) {
        EXPECT_LT((shifted.col(f) - shifted.col(f - 1)).norm(), 0.3);
      }
    }
  }
}

// Through r = 0 about one axis the equivalent r + 2 pi k r / |r| changes the sign of k, which a
// constant k would turn into a jump of 4 pi.
TEST(Branch, AShiftIsContinuousThroughZero) {
  Eigen::Matrix3Xd curve = Eigen::Matrix3Xd::Zero(3, 41);
  for (int f = 0; f < 41; ++f) curve(1, f) = 0.1 * (f - 25);
  const Eigen::Matrix3Xd shifted = shift_branch(curve, 1);
  for (int f = 1; f < 41; ++f) {
    EXPECT_NEAR((shifted.col(f) - shifted.col(f - 1)).norm(), 0.1, 1e-12) << f;
  }
}

TEST(Branch, ShiftingThereAndBackChangesNothing) {
  const Eigen::Matrix3Xd curve = turning_curve(2.0, 3.5, 20);
  EXPECT_LT((shift_branch(shift_branch(curve, 1), -1) - curve).norm(), 1e-12);
  EXPECT_EQ(shift_branch(curve, 0), curve);
}

TEST(Branch, ACurveWithoutAnAxisStays) {
  const Eigen::Matrix3Xd still = Eigen::Matrix3Xd::Zero(3, 4);
  EXPECT_EQ(shift_branch(still, 1), still);
}

TEST(Branch, CarriesAnAnchorBothWays) {
  const Eigen::Matrix3Xd curve = turning_curve(2.0, 3.5, 20);
  const Eigen::Matrix3Xd shifted = shift_branch(curve, -1);
  EXPECT_LT((carry_branch(curve, 7, shifted.col(7)) - shifted).norm(), 1e-12);
}

}  // namespace
}  // namespace laban::math
