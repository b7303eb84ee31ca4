#include "laban/math/statistics.h"

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <gmock/gmock.h>

#include "laban/base/error.h"

namespace laban::math {
namespace {

using ::testing::ElementsAre;

const std::vector<double> kX = {3, 1, 4, 1, 5, 9, 2, 6};
const std::vector<double> kY = {2, 7, 1, 8, 2, 8, 1, 8};

// Values of numpy 1.24 and scipy.stats: percentile, std(ddof=1), var, sem,
// median_abs_deviation(scale='normal'), pearsonr, spearmanr, rankdata on kX, kY.
TEST(Statistics, AgreesWithNumpyAndScipy) {
  EXPECT_DOUBLE_EQ(mean(kX), 3.875);
  EXPECT_DOUBLE_EQ(population_variance(kX), 6.609375);
  EXPECT_NEAR(standard_deviation(kX), 2.748376143938713, 1e-14);
  EXPECT_NEAR(standard_error(kX), 0.9716977043151993, 1e-14);
  EXPECT_DOUBLE_EQ(median(kX), 3.5);
  EXPECT_DOUBLE_EQ(percentile(kX, 0), 1.0);
  EXPECT_DOUBLE_EQ(percentile(kX, 25), 1.75);
  EXPECT_DOUBLE_EQ(percentile(kX, 90), 6.9);
  EXPECT_DOUBLE_EQ(percentile(kX, 100), 9.0);
  EXPECT_NEAR(robust_deviation(kX), 2.965204437011204, 1e-14);
  EXPECT_NEAR(pearson(kX, kY), 0.2096553190730122, 1e-15);
  EXPECT_NEAR(spearman(kX, kY), 0.19885368120992467, 1e-15);
  EXPECT_THAT(ranks(kX), ElementsAre(4, 1.5, 5, 1.5, 6, 8, 3, 7));
}

TEST(Statistics, OneValueIsItsOwnCentreWithoutSpread) {
  const std::vector<double> one = {2.5};
  EXPECT_EQ(mean(one), 2.5);
  EXPECT_EQ(median(one), 2.5);
  EXPECT_EQ(percentile(one, 73), 2.5);
  EXPECT_EQ(population_variance(one), 0.0);
  EXPECT_EQ(robust_deviation(one), 0.0);
}

TEST(Statistics, VarianceSurvivesAGreatOffset) {
  std::vector<double> shifted = kX;
  for (double& value : shifted) value += 1e8;
  EXPECT_NEAR(population_variance(shifted), 6.609375, 1e-12);  // one pass would lose all digits
}

TEST(Statistics, CorrelationKeepsItsSignUnderScalingAndItsBounds) {
  std::vector<double> line, cube;
  for (const double value : kX) {
    line.push_back(0.1 - 3.0 * value);
    cube.push_back(value * value * value);
  }
  EXPECT_NEAR(pearson(kX, line), -1.0, 1e-15);
  EXPECT_GE(pearson(kX, line), -1.0);
  EXPECT_LT(pearson(kX, cube), 0.99);
  EXPECT_NEAR(spearman(kX, cube), 1.0, 1e-15);  // ranks see only the order
}

TEST(Statistics, AConstantCorrelatesWithNothing) {
  const std::vector<double> constant(8, 0.1), zero(8, 0.0);
  EXPECT_EQ(pearson(kX, constant), 0.0);
  EXPECT_EQ(pearson(zero, kX), 0.0);
  EXPECT_EQ(spearman(constant, kX), 0.0);
}

// Values of sklearn.metrics.adjusted_rand_score.
TEST(AdjustedRandIndex, AgreesWithScikitLearn) {
  const std::vector<int> a = {0, 0, 1, 1, 2, 2, 2, 3}, b = {5, 5, 5, 1, 1, 2, 2, 2};
  EXPECT_NEAR(adjusted_rand_index(a, b), 0.15789473684210525, 1e-15);
  const std::vector<int> c = {0, 0, 1, 1}, d = {0, 0, 1, 2}, e = {0, 1, 0, 1};
  EXPECT_NEAR(adjusted_rand_index(c, d), 0.5714285714285714, 1e-15);
  EXPECT_NEAR(adjusted_rand_index(c, e), -0.5, 1e-15);
}

TEST(AdjustedRandIndex, IsOneForTheSamePartitionAndSymmetric) {
  const std::vector<int> a = {0, 0, 1, 1, 2, 2, 2, 3}, renamed = {7, 7, -1, -1, 0, 0, 0, 4};
  EXPECT_NEAR(adjusted_rand_index(a, renamed), 1.0, 1e-15);
  const std::vector<int> b = {5, 5, 5, 1, 1, 2, 2, 2};
  EXPECT_EQ(adjusted_rand_index(a, b), adjusted_rand_index(b, a));
  const std::vector<int> one = {4, 4, 4}, apart = {1, 2, 3};
  EXPECT_EQ(adjusted_rand_index(one, one), 1.0);
  EXPECT_EQ(adjusted_rand_index(apart, apart), 1.0);
  EXPECT_EQ(adjusted_rand_index(one, apart), 0.0);
  EXPECT_EQ(adjusted_rand_index(std::vector<int>{3}, std::vector<int>{9}), 1.0);
}

// Oracle: the index averages 0 over random partitions of fixed sizes.
TEST(AdjustedRandIndex, AveragesZeroOverShuffles) {
  std::mt19937_64 rng(5);
  const std::vector<int> a = {0, 0, 0, 1, 1, 1, 2, 2, 2, 2};
  std::vector<int> b = {0, 0, 1, 1, 1, 1, 1, 2, 2, 3};
  double sum = 0.0;
  for (int trial = 0; trial < 20000; ++trial) {
    for (std::size_t n = b.size() - 1; n > 0; --n) std::swap(b[n], b[rng() % (n + 1)]);
    sum += adjusted_rand_index(a, b);
  }
  EXPECT_NEAR(sum / 20000, 0.0, 0.006);  // 5 standard errors of deviation 0.17
}

void expect_error(const std::function<void()>& call, base::ErrorKind kind, const char* message) {
  try {
    call();
    ADD_FAILURE() << "nothing thrown; expected: " << message;
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), kind);
    EXPECT_STREQ(error.what(), message);
  }
}

TEST(Statistics, RefusesTooFewValuesAndUnequalLengths) {
  using base::ErrorKind;
  const std::vector<double> none, one = {1.0}, two = {1.0, 2.0};
  expect_error([&] { (void)mean(none); }, ErrorKind::kData, "mean: 0 values (needs at least 1)");
  expect_error([&] { (void)median(none); }, ErrorKind::kData,
               "median: 0 values (needs at least 1)");
  expect_error([&] { (void)standard_deviation(one); }, ErrorKind::kData,
               "standard deviation: 1 values (needs at least 2)");
  expect_error([&] { (void)pearson(one, one); }, ErrorKind::kData,
               "correlation: 1 values (needs at least 2)");
  expect_error([&] { (void)spearman(one, two); }, ErrorKind::kData,
               "rank correlation: sequences of 1 and 2 values (must be the same length)");
  expect_error([&] { (void)percentile(two, 100.5); }, ErrorKind::kUsage,
               "percentile: 100.500000 (must be in [0, 100])");
  expect_error([&] { (void)percentile(two, std::numeric_limits<double>::quiet_NaN()); },
               ErrorKind::kUsage, "percentile: nan (must be in [0, 100])");
}

}  // namespace
}  // namespace laban::math
