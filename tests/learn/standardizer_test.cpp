#include "laban/learn/standardizer.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"

namespace laban::learn {
namespace {

TEST(Standardizer, GivesTrainingFeaturesMeanZeroAndDeviationOne) {
  Eigen::MatrixXd x(2, 4);
  x << 1.0, 3.0, 1.0, 3.0,  //
      0.0, 0.0, 0.0, 4.0;
  const Eigen::MatrixXd z = fit_standardizer(x).apply(x);
  // By hand: means 2 and 1; deviations (divisor 4) 1 and sqrt 3.
  EXPECT_DOUBLE_EQ(z(0, 1), 1.0);
  EXPECT_NEAR(z(1, 3), 3.0 / std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(z.rowwise().mean().norm(), 0.0, 1e-15);
}

TEST(Standardizer, UsesTrainingStatisticsOnNewSamples) {
  Eigen::MatrixXd x(1, 2);
  x << 0.0, 2.0;
  const Eigen::MatrixXd other = Eigen::MatrixXd::Constant(1, 1, 5.0);
  EXPECT_DOUBLE_EQ(fit_standardizer(x).apply(other)(0, 0), 4.0);
}

TEST(Standardizer, IgnoresAFeatureThatTrainingHoldsConstant) {
  // 0.1 summed three times is not 0.3 exactly: the rule must not mistake round-off for variance.
  const Eigen::MatrixXd x = Eigen::MatrixXd::Constant(1, 3, 0.1);
  const Standardizer scale = fit_standardizer(x);
  EXPECT_EQ(scale.inverse_scale[0], 0.0);
  EXPECT_EQ(scale.apply(Eigen::MatrixXd::Constant(1, 1, 1e6))(0, 0), 0.0);
}

TEST(Standardizer, AcceptsOneSample) {
  EXPECT_EQ(fit_standardizer(Eigen::MatrixXd::Ones(3, 1)).inverse_scale.sum(), 0.0);
}

TEST(Standardizer, RefusesEmptyAndNonFiniteSamplesAndOtherRowCounts) {
  EXPECT_THROW((void)fit_standardizer(Eigen::MatrixXd(2, 0)), base::Error);
  Eigen::MatrixXd x = Eigen::MatrixXd::Ones(2, 3);
  const Standardizer scale = fit_standardizer(x);
  EXPECT_THROW((void)scale.apply(Eigen::MatrixXd::Ones(3, 1)), base::Error);
  x(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)fit_standardizer(x), base::Error);
}

}  // namespace
}  // namespace laban::learn
