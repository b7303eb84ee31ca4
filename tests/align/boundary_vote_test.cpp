#include "align/boundary_vote.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "laban/align/dtw.h"

namespace laban::align {
namespace {

// A content that rises from `low` to `high` and back, resting at its ends.
Eigen::MatrixXd take(double high, int rest_before, int rest_after, double low = 0.0) {
  Eigen::MatrixXd frames = Eigen::MatrixXd::Constant(1, rest_before + 9 + rest_after, low);
  for (int t = 0; t < 9; ++t) {
    frames(0, rest_before + t) = low + (high - low) * (1.0 - std::abs(t - 4) / 5.0);
  }
  return frames;
}

Eigen::MatrixXd joined(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  Eigen::MatrixXd both(x.rows(), x.cols() + y.cols());
  both << x, y;
  return both;
}

struct Case {
  Eigen::MatrixXd input;
  std::vector<Eigen::MatrixXd> fragments;
  std::vector<int> groups;
  std::vector<Snippet> snippets;
  int truth = 0;
};

// Content 0 goes up, content 1 down. The boundary stands `off` frames from the truth.
Case two_contents(int off) {
  const Eigen::MatrixXd up = take(1.0, 2, 2);
  const Eigen::MatrixXd down = take(-1.0, 2, 2);
  Case made{joined(up, down), {}, {}, {}, static_cast<int>(up.cols())};
  for (const double size : {0.8, 0.9, 1.2}) {
    made.fragments.push_back(take(size, 2, 2));
    made.groups.push_back(0);
    made.fragments.push_back(take(-size, 2, 2));
    made.groups.push_back(1);
  }
  const int boundary = made.truth + off;
  made.snippets = {{0, boundary, 2, 0.0, 0},
                   {boundary, static_cast<int>(made.input.cols()), 3, 0.0, 0}};
  return made;
}

TEST(BoundaryVote, BringsABoundaryBackBetweenTheContents) {
  for (const int off : {-4, 4}) {
    SCOPED_TRACE(off);
    Case given = two_contents(off);
    vote_on_boundaries(given.input, given.fragments, given.groups,
                       {.voters = 3, .stride = 1, .reach_frames = 6}, given.snippets);
    // Two frames of rest on either side look the same.
    EXPECT_NEAR(given.snippets[0].end, given.truth, 2);
    EXPECT_EQ(given.snippets[1].begin, given.snippets[0].end);
    EXPECT_EQ(given.snippets[0].begin, 0);
    EXPECT_EQ(given.snippets[1].end, given.input.cols());
    EXPECT_DOUBLE_EQ(
        given.snippets[0].cost,
        dtw_cost(given.input.leftCols(given.snippets[0].end), given.fragments[2]).cost);
  }
}

TEST(BoundaryVote, MovesABoundaryNoFartherThanItsReach) {
  Case given = two_contents(5);
  vote_on_boundaries(given.input, given.fragments, given.groups,
                     {.voters = 3, .stride = 1, .reach_frames = 1}, given.snippets);
  EXPECT_EQ(given.snippets[0].end, given.truth + 4);
}

TEST(BoundaryVote, MovesByWholeStrides) {
  Case given = two_contents(4);
  vote_on_boundaries(given.input, given.fragments, given.groups,
                     {.voters = 3, .stride = 3, .reach_frames = 6}, given.snippets);
  EXPECT_EQ(given.snippets[0].end, given.truth + 1);
}

TEST(BoundaryVote, LeavesABoundaryInsideAContent) {
  Case given = two_contents(4);
  given.groups.assign(given.groups.size(), 0);
  vote_on_boundaries(given.input, given.fragments, given.groups,
                     {.voters = 3, .stride = 1, .reach_frames = 6}, given.snippets);
  EXPECT_EQ(given.snippets[0].end, given.truth + 4);
}

// One take that begins its way down late would end content 0 late; the other two know better.
TEST(BoundaryVote, ManyDecideAgainstTheOddOne) {
  Case given = two_contents(0);
  given.fragments[2] = joined(take(1.0, 2, 2), Eigen::MatrixXd::Constant(1, 3, -0.4));
  const auto boundary = [&](int voters) {
    std::vector<Snippet> snippets = given.snippets;
    vote_on_boundaries(given.input, given.fragments, given.groups,
                       {.voters = voters, .stride = 1, .reach_frames = 6}, snippets);
    return snippets[0].end;
  };
  EXPECT_NEAR(boundary(3), given.truth, 2);
}

TEST(BoundaryVote, SurvivesSnippetsOfOneFrame) {
  Case given = two_contents(0);
  given.snippets[0].end = 1;
  given.snippets[1].begin = 1;
  vote_on_boundaries(given.input, given.fragments, given.groups,
                     {.voters = 3, .stride = 4, .reach_frames = 6}, given.snippets);
  EXPECT_GE(given.snippets[0].end, 1);
  EXPECT_LT(given.snippets[0].end, given.input.cols());
}

// Between the two lies a pause that both contents might claim; which frames of it are still is
// told.
TEST(BoundaryVote, OfPlacesThatFitAlikeTakesTheStillest) {
  Case given = two_contents(0);
  const Eigen::MatrixXd up = take(1.0, 2, 0);
  given.input = joined(joined(up, Eigen::MatrixXd::Zero(1, 8)), take(-1.0, 0, 2));
  const int pause = static_cast<int>(up.cols());
  for (const int still : {2, 5}) {
    SCOPED_TRACE(still);
    std::vector<double> speed(static_cast<std::size_t>(given.input.cols()), 1.0);
    for (const int near : {-1, 1}) speed[static_cast<std::size_t>(pause + still + near)] = 0.0;
    std::vector<Snippet> snippets = given.snippets;
    snippets[0].end = snippets[1].begin = pause;
    snippets[1].end = static_cast<int>(given.input.cols());
    vote_on_boundaries(given.input, given.fragments, given.groups,
                       {.voters = 3, .stride = 1, .reach_frames = 8, .speed = speed}, snippets);
    EXPECT_EQ(snippets[0].end, pause + still);
  }
}

// A take that fits exactly is believed whatever the others say.
TEST(BoundaryVote, AnExactFitDecidesAlone) {
  Case given = two_contents(4);
  given.fragments[0] = given.input.leftCols(given.truth);
  given.fragments[1] = given.input.rightCols(given.input.cols() - given.truth);
  vote_on_boundaries(given.input, given.fragments, given.groups,
                     {.voters = 3, .stride = 1, .reach_frames = 6}, given.snippets);
  EXPECT_NEAR(given.snippets[0].end, given.truth, 2);
}

}  // namespace
}  // namespace laban::align
