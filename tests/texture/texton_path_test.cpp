#include "laban/texture/texton_path.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "laban/base/error.h"

namespace laban::texture {
namespace {

using Eigen::MatrixXd;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Rows of probabilities, about half of them zero.
MatrixXd random_transitions(int count, base::Rng& rng) {
  MatrixXd m(count, count);
  for (double& p : m.reshaped()) p = rng.uniform() < 0.5 ? 0.0 : rng.uniform();
  for (int i = 0; i < count; ++i) {
    if (m.row(i).sum() > 0.0) m.row(i) /= m.row(i).sum();
  }
  return m;
}

bool obeys(const std::vector<int>& path, const PathRules& rules) {
  std::size_t passed = 0;
  for (const int texton : path) {
    if (std::find(rules.avoid.begin(), rules.avoid.end(), texton) != rules.avoid.end())
      return false;
    if (passed < rules.via.size() && rules.via[passed] == texton) ++passed;
  }
  return passed == rules.via.size();
}

// Oracle: every walk of `count` textons.
double cheapest_by_enumeration(const MatrixXd& m, int from, int to, int count,
                               const PathRules& rules) {
  double least = kInfinite;
  std::vector<int> path(static_cast<std::size_t>(count), 0);
  const auto textons = static_cast<int>(m.rows());
  const int walks = static_cast<int>(std::pow(textons, count) + 0.5);
  for (int w = 0; w < walks; ++w) {
    int rest = w;
    for (int& texton : path) {
      texton = rest % textons;
      rest /= textons;
    }
    if (path.front() == from && path.back() == to && obeys(path, rules)) {
      least = std::min(least, path_cost(m, path));
    }
  }
  return least;
}

TEST(PathOfLength, IsTheCheapestOfAllWalks) {
  base::Rng rng(1);
  int none = 0;
  for (int trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE(trial);
    const MatrixXd m = random_transitions(4, rng);
    PathRules rules;
    if (trial % 3 == 1) rules.via = {rng.index(4), rng.index(4)};
    if (trial % 3 == 2) rules.avoid = {3};
    const int from = rng.index(3);
    const int to = rng.index(3);
    const int count = 1 + rng.index(5);
    const double expected = cheapest_by_enumeration(m, from, to, count, rules);
    const auto path = path_of_length(m, from, to, count, rules);
    ASSERT_EQ(path.has_value(), expected < kInfinite);
    if (!path) {
      ++none;
      continue;
    }
    EXPECT_EQ(path->size(), static_cast<std::size_t>(count));
    EXPECT_TRUE(obeys(*path, rules));
    EXPECT_NEAR(path_cost(m, *path), expected, 1e-12);
  }
  EXPECT_GT(none, 3);
  EXPECT_LT(none, 50);
}

TEST(CheapestPath, IsTheCheapestOfAllLengths) {
  base::Rng rng(2);
  for (int trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE(trial);
    const MatrixXd m = random_transitions(5, rng);
    PathRules rules;
    if (trial % 2 == 1) rules.avoid = {4};
    const int from = rng.index(4);
    const int to = rng.index(4);
    double expected = kInfinite;
    for (int count = from == to ? 1 : 2; count <= 5; ++count) {
      expected = std::min(expected, cheapest_by_enumeration(m, from, to, count, rules));
    }
    const auto path = cheapest_path(m, from, to, rules);
    ASSERT_EQ(path.has_value(), expected < kInfinite);
    if (path) EXPECT_NEAR(path_cost(m, *path), expected, 1e-12);
    if (path) EXPECT_TRUE(obeys(*path, rules));
  }
}

TEST(CheapestPath, PassesItsStopsInOrder) {
  MatrixXd ring = MatrixXd::Zero(4, 4);
  for (int i = 0; i < 4; ++i) ring(i, (i + 1) % 4) = 1.0;
  const auto path = cheapest_path(ring, 0, 1, {{}, {3, 2}});
  EXPECT_EQ(path, (std::vector<int>{0, 1, 2, 3, 0, 1, 2, 3, 0, 1}));
}

TEST(CheapestPath, RefusesWhatIsNoTexton) {
  const MatrixXd m = MatrixXd::Identity(3, 3);
  EXPECT_THROW(static_cast<void>(cheapest_path(m, 0, 3)), base::Error);
  EXPECT_THROW(static_cast<void>(cheapest_path(m, -1, 0)), base::Error);
  EXPECT_THROW(static_cast<void>(cheapest_path(m, 0, 1, {{1}, {}})), base::Error);
  EXPECT_THROW(static_cast<void>(cheapest_path(m, 0, 1, {{}, {7}})), base::Error);
  EXPECT_THROW(static_cast<void>(path_of_length(m, 0, 1, 0)), base::Error);
}

TEST(RepeatTextons, RepeatsAsOftenAsTheSelfTransitionSays) {
  MatrixXd m(2, 2);
  m << 0.75, 0.25, 0.0, 1.0;
  base::Rng rng(3);
  int repeats = 0;
  constexpr int kDraws = 4000;
  for (int n = 0; n < kDraws; ++n) {
    const std::vector<int> path = repeat_textons(m, {0, 1}, rng);
    ASSERT_EQ(path.back(), 1);
    repeats += static_cast<int>(path.size()) - 2;
  }
  // 0.75 / 0.25 = 3 on average, deviation sqrt(0.75) / 0.25 / sqrt(4000) = 0.055.
  EXPECT_NEAR(static_cast<double>(repeats) / kDraws, 3.0, 0.25);
}

}  // namespace
}  // namespace laban::texture
