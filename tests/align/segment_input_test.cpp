#include "laban/align/segment_input.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "support/clips.h"
#include "support/listener.h"

namespace laban::align {
namespace {

using laban::test::random_pose_matrix;
using motion::PoseMatrix;

// Four contents by three performers: a smooth motion a content, small manners a performer.
struct Corpus {
  std::vector<PoseMatrix> poses;
  std::vector<int> groups;
  std::vector<int> performers;
};

PoseMatrix take(int group, int performer) {
  const int frames = 30 + 5 * group + 3 * performer;
  PoseMatrix pose = random_pose_matrix(
      {.frames = frames, .seed = static_cast<unsigned>(group + 1), .amplitude_rad = 0.6});
  const auto manner = static_cast<unsigned>(20 + group * 5 + performer);
  pose.angles += 0.15 * random_pose_matrix({.frames = frames, .seed = manner}).angles;
  pose.angles.row(5).array() += 0.2 * performer;
  return pose;
}

Corpus corpus_without(int left_out) {
  Corpus corpus;
  for (int group = 0; group < 4; ++group) {
    for (int performer = 0; performer < 4; ++performer) {
      if (performer == left_out) continue;
      corpus.poses.push_back(take(group, performer));
      corpus.groups.push_back(group);
      corpus.performers.push_back(performer);
    }
  }
  return corpus;
}

FragmentSet fragment_set(const Corpus& corpus) {
  return {fit_content_metric(corpus.poses, corpus.groups, corpus.performers), corpus.poses,
          corpus.groups, corpus.performers};
}

PoseMatrix joined(int performer, const std::vector<int>& contents, double posture) {
  PoseMatrix input = take(contents[0], performer);
  for (std::size_t n = 1; n < contents.size(); ++n) {
    const PoseMatrix next = take(contents[n], performer);
    Eigen::MatrixXd angles(63, input.frame_count() + next.frame_count());
    angles << input.angles, next.angles;
    Eigen::RowVectorXd height(angles.cols());
    height << input.height, next.height;
    Eigen::Matrix3Xd steps(3, angles.cols());
    steps << input.steps, next.steps;
    input.steps = steps;
    input.angles = angles;
    input.height = height;
  }
  input.angles.row(13).array() += posture;
  return input;
}

std::vector<int> contents_of(const InputSegmentation& segmentation, const FragmentSet& set) {
  std::vector<int> contents;
  for (const Snippet& snippet : segmentation.snippets) {
    const int group = set.groups()[static_cast<std::size_t>(snippet.fragment)];
    if (contents.empty() || contents.back() != group) contents.push_back(group);
  }
  return contents;
}

TEST(SegmentInput, FindsTheContentsOfAPerformerItHasNotSeen) {
  for (int left_out = 0; left_out < 4; ++left_out) {
    SCOPED_TRACE(left_out);
    const FragmentSet set = fragment_set(corpus_without(left_out));
    const std::vector<int> contents = {2, 0, 3, 1};
    const auto result = segment_input(joined(left_out, contents, 0.5), set);
    ASSERT_TRUE(result.has_value());
    EXPECT_EQ(contents_of(*result, set), contents);
    EXPECT_TRUE(result->converged);
  }
}

TEST(SegmentInput, TellsProgressAndCanBeStopped) {
  const FragmentSet set = fragment_set(corpus_without(0));
  const PoseMatrix input = joined(0, {2, 0, 3, 1}, 0.5);
  for (const std::optional<int> slope_limit : {std::optional<int>(), std::optional(4)}) {
    test::expect_told_and_stopped(10, [&](base::Progress* progress) {
      (void)segment_input(input, set, {.steps = {.slope_limit = slope_limit}}, progress);
    });
  }
}

TEST(SegmentInput, EveryRoundLowersTheCommonCost) {
  const FragmentSet set = fragment_set(corpus_without(3));
  const PoseMatrix input = joined(3, {1, 1, 2}, 0.5);  // its mean is not the performer's
  double before = std::numeric_limits<double>::infinity();
  for (int rounds = 0; rounds < 6; ++rounds) {  // on every frame of the 60 a second
    const auto result = segment_input(
        input, set, {.offset_rounds = rounds, .offset_rate_hz = 60.0, .boundary_voters = 0});
    ASSERT_TRUE(result.has_value());
    EXPECT_LE(result->cost, before * (1.0 + 1e-12));
    EXPECT_LE(result->rounds, rounds);
    before = result->cost;
  }
  EXPECT_LT(before, segment_input(input, set, {.offset_rounds = 0, .boundary_voters = 0})->cost);
}

TEST(SegmentInput, TheOffsetFoundLeavesNoMeanDifference) {
  const FragmentSet set = fragment_set(corpus_without(3));
  const PoseMatrix input = joined(3, {1, 1, 2}, 0.5);
  const auto left_over = [&](int rounds) {
    const auto result = segment_input(
        input, set, {.offset_rounds = rounds, .offset_rate_hz = 60.0, .boundary_voters = 0});
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(result->features.rows());
    for (const Snippet& snippet : result->snippets) {
      const Eigen::MatrixXd part =
          result->features.middleCols(snippet.begin, snippet.end - snippet.begin);
      const Eigen::MatrixXd& fragment = set.features()[static_cast<std::size_t>(snippet.fragment)];
      for (const FramePair& pair : dtw(part, fragment).path) {
        sum += part.col(pair.p) - fragment.col(pair.q);
      }
    }
    return sum.norm();
  };
  // Every round moves the path a little, so the rest shrinks from round to round.
  EXPECT_LT(left_over(1), 0.5 * left_over(0));
  EXPECT_LT(left_over(10), 0.1 * left_over(0));
}

// Not exactly: a posture moves where the limbs go by more than a constant.
TEST(SegmentInput, HardlyDependsOnAConstantPosture) {
  const FragmentSet set = fragment_set(corpus_without(2));
  const auto plain = segment_input(joined(2, {0, 1, 2}, 0.0), set);
  const auto stooped = segment_input(joined(2, {0, 1, 2}, 0.7), set);
  EXPECT_EQ(contents_of(*stooped, set), contents_of(*plain, set));
  EXPECT_NEAR(stooped->cost, plain->cost, 0.1 * plain->cost);
}

TEST(SegmentInput, BoundariesByVoteKeepTheSnippetsAndTellTheirOwnCosts) {
  const FragmentSet set = fragment_set(corpus_without(1));
  const PoseMatrix input = joined(1, {3, 0, 2, 1}, 0.4);
  const auto best = segment_input(input, set, {.boundary_voters = 0});
  const auto voted = segment_input(input, set, {.boundary_voters = 3});
  ASSERT_EQ(voted->snippets.size(), best->snippets.size());
  EXPECT_GE(voted->cost, best->cost * (1.0 - 1e-12));  // the path of least cost is the cheapest
  double cost = 0.0;
  int end = 0;
  for (std::size_t n = 0; n < voted->snippets.size(); ++n) {
    const Snippet& snippet = voted->snippets[n];
    EXPECT_EQ(snippet.fragment, best->snippets[n].fragment);
    EXPECT_EQ(snippet.begin, end);
    end = snippet.end;
    EXPECT_DOUBLE_EQ(snippet.cost,
                     dtw_cost(voted->features.middleCols(snippet.begin, end - snippet.begin),
                              set.features()[static_cast<std::size_t>(snippet.fragment)])
                         .cost);
    cost += snippet.cost;
  }
  EXPECT_EQ(end, input.frame_count());
  EXPECT_NEAR(voted->cost, cost, 1e-9 * cost);
}

TEST(SegmentInput, ASlopeLimitKeepsTheBoundariesOfThePath) {
  const FragmentSet set = fragment_set(corpus_without(1));
  const PoseMatrix input = joined(1, {3, 0, 2, 1}, 0.4);
  const auto best = segment_input(input, set, {.steps = {.slope_limit = 3}, .boundary_voters = 0});
  const auto asked = segment_input(input, set, {.steps = {.slope_limit = 3}});
  ASSERT_EQ(asked->snippets.size(), best->snippets.size());
  for (std::size_t n = 0; n < best->snippets.size(); ++n) {
    EXPECT_EQ(asked->snippets[n].begin, best->snippets[n].begin);
  }
}

TEST(SegmentInputOptions, RefusesFewerThanNoVoters) {
  EXPECT_THAT(SegmentInputOptions{.boundary_voters = -1}.problems(),
              testing::ElementsAre("SegmentInputOptions::boundary_voters = -1 (must be >= 0)"));
}

TEST(SegmentInput, WithTheRawMetricIsThePapersSegmentation) {
  const Corpus corpus = corpus_without(0);
  const FragmentSet set(ContentMetric::raw(), corpus.poses, corpus.groups, corpus.performers);
  const PoseMatrix input = joined(0, {3, 1}, 0.0);
  const auto result = segment_input(input, set);
  std::vector<Eigen::MatrixXd> angles;
  for (const PoseMatrix& pose : corpus.poses) angles.push_back(pose.angles);
  EXPECT_EQ(result->cost, segment(input.angles, angles)->cost);
  EXPECT_EQ(result->rounds, 0);
}

TEST(SegmentInput, ReportsThatNoPathExists) {
  const FragmentSet set = fragment_set(corpus_without(0));
  const PoseMatrix input = take(0, 0).slice(0, 5);
  EXPECT_FALSE(segment_input(input, set, {.steps = {.slope_limit = 2}}).has_value());
}

TEST(SegmentInput, AnOffsetFromFewFramesIsNearlyThatOfAll) {
  const FragmentSet set = fragment_set(corpus_without(1));
  const PoseMatrix input = joined(1, {0, 2, 2, 3}, 0.4);
  const auto few = segment_input(input, set);
  const auto all = segment_input(input, set, {.offset_rate_hz = 60.0});
  const auto none = segment_input(input, set, {.offset_rounds = 0});
  EXPECT_EQ(contents_of(*few, set), contents_of(*all, set));
  EXPECT_LT(few->cost - all->cost, 0.1 * (none->cost - all->cost));
}

TEST(SegmentInput, RefusesAnotherFrameRate) {
  const FragmentSet set = fragment_set(corpus_without(1));
  PoseMatrix input = take(0, 1);
  input.frame_rate_hz = 30.0;
  try {
    (void)segment_input(input, set);
    FAIL() << "nothing was thrown";
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kData);
    EXPECT_THAT(error.what(), testing::HasSubstr("input at 30"));
  }
}

TEST(FragmentSet, RefusesSizesThatDiffer) {
  const std::vector<PoseMatrix> poses(2, random_pose_matrix());
  try {
    const FragmentSet set(ContentMetric::raw(), poses, {0}, {0, 1});
    FAIL() << "nothing was thrown";
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kData);
    EXPECT_STREQ(error.what(),
                 "FragmentSet: 2 fragments, 1 groups, 2 performers (must be as many, at least 1)");
  }
}

}  // namespace
}  // namespace laban::align
