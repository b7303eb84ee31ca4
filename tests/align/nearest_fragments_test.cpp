#include "laban/align/nearest_fragments.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/base/rng.h"

#include "align/lane_kernels.h"
#include "features.h"

namespace laban::align {
namespace {

using test::random_features;

std::vector<Eigen::MatrixXd> some_features(int count, base::Rng& rng) {
  std::vector<Eigen::MatrixXd> features;
  for (int i = 0; i < count; ++i) features.push_back(random_features(3, 5 + rng.index(20), rng));
  return features;
}

// Smooth sequences: fragments near each other are nearer than most, so that much can be pruned.
Eigen::MatrixXd smooth_features(int dimensions, int frames, base::Rng& rng) {
  Eigen::MatrixXd x = random_features(dimensions, frames, rng);
  for (int f = 1; f < frames; ++f) x.col(f) = x.col(f - 1) + 0.2 * x.col(f);
  return x;
}

// The definition: all alignments in double precision, sorted.
std::vector<Neighbor> plain_nearest(const Eigen::MatrixXd& query,
                                    const std::vector<Eigen::MatrixXd>& fragments, int count) {
  std::vector<Neighbor> all;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    const DtwResult found = dtw(query, fragments[i]);
    all.push_back({static_cast<int>(i), found.cost, found.mean_cost()});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Neighbor& a, const Neighbor& b) { return a.mean_cost < b.mean_cost; });
  all.resize(std::min(all.size(), static_cast<std::size_t>(count)));
  return all;
}

TEST(Nearest, ListsFragmentsByMeanCostAndItselfFirst) {
  base::Rng rng(3);
  const auto features = some_features(9, rng);
  const std::vector<Neighbor> all = nearest(features[4], features, 20);
  ASSERT_EQ(all.size(), 9U);
  EXPECT_EQ(all[0].fragment, 4);
  EXPECT_EQ(all[0].cost, 0.0);
  for (std::size_t n = 1; n < all.size(); ++n) EXPECT_LE(all[n - 1].mean_cost, all[n].mean_cost);
  const std::vector<Neighbor> three = nearest(features[4], features, 3);
  ASSERT_EQ(three.size(), 3U);
  EXPECT_EQ(three[2].fragment, all[2].fragment);
  const std::vector<int> candidates = {7, 2};
  const std::vector<Neighbor> some = nearest(features[4], features, 3, candidates);
  ASSERT_EQ(some.size(), 2U);
  for (const Neighbor& neighbor : some)
    EXPECT_TRUE(neighbor.fragment == 7 || neighbor.fragment == 2);
}

TEST(FragmentIndex, FindsTheNearestByDefinitionWithBothKindsOfKernels) {
  for (const LaneKernels* kernels : {&baseline_lane_kernels(), &best_lane_kernels()}) {
    SCOPED_TRACE(kernels->name);
    const LaneKernelsForTest use(*kernels);
    base::Rng rng(4);
    double pruned = 0.0;
    for (int trial = 0; trial < 40; ++trial) {
      SCOPED_TRACE(trial);
      const int dimensions = 1 + rng.index(12);  // fewer and more than have bounds of their own
      std::vector<Eigen::MatrixXd> fragments;
      const int fragment_count = 1 + rng.index(60);
      for (int i = 0; i < fragment_count; ++i) {
        fragments.push_back(smooth_features(dimensions, 1 + rng.index(60), rng));
      }
      const Eigen::MatrixXd query = smooth_features(dimensions, 1 + rng.index(70), rng);
      const int count = 1 + rng.index(7);
      const FragmentIndex index(fragments);
      const NearestFragments found = index.nearest(query, count);
      const std::vector<Neighbor> expected = plain_nearest(query, fragments, count);
      ASSERT_EQ(found.neighbors.size(), expected.size());
      for (std::size_t n = 0; n < expected.size(); ++n) {
        EXPECT_EQ(found.neighbors[n].fragment, expected[n].fragment);
        EXPECT_NEAR(found.neighbors[n].cost, expected[n].cost, 1e-5 * expected[n].cost);
      }
      EXPECT_GE(found.pruned_share, 0.0);
      EXPECT_EQ(index.nearest(query, count, {}, {.prune = false}).pruned_share, 0.0);
      pruned += found.pruned_share / 40.0;
    }
    EXPECT_GT(pruned, 0.3);  // on such sequences half of all cells are never computed
  }
}

