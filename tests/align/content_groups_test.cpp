#include "laban/align/content_groups.h"

#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/base/rng.h"

#include "features.h"

namespace laban::align {
namespace {

using test::random_features;

std::vector<Eigen::MatrixXd> some_features(int count, base::Rng& rng) {
  std::vector<Eigen::MatrixXd> features;
  for (int i = 0; i < count; ++i) features.push_back(random_features(3, 5 + rng.index(20), rng));
  return features;
}

Eigen::MatrixXd random_distances(int count, base::Rng& rng) {
  Eigen::MatrixXd distances = Eigen::MatrixXd::Zero(count, count);
  for (int i = 0; i < count; ++i) {
    for (int j = i + 1; j < count; ++j) distances(i, j) = distances(j, i) = rng.uniform();
  }
  return distances;
}

TEST(AllPairCosts, AreTheAlignmentsOfAllPairsForAnyNumberOfThreads) {
  base::Rng rng(1);
  const auto features = some_features(7, rng);
  const PairCosts costs = all_pair_costs(features);
  for (int i = 0; i < 7; ++i) {
    for (int j = 0; j < 7; ++j) {
      const DtwResult pair =
          dtw(features[static_cast<std::size_t>(i)], features[static_cast<std::size_t>(j)]);
      EXPECT_NEAR(costs.cost(i, j), pair.cost, 1e-5 * pair.cost);  // single precision
      EXPECT_NEAR(costs.mean_cost(i, j), pair.mean_cost(), 1e-5 * pair.mean_cost());
    }
  }
  const PairCosts again = all_pair_costs(features, 4);
  EXPECT_EQ(again.cost, costs.cost);
  EXPECT_EQ(again.mean_cost, costs.mean_cost);
}

// Average linkage by its definition: groups as sets, their distance as a double loop.
std::set<std::set<int>> plain_average_linkage(const Eigen::MatrixXd& distances, int group_count) {
  std::vector<std::set<int>> groups;
  for (int i = 0; i < distances.rows(); ++i) groups.push_back({i});
  while (static_cast<int>(groups.size()) > group_count) {
    double best = std::numeric_limits<double>::infinity();
    std::size_t first = 0;
    std::size_t second = 0;
    for (std::size_t a = 0; a < groups.size(); ++a) {
      for (std::size_t b = a + 1; b < groups.size(); ++b) {
        double sum = 0.0;
        for (const int i : groups[a]) {
          for (const int j : groups[b]) sum += distances(i, j);
        }
        const double mean = sum / static_cast<double>(groups[a].size() * groups[b].size());
        if (mean < best) {
          best = mean;
          first = a;
          second = b;
        }
      }
    }
    groups[first].insert(groups[second].begin(), groups[second].end());
    groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(second));
  }
  return {groups.begin(), groups.end()};
}

std::set<std::set<int>> as_sets(const std::vector<int>& groups) {
  std::map<int, std::set<int>> members;
  for (std::size_t i = 0; i < groups.size(); ++i) members[groups[i]].insert(static_cast<int>(i));
  std::set<std::set<int>> sets;
  for (const auto& [group, set] : members) sets.insert(set);
  return sets;
}

TEST(ContentGroups, EqualAverageLinkageByDefinition) {
  base::Rng rng(2);
  for (int trial = 0; trial < 30; ++trial) {
    SCOPED_TRACE(trial);
    const int count = 2 + rng.index(12);
    const Eigen::MatrixXd distances = random_distances(count, rng);
    const int group_count = 1 + rng.index(count);
    EXPECT_EQ(as_sets(content_groups(distances, {.group_count = group_count})),
              plain_average_linkage(distances, group_count));
  }
}

TEST(ContentGroups, StopAtTheThreshold) {
  Eigen::MatrixXd distances(4, 4);
  distances << 0, 1, 8, 9,  //
      1, 0, 9, 8,           //
      8, 9, 0, 2,           //
      9, 8, 2, 0;
  EXPECT_THAT(content_groups(distances, {.threshold = 0.5}), testing::ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(content_groups(distances, {.threshold = 1.5}), testing::ElementsAre(0, 0, 1, 2));
  EXPECT_THAT(content_groups(distances, {.threshold = 8.4}), testing::ElementsAre(0, 0, 1, 1));
  EXPECT_THAT(content_groups(distances, {.threshold = 8.6}), testing::ElementsAre(0, 0, 0, 0));
}

TEST(LocallyScaled, DividesByTheScaleOfBothNeighbourhoods) {
  Eigen::MatrixXd cost(3, 3);
  cost << 0, 4, 9,  //
      4, 0, 25,     //
      9, 25, 0;
  const Eigen::MatrixXd scaled = locally_scaled(cost, 1);  // nearest: 4, 4, 9
  EXPECT_NEAR(scaled(0, 1), 1.0, 1e-12);
  EXPECT_NEAR(scaled(0, 2), std::sqrt(9.0 / 6.0), 1e-12);
  EXPECT_NEAR(scaled(1, 2), std::sqrt(25.0 / 6.0), 1e-12);
  EXPECT_EQ(scaled(1, 1), 0.0);
  EXPECT_EQ(locally_scaled(cost, 7), locally_scaled(cost, 2));  // as many as there are
}

TEST(LocallyScaled, FindsGroupsOfDifferentSpread) {
  // Two tight groups near each other and one wide group: plain linkage breaks up the wide one.
  Eigen::RowVectorXd x(12);
  x << 0.0, 0.1, 0.2, 0.3, 1.5, 1.6, 1.7, 1.8, 10.0, 13.0, 16.0, 19.0;
  Eigen::MatrixXd cost(12, 12);
  for (int i = 0; i < 12; ++i) {
    for (int j = 0; j < 12; ++j) cost(i, j) = (x(i) - x(j)) * (x(i) - x(j));
  }
  const std::vector<int> groups = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2};
  EXPECT_NE(content_groups(cost, {.group_count = 3}), groups);
  EXPECT_EQ(content_groups(locally_scaled(cost, 2), {.group_count = 3}), groups);
}

TEST(LocallyScaled, KeepsEqualFragmentsTogether) {
  Eigen::MatrixXd cost = Eigen::MatrixXd::Constant(4, 4, 2.0);
  cost.topLeftCorner(2, 2).setZero();
  cost.bottomRightCorner(2, 2).setZero();
  const Eigen::MatrixXd scaled = locally_scaled(cost, 1);
  EXPECT_TRUE(scaled.allFinite());
  EXPECT_THAT(content_groups(scaled, {.group_count = 2}), testing::ElementsAre(0, 0, 1, 1));
}

TEST(GroupCostStatistics, AreMedianAndDearestNearestNeighbour) {
  Eigen::MatrixXd cost(6, 6);
  cost << 0, 1, 2, 9, 9, 9,  //
      1, 0, 4, 9, 9, 9,      //
      2, 4, 0, 9, 9, 9,      //
      9, 9, 9, 0, 5, 9,      //
      9, 9, 9, 5, 0, 9,      //
      9, 9, 9, 9, 9, 0;
  const std::vector<int> groups = {0, 0, 0, 1, 1, 2};
  const auto statistics = group_cost_statistics(cost, groups, {.margin = 2.0});
  ASSERT_EQ(statistics.size(), 3U);
  EXPECT_EQ(statistics[0].median, 2.0);
  EXPECT_EQ(statistics[0].threshold, 4.0);  // nearest others at 1, 1, 2
  EXPECT_EQ(statistics[1].median, 5.0);
  EXPECT_EQ(statistics[1].threshold, 10.0);
  EXPECT_FALSE(statistics[2].has_pairs);
  EXPECT_EQ(statistics[2].threshold, 10.0);
}

template <typename Call>
std::string message_of(base::ErrorKind kind, const Call& call) {
  try {
    call();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), kind);
    return error.what();
  }
  return "nothing was thrown";
}

