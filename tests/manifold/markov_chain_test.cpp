#include "laban/manifold/markov_chain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"

namespace laban::manifold {
namespace {

using Eigen::MatrixXd;
using ::testing::ElementsAre;

TEST(MarkovChain, CountsFromFrameToFrameNeverAcrossTakes) {
  const std::vector<std::vector<int>> takes = {{0, 0, 1}, {2, 1, 1}};
  const MatrixXd counts = count_transitions(takes, 3);
  MatrixXd expected(3, 3);
  expected << 1, 1, 0, 0, 1, 0, 0, 1, 0;
  EXPECT_EQ(counts, expected);
  const TransitionMatrix matrix = transition_matrix(counts);
  EXPECT_DOUBLE_EQ(matrix(0, 1), 0.5);
  EXPECT_DOUBLE_EQ(matrix(1, 1), 1.0);
  EXPECT_THROW((void)count_transitions(takes, 2), base::Error);
}

TEST(MarkovChain, WalksToTheLikeliestAndBeforeACycleToTheSecond) {
  MatrixXd matrix(4, 4);
  matrix << 0.9, 0.06, 0.04, 0.0,  //
      0.07, 0.9, 0.03, 0.0,        // the likeliest is back to 0: too early, so 2
      0.05, 0.0, 0.9, 0.05,        // the first of equals is 0, visited: so 3
      0.1, 0.0, 0.0, 0.9;          // only 0 follows: the cycle closes
  EXPECT_THAT(walk_states(matrix, 0), ElementsAre(0, 1, 2, 3, 0));
  EXPECT_THROW((void)walk_states(matrix, 4), base::Error);
  EXPECT_THROW((void)walk_states(matrix, -1), base::Error);
  // Nothing but itself follows.
  EXPECT_THAT(walk_states(MatrixXd::Identity(2, 2), 1), ElementsAre(1));
}

// A figure of eight: what follows the middle depends on the loop that led to it.
TEST(MarkovChain, AWalkMayDependOnTheStateBefore) {
  const TransitionRow row = [](int before, int state) {
    Eigen::RowVectorXd next = Eigen::RowVectorXd::Zero(3);
    if (state != 1) next[1] = 1.0;
    if (state == 1) next[before == 0 ? 2 : 0] = 1.0;
    return next;
  };
  EXPECT_THAT(walk_states(row, 3, 1, 0), ElementsAre(1, 2, 1));
  EXPECT_THAT(walk_states(row, 3, 1, 2), ElementsAre(1, 0, 1));
  EXPECT_THAT(walk_states(row, 3, 0, -1), ElementsAre(0, 1, 2, 1));
}

TEST(MarkovChain, PerturbationKeepsRowsThatSumToOneAndIsNoneAtZero) {
  MatrixXd matrix(3, 3);
  matrix << 0.5, 0.5, 0.0, 0.0, 0.2, 0.8, 0.0, 0.0, 0.0;
  base::Rng rng(1);
  EXPECT_EQ(perturbed(matrix, 0.0, rng), matrix);
  bool changed = false;
  for (int trial = 0; trial < 50; ++trial) {
    const TransitionMatrix noisy = perturbed(matrix, 0.3, rng);
    EXPECT_GE(noisy.minCoeff(), 0.0);
    for (int i = 0; i < 2; ++i) EXPECT_NEAR(noisy.row(i).sum(), 1.0, 1e-12);
    changed = changed || walk_states(noisy, 0) != walk_states(matrix, 0);
  }
  EXPECT_TRUE(changed);
}

TEST(MarkovChain, StaysAsLongAsItsRunsLastInTheMean) {
  // Runs of state 0: 4 and 2 frames long, each left once.
  const std::vector<std::vector<int>> takes = {{0, 0, 0, 0, 1, 1, 0, 0, 1}};
  const Eigen::VectorXd stay = mean_stay(count_transitions(takes, 3));
  EXPECT_DOUBLE_EQ(stay[0], 3.0);
  EXPECT_DOUBLE_EQ(stay[1], 2.0);  // one run of two; the last frame's run is not known to end
  EXPECT_DOUBLE_EQ(stay[2], 1.0);
}

}  // namespace
}  // namespace laban::manifold