// As captures are: many coordinates, few of which hold most of the variance, and fragments that are
// cut out of a few long takes, so that some are near each other and most are not.
TEST(FragmentIndex, FindsTheNearestAmongOverlappingWindowsWithBothKindsOfKernels) {
  base::Rng rng(7);
  Eigen::VectorXd spread(40);
  for (Eigen::Index k = 0; k < spread.size(); ++k) spread(k) = 1.0 / static_cast<double>(1 + k);
  std::vector<Eigen::MatrixXd> takes;
  for (int n = 0; n < 6; ++n)
    takes.emplace_back(spread.asDiagonal() * smooth_features(40, 400, rng));
  const auto window = [&](int take) -> Eigen::MatrixXd {
    const int frames = 1 + rng.index(90);
    const Eigen::MatrixXd& all = takes[static_cast<std::size_t>(take)];
    const int begin = rng.index(static_cast<int>(all.cols()) - frames);
    return all.middleCols(begin, frames);
  };
  std::vector<Eigen::MatrixXd> fragments;
  for (int n = 0; n < 250; ++n) fragments.push_back(window(rng.index(5)));
  for (const LaneKernels* kernels : {&baseline_lane_kernels(), &best_lane_kernels()}) {
    SCOPED_TRACE(kernels->name);
    const LaneKernelsForTest use(*kernels);
    const FragmentIndex index(fragments);
    double pruned = 0.0;
    for (int trial = 0; trial < 12; ++trial) {
      SCOPED_TRACE(trial);
      const Eigen::MatrixXd query = window(trial % 6);  // of the last take there is no fragment
      const int count = 1 + rng.index(20);
      const NearestFragments found = index.nearest(query, count);
      const std::vector<Neighbor> all = plain_nearest(query, fragments, 250);
      ASSERT_EQ(found.neighbors.size(), static_cast<std::size_t>(count));
      for (std::size_t n = 0; n < found.neighbors.size(); ++n) {
        EXPECT_EQ(found.neighbors[n].fragment, all[n].fragment) << "neighbor " << n;
        EXPECT_NEAR(found.neighbors[n].mean_cost, all[n].mean_cost, 1e-5 * all.back().mean_cost);
      }
      pruned += found.pruned_share / 12.0;
    }
    EXPECT_GT(pruned, 0.3);
  }
}

TEST(FragmentIndex, GivesTiesToTheLowestIndex) {
  base::Rng rng(5);
  std::vector<Eigen::MatrixXd> fragments(30, smooth_features(9, 20, rng));
  const auto found = FragmentIndex(fragments).nearest(smooth_features(9, 25, rng), 3).neighbors;
  ASSERT_EQ(found.size(), 3U);
  for (int n = 0; n < 3; ++n) EXPECT_EQ(found[static_cast<std::size_t>(n)].fragment, n);
}