TEST(GroupCostStatistics, DoNotAskPairsOfInfiniteCost) {
  constexpr double kNo = std::numeric_limits<double>::infinity();
  Eigen::MatrixXd cost(4, 4);
  cost << 0, kNo, 2, 3,  //
      kNo, 0, 4, 7,      //
      5, 4, 0, kNo,      //
      5, 9, kNo, 0;
  const std::vector<int> groups = {0, 0, 0, 0};
  const auto statistics = group_cost_statistics(cost, groups, {.margin = 2.0});
  EXPECT_EQ(statistics[0].median, 3.5);      // of 2, 3, 4, 7
  EXPECT_EQ(statistics[0].threshold, 10.0);  // nearest others at 2, 4, 4, 5
  const auto middle = group_cost_statistics(cost, groups, {.percentile = 50.0, .margin = 1.0});
  EXPECT_EQ(middle[0].threshold, 4.0);
}

TEST(ContentGroups, RefuseWrongOptionsAndDistances) {
  const Eigen::MatrixXd distances = Eigen::MatrixXd::Zero(3, 3);
  using base::ErrorKind;
  EXPECT_EQ(message_of(ErrorKind::kUsage, [&] { (void)content_groups(distances, {}); }),
            "ClusterOptions: exactly one of group_count and threshold must be given");
  EXPECT_EQ(
      message_of(ErrorKind::kUsage, [&] { (void)content_groups(distances, {.group_count = 4}); }),
      "ClusterOptions::group_count = 4 (must be at most the 3 items)");
  EXPECT_EQ(
      message_of(ErrorKind::kData,
                 [&] { (void)content_groups(Eigen::MatrixXd::Zero(2, 3), {.group_count = 1}); }),
      "content_groups: distances are 2 x 3 (must be square, symmetric and finite)");
}

}  // namespace
}  // namespace laban::align
