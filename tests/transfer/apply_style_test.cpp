#include "laban/transfer/apply_style.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "support/listener.h"

#include "toy_corpus.h"

namespace laban::transfer {
namespace {

motion::PoseMatrix two_actions() {
  const motion::PoseMatrix parts[] = {test::toy_clip(false, 1.1, 0.95, 0.05),
                                      test::toy_clip(true, 1.1, 0.95, 0.05)};
  return motion::concatenate(parts);
}

EffortTarget strong() {
  return {{std::nullopt, 1.0, std::nullopt}, {1.0, 1.0, 1.0, 1.0}};
}

std::string message_of(const motion::PoseMatrix& input, const ApplyOptions& options = {}) {
  try {
    (void)apply_style(test::toy_model(), input, strong(), options);
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kData);
    return error.what();
  }
  return "applied";
}

TEST(ApplyStyle, KeepsTheActionsAndReachesTheTarget) {
  const motion::PoseMatrix input = two_actions();
  const AppliedStyle applied = apply_style(test::toy_model(), input, strong());
  std::vector<std::string> contents;
  for (const AppliedSnippet& snippet : applied.snippets) {
    if (contents.empty() || contents.back() != snippet.content) contents.push_back(snippet.content);
    EXPECT_FALSE(snippet.kept) << snippet.match_cost << " of " << snippet.match_threshold;
    EXPECT_NEAR(snippet.choice.predicted.weight, 1.0, 0.05);
  }
  EXPECT_THAT(contents, ::testing::ElementsAre("swing", "circle"));
  EXPECT_EQ(applied.snippets.front().begin, 0);
  EXPECT_EQ(applied.snippets.back().end, input.frame_count());
  EXPECT_EQ(applied.snippets.back().output_end, applied.pose.frame_count());
}

TEST(ApplyStyle, SourceFramesRunForwardOverTheWholeInput) {
  const motion::PoseMatrix input = two_actions();
  const AppliedStyle applied = apply_style(test::toy_model(), input, strong());
  ASSERT_EQ(static_cast<int>(applied.source_frames.size()), applied.pose.frame_count());
  EXPECT_TRUE(std::is_sorted(applied.source_frames.begin(), applied.source_frames.end()));
  EXPECT_GE(applied.source_frames.front(), 0.0);
  EXPECT_LE(applied.source_frames.back(), input.frame_count() - 1.0);
}

TEST(ApplyStyle, PosesDoNotJumpAtJoins) {
  const AppliedStyle applied = apply_style(test::toy_model(), two_actions(), strong());
  const auto& angles = applied.pose.angles;
  double largest_inside = 0.0;
  for (const Fragment& fragment : test::toy_model().fragments) {
    const auto& own = fragment.pose.angles;
    largest_inside = std::max(
        largest_inside,
        (own.rightCols(own.cols() - 1) - own.leftCols(own.cols() - 1)).cwiseAbs().maxCoeff());
  }
  const double largest = (angles.rightCols(angles.cols() - 1) - angles.leftCols(angles.cols() - 1))
                             .cwiseAbs()
                             .maxCoeff();
  EXPECT_LE(largest, 1.5 * largest_inside);
}

TEST(MeasureSnippets, IsOfTheOutputWhereSnippetsAreJoined) {
  const StyleModel& model = test::toy_model();
  const AppliedStyle one = apply_style(model, test::toy_clip(true, 1.1, 0.95, 0.05), strong());
  ASSERT_EQ(one.snippets.size(), 1U);
  EXPECT_EQ(measure_snippets(model, one).front().effort, one.snippets.front().measured.effort)
      << "nothing is joined";
  const AppliedStyle two = apply_style(model, two_actions(), strong());
  const auto measured = measure_snippets(model, two);
  ASSERT_EQ(measured.size(), two.snippets.size());
  for (std::size_t n = 0; n < measured.size(); ++n) {
    const AppliedSnippet& snippet = two.snippets[n];
    EXPECT_NE(measured[n].effort, snippet.measured.effort) << n;
    const motion::PoseMatrix shown = two.pose.slice(snippet.output_begin, snippet.output_end);
    EXPECT_EQ(measured[n].effort,
              effort::observe(effort::describe(shown), model.observer, snippet.content).effort);
  }
}

/// Root of the sum over snippets of squared distances to what is asked, as shown in the output.
double missed(const StyleModel& model, const AppliedStyle& applied) {
  const auto measured = measure_snippets(model, applied);
  double sum = 0.0;
  for (std::size_t n = 0; n < measured.size(); ++n) {
    const double distance =
        applied.snippets[n].asked.distance_to(effort::to_vector(measured[n].effort));
    sum += distance * distance;
  }
  return std::sqrt(sum);
}

/// Targets of one factor.
std::vector<EffortTarget> targets() {
  std::vector<EffortTarget> list;
  for (std::size_t f = 0; f < effort::kFactorCount; ++f) {
    for (const double asked : {-1.0, 0.5, 1.5}) list.emplace_back().factors[f] = asked;
  }
  return list;
}

TEST(ApplyRounds, MissLessOfWhatIsAskedInTheJoinedMotion) {
  const StyleModel& model = test::measured_toy_model();
  ASSERT_TRUE(model.labels_measured);
  const motion::PoseMatrix input = two_actions();
  double before = 0.0, after = 0.0;
  for (const EffortTarget& target : targets()) {
    double last = std::numeric_limits<double>::infinity();
    for (const int rounds : {0, 1, 2, kRounds, 6}) {
      ApplyOptions options{.rounds = rounds};
      options.search.stay = 0.0;  // what is asked is all that counts
      const AppliedStyle applied = apply_style(model, input, target, options);
      ASSERT_GE(applied.snippets.size(), 2U);
      const double now = missed(model, applied);
      EXPECT_LE(now, last + 1e-12) << rounds << " rounds";
      last = now;
      if (rounds == 0) before += now;
      if (rounds == kRounds) after += now;
    }
  }
  EXPECT_LT(after, 0.9 * before);
}

TEST(ApplyRounds, OfOneSnippetAreMoreTries) {
  const StyleModel& model = test::measured_toy_model();
  const motion::PoseMatrix input = test::toy_clip(true, 1.1, 0.95, 0.05);
  for (const EffortTarget& target : targets()) {
    const AppliedStyle tried = apply_style(model, input, target, {.tries = kTries + 2});
    const AppliedStyle again = apply_style(model, input, target, {.tries = kTries, .rounds = 2});
    ASSERT_EQ(again.snippets.size(), 1U);
    EXPECT_EQ(again.pose.angles, tried.pose.angles);
  }
}

TEST(ApplyRounds, AreNoneWhereNothingIsMeasuredOrMoreThanTheBlendsIsPlayed) {
  const motion::PoseMatrix input = two_actions();
  const auto expect_none = [&](const StyleModel& model, ApplyOptions options) {
    const AppliedStyle once = apply_style(model, input, strong(), options);
    options.rounds = kRounds;
    EXPECT_EQ(apply_style(model, input, strong(), options).pose.angles, once.pose.angles);
  };
  expect_none(test::toy_model(), {});
  expect_none(test::measured_toy_model(), {.detail = Detail::kResidual});
  expect_none(test::measured_toy_model(), {.strength = 0.5});
  expect_none(test::measured_toy_model(), {.keep_timing = true});
}

TEST(ApplyRounds, LeaveWhatIsSetByHand) {
  const StyleModel& model = test::measured_toy_model();
  const SegmentedInput segmented = segment_input(model, two_actions());
  ApplyOptions options{.rounds = kRounds};
  for (int n = 0; n < std::ssize(segmented.snippets); ++n) {
    const int fragment = segmented.snippets[static_cast<std::size_t>(n)].fragment;
    options.by_hand.push_back(
        {n, fragment, model.neighbors[static_cast<std::size_t>(fragment)][1], 0.3});
  }
  const AppliedStyle set = restyle(model, segmented, {strong()}, options);
  for (std::size_t n = 0; n < set.snippets.size(); ++n) {
    EXPECT_EQ(set.snippets[n].choice.alpha, 0.3);
    EXPECT_EQ(set.snippets[n].choice.fragment_j, options.by_hand[n].fragment_j);
  }
}

TEST(ApplyRounds, TellProgressAndCanBeStopped) {
  const StyleModel& model = test::measured_toy_model();
  const SegmentedInput segmented = segment_input(model, two_actions());
  test::expect_told_and_stopped(
      static_cast<int>(segmented.snippets.size()) + kRounds, [&](base::Progress* progress) {
        (void)restyle(model, segmented, {strong()}, {.rounds = kRounds}, progress);
      });
}

TEST(ApplyRounds, AreNotNegative) {
  EXPECT_THAT(ApplyOptions{.rounds = -1}.problems(),
              ::testing::ElementsAre(::testing::HasSubstr("rounds = -1 (must be >= 0)")));
}

TEST(ApplyStyle, WhatMatchesNoContentIsKeptAndReportedOrRefused) {
  // Arm and leg whirl at once, far beyond either action.
  motion::PoseMatrix strange = test::toy_clip(false, 1.0, 1.0, 0.0);
  for (const auto joint :
       {motion::StandardJoint::kLeftUpperArm, motion::StandardJoint::kRightThigh}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int f = 0; f < strange.frame_count(); ++f) {
        strange.angles(3 * motion::index_of(joint) + axis, f) = 2.5 * std::sin(0.4 * f + axis);
      }
    }
  }
  const AppliedStyle applied = apply_style(test::toy_model(), strange, strong());
  ASSERT_EQ(applied.snippets.size(), 1U);
  EXPECT_TRUE(applied.snippets.front().kept);
  EXPECT_LT((applied.pose.angles - strange.angles).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_THAT(message_of(strange, {.strict = true}),
              ::testing::HasSubstr("match no content of the model, which knows: swing, circle"));
}