// Nothing but ties: poses that are held, some for a single frame, each pose several times.
TEST(FragmentIndex, NamesTheSameAmongHeldPosesAsTheFullSearchWithBothKindsOfKernels) {
  for (const LaneKernels* kernels : {&baseline_lane_kernels(), &best_lane_kernels()}) {
    SCOPED_TRACE(kernels->name);
    const LaneKernelsForTest use(*kernels);
    base::Rng rng(8);
    const Eigen::MatrixXd poses = random_features(25, 4, rng);
    std::vector<Eigen::MatrixXd> fragments;
    for (int i = 0; i < 120; ++i)
      fragments.emplace_back(poses.col(i % 4).replicate(1, i % 3 == 0 ? 1 : 1 + rng.index(40)));
    const FragmentIndex index(fragments);
    for (const int frames : {1, 7, 8, 33}) {
      SCOPED_TRACE(frames);
      const Eigen::MatrixXd query = poses.col(frames % 4).replicate(1, frames);
      const NearestFragments found = index.nearest(query, 45);
      const NearestFragments full = index.nearest(query, 45, {}, {.prune = false});
      for (std::size_t n = 0; n < 45; ++n)
        EXPECT_EQ(found.neighbors[n].fragment, full.neighbors[n].fragment) << "neighbor " << n;
      EXPECT_GT(found.pruned_share, 0.0);
    }
  }
}

// In any order, one of them twice.
TEST(FragmentIndex, LooksAtCandidatesAlone) {
  base::Rng rng(9);
  std::vector<Eigen::MatrixXd> fragments;
  for (int i = 0; i < 200; ++i) fragments.push_back(smooth_features(6, 1 + rng.index(60), rng));
  std::vector<int> candidates = {199};
  for (int i = 199; i >= 0; i -= 2) candidates.push_back(i);
  const FragmentIndex index(fragments);
  for (int trial = 0; trial < 10; ++trial) {
    SCOPED_TRACE(trial);
    const Eigen::MatrixXd query = smooth_features(6, 1 + rng.index(60), rng);
    const NearestFragments found = index.nearest(query, 101, candidates);
    const NearestFragments full = index.nearest(query, 101, candidates, {.prune = false});
    const NearestFragments few = index.nearest(query, 4, candidates);
    ASSERT_EQ(found.neighbors.size(), 101U);
    for (std::size_t n = 0; n < 101; ++n) {
      EXPECT_EQ(found.neighbors[n].fragment, full.neighbors[n].fragment) << "neighbor " << n;
      EXPECT_EQ(found.neighbors[n].fragment % 2, 1);
      if (n >= 4) continue;
      EXPECT_EQ(few.neighbors[n].fragment, full.neighbors[n].fragment) << "neighbor " << n;
    }
  }
}

TEST(FragmentIndex, LooksForWhatIsFarFromEveryFragment) {
  base::Rng rng(6);
  std::vector<Eigen::MatrixXd> fragments;
  for (int i = 0; i < 40; ++i) fragments.push_back(smooth_features(4, 30, rng));
  const Eigen::MatrixXd far = smooth_features(4, 30, rng).array() + 1e4;
  const auto found = FragmentIndex(fragments).nearest(far, 2).neighbors;
  const auto expected = plain_nearest(far, fragments, 2);
  EXPECT_EQ(found[0].fragment, expected[0].fragment);
  EXPECT_EQ(found[1].fragment, expected[1].fragment);
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

TEST(FragmentIndex, RefusesWhatItCannotSearch) {
  const Eigen::MatrixXd distances = Eigen::MatrixXd::Zero(3, 3);
  using base::ErrorKind;
  EXPECT_EQ(message_of(ErrorKind::kUsage,
                       [&] {
                         (void)nearest(distances, {&distances, 1}, 0);
                       }),
            "nearest: count = 0 (must be >= 1)");
  const std::vector<int> candidates = {1};
  EXPECT_EQ(message_of(ErrorKind::kUsage,
                       [&] {
                         (void)nearest(distances, {&distances, 1}, 1, candidates);
                       }),
            "nearest: candidate 1 of 1 fragments");
  EXPECT_EQ(message_of(ErrorKind::kData, [&] { FragmentIndex index({}); }),
            "nearest: no fragment, at least one is needed");
  EXPECT_EQ(message_of(ErrorKind::kData,
                       [&] {
                         (void)nearest(Eigen::MatrixXd::Zero(2, 3), {&distances, 1}, 1);
                       }),
            "nearest: features: 2 dimensions, must be the other's 3");
}

}  // namespace
}  // namespace laban::align
