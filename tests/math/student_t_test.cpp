#include "laban/math/student_t.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "laban/base/error.h"

namespace laban::math {
namespace {

// Values of mpmath at 30 digits; 12.706, 2.201 and so on stand in every table.
TEST(StudentT, QuantilesAreThoseOfTheTables) {
  const struct {
    double probability, degrees, t;
  } known[] = {{0.975, 1, 12.706204736174693},   {0.975, 2, 4.3026527297494618},
               {0.975, 4, 2.7764451051977935},   {0.975, 11, 2.2009851600916394},
               {0.975, 499, 1.9647293909876887}, {0.95, 3.5, 2.2224334936496007},
               {0.9999, 2, 70.700071074968172},  {0.6, 7, 0.26316686135202275},
               {0.025, 14, -2.1447866879178038}, {1e-12, 5, -393.95695957760377}};
  for (const auto& [probability, degrees, t] : known) {
    // 1 - 0.9999 is known to 1e-12 only.
    EXPECT_NEAR(student_t_quantile(probability, degrees) / t, 1.0, 2e-12) << probability;
  }
  EXPECT_EQ(student_t_quantile(0.5, 3), 0.0);
  EXPECT_NEAR(student_t_quantile(0.975, 1e7), 1.959964, 1e-5);  // the normal distribution's
}

TEST(StudentT, ProbabilityAndQuantileAreInverses) {
  for (const double degrees : {0.7, 1.0, 3.0, 11.0, 200.0, 99999.0}) {
    for (const double p : {1e-6, 0.01, 0.3, 0.5001, 0.8, 0.975, 0.99999}) {
      EXPECT_NEAR(student_t_probability(student_t_quantile(p, degrees), degrees), p, 1e-10 * p)
          << degrees;
    }
  }
  EXPECT_EQ(student_t_probability(0.0, 4.0), 0.5);
  EXPECT_EQ(student_t_probability(std::numeric_limits<double>::infinity(), 4.0), 1.0);
  EXPECT_EQ(student_t_probability(-std::numeric_limits<double>::infinity(), 4.0), 0.0);
}

TEST(IncompleteBeta, AgreesWithManyDigitsAndItsSymmetry) {
  EXPECT_NEAR(regularized_incomplete_beta(0.3, 2.5, 0.5), 0.018927124071945652, 1e-15);
  EXPECT_NEAR(regularized_incomplete_beta(0.99, 250, 0.5), 0.025054006060311057, 1e-14);
  EXPECT_NEAR(regularized_incomplete_beta(0.25, 0.5, 0.5), 1.0 / 3.0, 1e-15);
  EXPECT_EQ(regularized_incomplete_beta(0.0, 2, 3), 0.0);
  EXPECT_EQ(regularized_incomplete_beta(1.0, 2, 3), 1.0);
  for (const double x : {0.1, 0.4, 0.7, 0.95}) {
    EXPECT_NEAR(
        regularized_incomplete_beta(x, 3.3, 0.9) + regularized_incomplete_beta(1 - x, 0.9, 3.3),
        1.0, 1e-14);
  }
}

TEST(StudentT, NamesWhatItRefuses) {
  EXPECT_THROW((void)student_t_quantile(0.0, 3), base::Error);
  EXPECT_THROW((void)student_t_quantile(1.0, 3), base::Error);
  EXPECT_THROW((void)student_t_quantile(0.9, 0), base::Error);
  EXPECT_THROW((void)student_t_probability(std::nan(""), 3), base::Error);
  EXPECT_THROW((void)regularized_incomplete_beta(1.5, 1, 1), base::Error);
}

}  // namespace
}  // namespace laban::math