TEST(ApplyStyle, PlaysWhatIsSetByHandAndSearchesTheRest) {
  const StyleModel& model = test::toy_model();
  const motion::PoseMatrix input = two_actions();
  const AppliedStyle searched = apply_style(model, input, strong());
  const AppliedSnippet& last = searched.snippets.back();
  const auto& neighbors = model.neighbors[static_cast<std::size_t>(last.fragment)];
  ApplyOptions options;
  options.by_hand = {
      {static_cast<int>(searched.snippets.size()) - 1, neighbors[1], neighbors[2], 0.3}};
  const AppliedStyle set = apply_style(model, input, strong(), options);
  const BlendChoice& choice = set.snippets.back().choice;
  EXPECT_EQ(choice.fragment_i, neighbors[1]);
  EXPECT_EQ(choice.fragment_j, neighbors[2]);
  EXPECT_EQ(choice.alpha, 0.3);
  EXPECT_EQ(set.snippets.front().choice.fragment_i, searched.snippets.front().choice.fragment_i);
  EXPECT_EQ(set.snippets.front().choice.alpha, searched.snippets.front().choice.alpha);

  // What the search chose, set by hand, is the same motion.
  options.by_hand = {{static_cast<int>(searched.snippets.size()) - 1, last.choice.fragment_i,
                      last.choice.fragment_j, last.choice.alpha}};
  const AppliedStyle again = apply_style(model, input, strong(), options);
  EXPECT_EQ(again.pose.angles, searched.pose.angles);
}

