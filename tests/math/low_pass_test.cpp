#include "laban/math/low_pass.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "laban/base/error.h"

namespace laban::math {
namespace {

Eigen::MatrixXd two_rows(int frames) {
  Eigen::MatrixXd x(2, frames);
  for (int n = 0; n < frames; ++n) {
    x(0, n) = std::sin(0.3 * n) + 0.2 * std::cos(2.1 * n) + 0.05 * n;
    x(1, n) = (n % 7) * 0.5 - (n % 3);
  }
  return x;
}

Eigen::MatrixXd sine(int frames, double rate, double hz) {
  Eigen::MatrixXd x(1, frames);
  for (int n = 0; n < frames; ++n) x(0, n) = std::sin(2.0 * std::numbers::pi * hz * n / rate);
  return x;
}

// Oracle: scipy 1.10, b, a = butter(2, fc / (rate / 2)); filtfilt(b, a, x, padtype='odd',
// padlen=min(ceil(3 * rate / fc), F - 1)) on two_rows(40), columns 0, 1, 13, 38, 39.
TEST(LowPass, AgreesWithScipyFiltfilt) {
  const auto expect_columns = [](double rate, const Eigen::Matrix<double, 2, 5>& expected) {
    SCOPED_TRACE(rate);
    const Eigen::MatrixXd y = low_pass(two_rows(40), rate, 6.0);
    ASSERT_EQ(y.cols(), 40);
    const int columns[] = {0, 1, 13, 38, 39};
    for (int k = 0; k < 5; ++k) {
      EXPECT_NEAR(y(0, columns[k]), expected(0, k), 1e-12);
      EXPECT_NEAR(y(1, columns[k]), expected(1, k), 1e-12);
    }
  };
  Eigen::Matrix<double, 2, 5> expected;
  expected << 0.20000010621933204, 0.36432282216227524, -0.03977433857346264, 1.015350376980534,
      1.3832570190916778, 1.128946822970267e-07, -0.4089939524271287, 0.9701264433024994,
      0.48481051821291765, 1.9999997309251656;
  expect_columns(30.0, expected);
  expected << 0.19998281534594076, 0.3673763625871359, 0.2621588967272851, 1.34800520402881,
      1.3833644447178768, -0.00011630089725752496, 0.11073448019097859, 0.5378371910409815,
      1.6456647023939788, 2.000069972303758;
  expect_columns(120.0, expected);
}

TEST(LowPass, HalvesTheCutoffWhateverTheRate) {
  for (const double rate : {30.0, 60.0, 120.0, 240.0}) {
    SCOPED_TRACE(rate);
    const auto frames = static_cast<int>(4.0 * rate);
    const Eigen::MatrixXd x = sine(frames, rate, 6.0);
    const Eigen::MatrixXd y = low_pass(x, rate, 6.0);
    // Away from the ends, and with no delay: the prewarped cutoff is exact at any rate.
    EXPECT_NEAR((y - 0.5 * x).middleCols(frames / 4, frames / 2).cwiseAbs().maxCoeff(), 0.0, 1e-4);
  }
}

TEST(LowPass, KeepsConstantsAndStraightLines) {
  Eigen::MatrixXd x(2, 50);
  x.row(0).setConstant(3.7);
  x.row(1).setLinSpaced(50, -1.0, 4.0);
  // The line's own steady state differs from the first value's: a start-up of about e^-13 is left.
  EXPECT_LT((low_pass(x, 60.0, 6.0) - x).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((low_pass(x, 60.0, 6.0) - x).row(0).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(LowPass, IsLinearAndTheSameBackwards) {
  const Eigen::MatrixXd x = two_rows(61);
  const Eigen::MatrixXd y = low_pass(x, 60.0, 4.0);
  const Eigen::MatrixXd backwards = low_pass(x.rowwise().reverse(), 60.0, 4.0);
  // Forward-backward and backward-forward differ only by their start-up at the padding's far ends.
  EXPECT_LT((backwards.rowwise().reverse() - y).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((low_pass(-2.5 * x, 60.0, 4.0) + 2.5 * y).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(LowPass, LeavesWhatCannotBeFiltered) {
  const Eigen::MatrixXd x = two_rows(20);
  EXPECT_EQ(low_pass(x, 10.0, 6.0), x);   // 6 Hz is past the Nyquist frequency
  EXPECT_EQ(low_pass(x, 10.0, 4.5), x);   // the documented bound
  EXPECT_NE(low_pass(x, 10.0, 4.49), x);  // and just below it
  EXPECT_EQ(low_pass(x.leftCols(1), 60.0, 6.0), x.leftCols(1));
  EXPECT_EQ(low_pass(x.leftCols(0), 60.0, 6.0).cols(), 0);
  for (int frames = 2; frames < 8; ++frames) {
    EXPECT_TRUE(low_pass(x.leftCols(frames), 120.0, 6.0).allFinite()) << frames;
  }
  EXPECT_TRUE(low_pass(x, 120.0, 1e-12).allFinite());
}

TEST(LowPass, RefusesRatesThatAreNone) {
  const Eigen::MatrixXd x = two_rows(5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW((void)low_pass(x, bad, 6.0), base::Error);
    EXPECT_THROW((void)low_pass(x, 60.0, bad), base::Error);
  }
  try {
    (void)low_pass(x, 60.0, -1.0);
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kUsage);
    EXPECT_STREQ(error.what(), "low_pass: cutoff = -1.000000 Hz (must be positive and finite)");
  }
}

}  // namespace
}  // namespace laban::math
