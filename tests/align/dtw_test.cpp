#include "laban/align/dtw.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

#include "features.h"

namespace laban::align {
namespace {

using test::random_features;
using test::tied_features;

double distance(const Eigen::MatrixXd& x, int p, const Eigen::MatrixXd& y, int q) {
  return (x.col(p) - y.col(q)).squaredNorm();
}

// Cheapest path from (p, q) to the end, by trying all of them.
double cheapest_by_enumeration(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, int p = 0,
                               int q = 0) {
  const bool p_last = p == x.cols() - 1;
  const bool q_last = q == y.cols() - 1;
  double rest = p_last && q_last ? 0.0 : std::numeric_limits<double>::infinity();
  if (!p_last) rest = std::min(rest, cheapest_by_enumeration(x, y, p + 1, q));
  if (!q_last) rest = std::min(rest, cheapest_by_enumeration(x, y, p, q + 1));
  if (!p_last && !q_last) rest = std::min(rest, cheapest_by_enumeration(x, y, p + 1, q + 1));
  return distance(x, p, y, q) + rest;
}

// The recursion as METHODS 1.1 writes it, with a full table and distances by subtraction.
DtwResult plain_dtw(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  const int n = static_cast<int>(x.cols());
  const int m = static_cast<int>(y.cols());
  Eigen::MatrixXd g(n, m);
  const auto predecessor = [&](int p, int q) {
    FramePair best{p - 1, q - 1};
    double cost = p > 0 && q > 0 ? g(p - 1, q - 1) : std::numeric_limits<double>::infinity();
    if (p > 0 && g(p - 1, q) < cost) {
      best = {p - 1, q};
      cost = g(p - 1, q);
    }
    if (q > 0 && g(p, q - 1) < cost) best = {p, q - 1};
    return best;
  };
  for (int p = 0; p < n; ++p) {
    for (int q = 0; q < m; ++q) {
      const FramePair before = predecessor(p, q);
      g(p, q) = distance(x, p, y, q) + (p + q == 0 ? 0.0 : g(before.p, before.q));
    }
  }
  DtwResult result{g(n - 1, m - 1), {{n - 1, m - 1}}};
  while (!(result.path.front() == FramePair{0, 0})) {
    const FramePair first = result.path.front();
    result.path.insert(result.path.begin(), predecessor(first.p, first.q));
  }
  return result;
}

TEST(Dtw, MatchesACaseWorkedByHand) {
  // d = 0 1 9 / 4 1 1 / 16 9 1: the cheapest path is (0,0) (0,1)? no: 0 + d(1,1) + d(2,2) = 2.
  const Eigen::MatrixXd x = Eigen::RowVector3d(0.0, 2.0, 4.0);
  const Eigen::MatrixXd y = Eigen::RowVector3d(0.0, 1.0, 3.0);
  const DtwResult result = dtw(x, y);
  EXPECT_DOUBLE_EQ(result.cost, 2.0);
  EXPECT_THAT(result.path, testing::ElementsAre(FramePair{0, 0}, FramePair{1, 1}, FramePair{2, 2}));
  EXPECT_DOUBLE_EQ(result.mean_cost(), 2.0 / 3.0);
}

TEST(Dtw, MatchesExhaustiveSearchOnSmallGrids) {
  base::Rng rng(2);
  for (int trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE(trial);
    const auto x = random_features(2, 1 + rng.index(6), rng);
    const auto y = random_features(2, 1 + rng.index(6), rng);
    EXPECT_NEAR(dtw(x, y).cost, cheapest_by_enumeration(x, y), 1e-12);  // ~10 sums of O(1) terms
  }
}

TEST(Dtw, TakesThePlainRecursionsPathWithItsTies) {
  base::Rng rng(3);
  for (int trial = 0; trial < 40; ++trial) {
    SCOPED_TRACE(trial);
    // Longer than a block of distances; whole numbers make the products exact, so ties are ties.
    const auto x = tied_features(3, 1 + rng.index(50), rng);
    const auto y = tied_features(3, 1 + rng.index(50), rng);
    const DtwResult expected = plain_dtw(x, y);
    const DtwResult result = dtw(x, y);
    EXPECT_EQ(result.cost, expected.cost);
    EXPECT_EQ(result.path, expected.path);
  }
}

TEST(Dtw, CostOfItsPathIsItsCost) {
  base::Rng rng(4);
  const auto x = random_features(5, 40, rng);
  const auto y = random_features(5, 70, rng);
  const DtwResult result = dtw(x, y);
  double sum = 0.0;
  for (const FramePair& pair : result.path) sum += distance(x, pair.p, y, pair.q);
  EXPECT_NEAR(result.cost, sum, 1e-12 * sum);
}

TEST(Dtw, PathRunsFromFirstToLastPairInUnitSteps) {
  base::Rng rng(5);
  const auto path = dtw(random_features(2, 33, rng), random_features(2, 18, rng)).path;
  EXPECT_EQ(path.front(), (FramePair{0, 0}));
  EXPECT_EQ(path.back(), (FramePair{32, 17}));
  for (std::size_t n = 1; n < path.size(); ++n) {
    const int p = path[n].p - path[n - 1].p;
    const int q = path[n].q - path[n - 1].q;
    EXPECT_TRUE((p == 1 && (q == 0 || q == 1)) || (p == 0 && q == 1)) << "step " << n;
  }
}

TEST(Dtw, IsSymmetricInCost) {
  base::Rng rng(6);
  const auto x = random_features(4, 25, rng);
  const auto y = random_features(4, 31, rng);
  EXPECT_NEAR(dtw(x, y).cost, dtw(y, x).cost, 1e-10);
}

TEST(Dtw, AlignsASequenceWithItselfAlongTheDiagonalAtNoCost) {
  base::Rng rng(7);
  Eigen::MatrixXd x = random_features(63, 50, rng);
  x.middleCols(20, 10).colwise() = x.col(20).eval();  // a held pose: every path through it is free
  const DtwResult result = dtw(x, x);
  EXPECT_EQ(result.cost, 0.0);
  ASSERT_EQ(result.path.size(), 50U);
  for (int n = 0; n < 50; ++n)
    EXPECT_EQ(result.path[static_cast<std::size_t>(n)], (FramePair{n, n}));
}

TEST(Dtw, FindsATimeWarpedCopyFree) {
  base::Rng rng(8);
  const auto x = random_features(3, 20, rng);
  Eigen::MatrixXd slow(3, 60);
  for (int t = 0; t < 60; ++t) slow.col(t) = x.col(t / 3);
  EXPECT_EQ(dtw(x, slow).cost, 0.0);
}

TEST(Dtw, HandlesOneFrame) {
  base::Rng rng(9);
  const auto x = random_features(3, 1, rng);
  const auto y = random_features(3, 4, rng);
  const DtwResult result = dtw(x, y);
  EXPECT_EQ(result.path.size(), 4U);
  EXPECT_NEAR(result.cost, (y.colwise() - x.col(0)).squaredNorm(), 1e-12);
}

TEST(DtwCost, EqualsTheFullAlignmentWithItsTies) {
  base::Rng rng(10);
  for (int trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE(trial);
    const auto x = tied_features(2, 1 + rng.index(40), rng);
    const auto y = tied_features(2, 1 + rng.index(40), rng);
    const DtwResult full = dtw(x, y);
    const DtwCost cost = dtw_cost(x, y);
    EXPECT_EQ(cost.cost, full.cost);
    EXPECT_EQ(cost.path_length, static_cast<int>(full.path.size()));
    EXPECT_EQ(cost.mean_cost(), full.mean_cost());
  }
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

TEST(Dtw, RefusesWhatItCannotAlign) {
  const Eigen::MatrixXd x = Eigen::MatrixXd::Zero(2, 3);
  Eigen::MatrixXd bad = x;
  bad(1, 2) = std::nan("");
  using base::ErrorKind;
  EXPECT_EQ(message_of(ErrorKind::kData, [&] { (void)dtw(x, Eigen::MatrixXd::Zero(3, 3)); }),
            "dtw: second sequence: 3 dimensions, must be the other's 2");
  EXPECT_EQ(message_of(ErrorKind::kData, [&] { (void)dtw(Eigen::MatrixXd(2, 0), x); }),
            "dtw: first sequence: 2 dimensions x 0 frames, at least 1 x 1 is needed");
  EXPECT_EQ(message_of(ErrorKind::kData, [&] { (void)dtw_cost(x, bad); }),
            "dtw: second sequence: a value is not finite");
}

}  // namespace
}  // namespace laban::align