TEST(ApplyStyle, NothingIsAskedButOfWhatIsSetByHand) {
  const StyleModel& model = test::toy_model();
  const SegmentedInput segmented = segment_input(model, two_actions());
  AskedEffort nothing;
  nothing.may_ask_nothing = true;
  const AppliedStyle kept = restyle(model, segmented, nothing);
  for (const AppliedSnippet& snippet : kept.snippets) EXPECT_TRUE(snippet.kept);
  const int fragment = segmented.snippets.front().fragment;
  ApplyOptions options;
  options.by_hand = {{0, fragment, fragment, 0.0}};
  const AppliedStyle set = restyle(model, segmented, nothing, options);
  EXPECT_FALSE(set.snippets.front().kept);
  EXPECT_TRUE(set.snippets.back().kept);
}

TEST(ApplyStyle, CuttingAndRestylingTellProgressAndCanBeStopped) {
  const StyleModel& model = test::toy_model();
  SegmentedInput segmented;
  test::expect_told_and_stopped(10, [&](base::Progress* progress) {
    segmented = segment_input(model, two_actions(), {}, progress);
  });
  test::expect_told_and_stopped(
      static_cast<int>(segmented.snippets.size()),
      [&](base::Progress* progress) { (void)restyle(model, segmented, {strong()}, {}, progress); });
}

TEST(ApplyStyle, RefusesSnippetsThatAreNotThereAndOnesSetTwice) {
  const SegmentedInput segmented = segment_input(test::toy_model(), two_actions());
  AskedEffort asked{strong()};
  ApplyOptions options;
  options.by_hand = {{99, 0, 0, 0.0}};
  EXPECT_THROW((void)restyle(test::toy_model(), segmented, asked, options), base::Error);
  options.by_hand = {{0, 0, 0, 0.0}, {0, 1, 1, 0.0}};
  EXPECT_THAT(options.problems(), ::testing::ElementsAre(::testing::HasSubstr("snippet 0 twice")));
}

TEST(ApplyStyle, TooFewFramesAreRefusedByNumber) {
  EXPECT_THAT(
      message_of(test::toy_clip(false, 1.0, 1.0, 0.0).slice(0, 10)),
      ::testing::HasSubstr("the input has 10 frames of motion; style transfer needs at least 15"));
}

TEST(ApplyStyle, AnotherFrameRateIsRefused) {
  motion::PoseMatrix input = two_actions();
  input.frame_rate_hz = 30.0;
  EXPECT_THAT(message_of(input), ::testing::HasSubstr("frames a second"));
}

}  // namespace
}  // namespace laban::transfer
