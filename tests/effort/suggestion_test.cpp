#include "laban/effort/suggestion.h"

#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "style_samples.h"

namespace laban::effort {
namespace {

Eigen::MatrixXd some_features(int count, std::uint64_t seed) {
  base::Rng rng(seed);
  return invent_blends({.count = count}, rng).features;
}

std::vector<int> columns_of(const std::vector<Suggestion>& suggestions) {
  std::vector<int> columns;
  for (const Suggestion& suggestion : suggestions) columns.push_back(suggestion.column);
  return columns;
}

TEST(SuggestBlends, NamesDifferentBlendsTheMostUsefulFirst) {
  const Eigen::MatrixXd pool = some_features(60, 1);
  const auto suggestions = suggest_blends(some_features(10, 2), pool, {.count = 25});
  ASSERT_EQ(suggestions.size(), 25U);
  const std::vector<int> columns = columns_of(suggestions);
  EXPECT_EQ(std::set<int>(columns.begin(), columns.end()).size(), 25U);
  double sum = 0.0;
  for (std::size_t n = 0; n < suggestions.size(); ++n) {
    EXPECT_GT(suggestions[n].expected_drop, 0.0);
    if (n > 0) {
      EXPECT_LE(suggestions[n].expected_drop, suggestions[n - 1].expected_drop);
    }
    sum += suggestions[n].expected_drop;
  }
  EXPECT_LT(sum, 1.0);
}

TEST(SuggestBlends, WorksBeforeTheFirstLabelAndEndsWithThePool) {
  const Eigen::MatrixXd pool = some_features(8, 1);
  EXPECT_EQ(suggest_blends(Eigen::MatrixXd(13, 0), pool, {.count = 50}).size(), 8U);
  EXPECT_EQ(suggest_blends(Eigen::MatrixXd(), pool, {.count = 1}).size(), 1U);
}

TEST(SuggestBlends, DoesNotAskAgainWhatItKnowsNorAtTheSeeds) {
  Eigen::MatrixXd pool = some_features(40, 1);
  const auto first = suggest_blends(Eigen::MatrixXd(13, 0), pool, {.count = 1}).front();
  // Labelled ten times over, from either end, the same blend is worth less than it was.
  const Eigen::MatrixXd known = swap_order(pool.col(first.column)).replicate(1, 200);
  EXPECT_NE(suggest_blends(known, pool, {.count = 1}).front().column, first.column);
  // At alpha = 0 a blend is its seed, whose label is known.
  pool(12, 7) = 0.0;
  EXPECT_EQ(suggest_blends(Eigen::MatrixXd(13, 0), pool, {.count = 40}).back().column, 7);
}

TEST(SuggestBlends, PrefersParentsThatAreFarApart) {
  Eigen::MatrixXd pool = some_features(40, 1);
  // Parents alike in content and Effort: their blends are as they are, whatever alpha.
  pool.middleRows(3, 3).leftCols(20) = pool.middleRows(0, 3).leftCols(20);
  pool.middleRows(9, 3).leftCols(20) = pool.middleRows(6, 3).leftCols(20);
  for (const int column : columns_of(suggest_blends(Eigen::MatrixXd(), pool, {.count = 20})))
    EXPECT_GE(column, 20);
}

TEST(SuggestBlends, DoesNotDependOnTheOrderOfABlend) {
  const Eigen::MatrixXd pool = some_features(30, 1), labelled = some_features(5, 2);
  EXPECT_EQ(columns_of(suggest_blends(labelled, pool, {.count = 10})),
            columns_of(suggest_blends(swap_order(labelled), swap_order(pool), {.count = 10})));
}

TEST(SuggestBlends, NamesWhatItRefuses) {
  const Eigen::MatrixXd pool = some_features(5, 1);
  EXPECT_THROW((void)suggest_blends(Eigen::MatrixXd(), Eigen::MatrixXd(13, 0)), base::Error);
  EXPECT_THROW((void)suggest_blends(Eigen::MatrixXd::Zero(11, 2), pool), base::Error);
  try {
    (void)suggest_blends(Eigen::MatrixXd(), pool, {.count = 0});
    FAIL();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kUsage);
    EXPECT_THAT(error.what(), testing::HasSubstr("count = 0 (must be >= 1)"));
  }
}

}  // namespace
}  // namespace laban::effort
