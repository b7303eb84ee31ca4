#include "laban/math/f_distribution.h"

#include <gtest/gtest.h>

#include "laban/base/error.h"

namespace laban::math {
namespace {

// scipy.special.betainc (1.10.1).
TEST(IncompleteBeta, AgreesWithScipy) {
  EXPECT_NEAR(incomplete_beta(0.5, 0.5, 0.3), 0.3690101195655454, 1e-14);
  EXPECT_NEAR(incomplete_beta(50, 80, 0.4), 0.6450659221505501, 1e-13);
  EXPECT_NEAR(incomplete_beta(500, 3, 0.99), 0.12171819836071869, 1e-12);
  EXPECT_NEAR(incomplete_beta(1e-3, 2, 0.5), 0.9998067465369479, 1e-14);
  EXPECT_NEAR(incomplete_beta(3, 1e5, 1e-5), 0.08030415619324675, 1e-10);
  EXPECT_NEAR(incomplete_beta(0.5, 1e4, 0.001), 0.9999922941884307, 1e-11);
}

TEST(IncompleteBeta, HasItsClosedForms) {
  for (const double x : {0.0, 1e-9, 0.1, 0.5, 0.9, 1.0}) {
    SCOPED_TRACE(x);
    EXPECT_NEAR(incomplete_beta(1, 1, x), x, 1e-15);
    EXPECT_NEAR(incomplete_beta(3, 1, x), x * x * x, 1e-15);
    // I_x(2, 3) = sum of binomial terms: 6 x^2 - 8 x^3 + 3 x^4.
    EXPECT_NEAR(incomplete_beta(2, 3, x), x * x * (6 - 8 * x + 3 * x * x), 1e-14);
    EXPECT_NEAR(incomplete_beta(2.5, 7.5, x), 1.0 - incomplete_beta(7.5, 2.5, 1.0 - x), 1e-14);
  }
}

TEST(FDistribution, QuantilesAreThoseOfTheTables) {
  // Printed tables of F: upper 2.5 % and 5 % points.
  EXPECT_NEAR(f_quantile(0.975, 5, 15), 3.58, 0.005);
  EXPECT_NEAR(f_quantile(0.975, 1, 1), 647.79, 0.005);
  EXPECT_NEAR(f_quantile(0.95, 10, 10), 2.98, 0.005);
  // scipy.stats.f.ppf (1.10.1).
  EXPECT_NEAR(f_quantile(0.975, 5, 15), 3.5764153492790607, 1e-11);
  EXPECT_NEAR(f_quantile(0.025, 5, 15), 0.15557596307848715, 1e-13);
  EXPECT_NEAR(f_quantile(0.95, 4, 19.27), 2.8869404397553295, 1e-11);
  EXPECT_NEAR(f_quantile(0.975, 0.7, 250.5), 5.97418073467743, 1e-10);
  EXPECT_NEAR(f_quantile(0.975, 164, 492), 1.2746406091290647, 1e-11);
  EXPECT_NEAR(f_quantile(0.999, 3, 1e6), 5.422120119287655, 1e-6);
}

TEST(FDistribution, QuantileUndoesTheDistribution) {
  for (const double p : {1e-6, 0.025, 0.5, 0.975, 1 - 1e-6}) {
    for (const double d1 : {0.5, 1.0, 4.8, 60.0}) {
      SCOPED_TRACE(testing::Message() << p << " " << d1);
      EXPECT_NEAR(f_distribution(f_quantile(p, d1, 12.0), d1, 12.0), p, 1e-12);
      // 1 / F(d2, d1) is F(d1, d2).
      EXPECT_NEAR(f_quantile(p, d1, 12.0) * f_quantile(1 - p, 12.0, d1), 1.0, 1e-8);
    }
  }
  EXPECT_EQ(f_distribution(0.0, 3, 4), 0.0);
  EXPECT_EQ(f_distribution(1e308, 3, 4), 1.0);
}

TEST(FDistribution, RefusesWhatHasNoMeaning) {
  EXPECT_THROW((void)f_quantile(1.0, 3, 4), base::Error);
  EXPECT_THROW((void)f_quantile(0.5, 0, 4), base::Error);
  EXPECT_THROW((void)f_distribution(-1.0, 3, 4), base::Error);
  EXPECT_THROW((void)incomplete_beta(1, 1, 1.5), base::Error);
  EXPECT_THROW((void)incomplete_beta(-1, 1, 0.5), base::Error);
}

}  // namespace
}  // namespace laban::math
