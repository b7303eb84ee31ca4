#include "laban/math/dyadic_mean.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "laban/math/statistics.h"
#include "laban/math/student_t.h"

namespace laban::math {
namespace {

struct Dyads {
  std::vector<double> values;
  std::vector<int> first;
  std::vector<int> second;
};

/// Values of random pairs of members: effects of both members, and noise.
Dyads draw_dyads(int count, int members, double effect, base::Rng& rng) {
  std::vector<double> effects;
  for (int m = 0; m < members; ++m) effects.push_back(effect * rng.normal());
  Dyads dyads;
  for (int n = 0; n < count; ++n) {
    const int a = rng.index(members);
    const int b = (a + 1 + rng.index(members - 1)) % members;
    dyads.first.push_back(a);
    dyads.second.push_back(b);
    dyads.values.push_back(effects[static_cast<std::size_t>(a)] +
                           effects[static_cast<std::size_t>(b)] + rng.normal());
  }
  return dyads;
}

TEST(DyadicMean, IsWhatAHandFinds) {
  // Mean 3, residuals -2, 0, 3, -1. Members: 0 has -2 and 0, 1 has -2 and 3, 2 has 0, 3 has 3,
  // 4 and 5 have -1: squares 4 + 1 + 0 + 9 + 1 + 1 = 16. Pairs found twice: 4 + 0 + 9 + 1 = 14.
  // Rest 2; 4 + 2 * 2 = 8 of the 16 ordered pairs of values share a member. 2 / 8 is less than
  // what independent values have, 14 / (4 * 3).
  const std::vector<double> values = {1, 3, 6, 2};
  const std::vector<int> first = {0, 0, 1, 4}, second = {1, 2, 3, 5};
  const DyadicMean found = dyadic_mean(values, first, second);
  EXPECT_DOUBLE_EQ(found.mean, 3.0);
  EXPECT_EQ(found.members, 6);
  EXPECT_DOUBLE_EQ(found.standard_error, std::sqrt(14.0 / 12.0));
  // Mean 3, residuals 2, 3, -2, -3: members' squares 25 + 4 + 9 + 25 + 4 + 9, pairs' 26, rest 50.
  const std::vector<double> alike = {5, 6, 1, 0};
  const std::vector<int> a = {0, 0, 3, 3}, b = {1, 2, 4, 5};
  EXPECT_DOUBLE_EQ(dyadic_mean(alike, a, b).standard_error, std::sqrt(50.0 / 8.0));
}

// Oracle: every ordered pair of values.
TEST(DyadicMean, MatchesTheSumOverAllPairsOfValues) {
  base::Rng rng(3);
  for (int trial = 0; trial < 20; ++trial) {
    Dyads dyads = draw_dyads(40, 8, 2.0, rng);
    dyads.second[5] = dyads.first[5];  // one performer alone
    const double center = mean(dyads.values);
    double products = 0.0, apart = 0.0;
    for (std::size_t p = 0; p < 40; ++p) {
      for (std::size_t q = 0; q < 40; ++q) {
        const bool shares = dyads.first[p] == dyads.first[q] || dyads.first[p] == dyads.second[q] ||
                            dyads.second[p] == dyads.first[q] || dyads.second[p] == dyads.second[q];
        if (shares) products += (dyads.values[p] - center) * (dyads.values[q] - center);
        if (!shares) apart += 1.0;
      }
    }
    const double independent = std::pow(standard_error(dyads.values), 2);
    EXPECT_NEAR(dyadic_mean(dyads.values, dyads.first, dyads.second).standard_error,
                std::sqrt(std::max(products / apart, independent)), 1e-12);
  }
}

TEST(DyadicMean, OfGroupsOfOneSizeIsTheStandardErrorOfTheirMeans) {
  const std::vector<double> values = {1, 3, 6, 8, 11, 15};
  const std::vector<int> group = {0, 0, 1, 1, 2, 2};
  const std::vector<double> means = {2, 7, 13};
  EXPECT_NEAR(dyadic_mean(values, group, group).standard_error, standard_error(means), 1e-12);
}

TEST(DyadicMean, IntervalsCoverTheTruthThoughMembersRecur) {
  base::Rng rng(1);
  int covered = 0, naive_covered = 0;
  constexpr int kTrials = 1500;
  const double t = student_t_quantile(0.975, 11.0);
  for (int trial = 0; trial < kTrials; ++trial) {
    const Dyads dyads = draw_dyads(105, 12, 1.0, rng);
    const DyadicMean found = dyadic_mean(dyads.values, dyads.first, dyads.second);
    covered += std::abs(found.mean) <= t * found.standard_error ? 1 : 0;
    naive_covered += std::abs(found.mean) <= t * standard_error(dyads.values) ? 1 : 0;
  }
  // Of 1500 trials at 95 %, chance alone moves the share by 0.012 (two standard errors); with
  // twelve members the t interval is known to be a little short.
  EXPECT_GT(covered, 0.91 * kTrials);
  EXPECT_LT(covered, 0.98 * kTrials);
  EXPECT_LT(naive_covered, 0.7 * kTrials);
}

TEST(DyadicMean, CannotTellWhereAllValuesShareAMember) {
  const std::vector<double> values = {1, 2, 4};
  const std::vector<int> first = {0, 1, 2}, second = {1, 2, 0};
  const DyadicMean found = dyadic_mean(values, first, second);
  EXPECT_NEAR(found.mean, 7.0 / 3.0, 1e-15);
  EXPECT_EQ(found.standard_error, std::numeric_limits<double>::infinity());
  EXPECT_THROW((void)dyadic_mean({}, {}, {}), base::Error);
  EXPECT_THROW((void)dyadic_mean(values, first, std::vector<int>{0}), base::Error);
}

}  // namespace
}  // namespace laban::math
