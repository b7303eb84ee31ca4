// What the details, strength and timing of restyle do to the motion, seen from outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/motion/standard_body.h"
#include "laban/transfer/apply_style.h"
#include "laban/transfer/styled_clip.h"

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

double largest_difference(const motion::PoseMatrix& a, const motion::PoseMatrix& b) {
  return std::max({(a.angles - b.angles).cwiseAbs().maxCoeff(),
                   (a.height - b.height).cwiseAbs().maxCoeff(),
                   (a.steps - b.steps).rightCols(a.frame_count() - 1).cwiseAbs().maxCoeff()});
}

// The input is a fragment of the corpus, but for what its performer does beside the action.
motion::PoseMatrix with_manner(motion::StandardJoint joint, double size, double turn_a_frame) {
  motion::PoseMatrix input = test::toy_model().fragments[2].pose;
  for (int f = 0; f < input.frame_count(); ++f)
    input.angles(3 * motion::index_of(joint) + 2, f) += size * std::cos(turn_a_frame * f);
  return input;
}

/// What residual detail adds to the blend.
Eigen::MatrixXd manner_kept(const motion::PoseMatrix& input) {
  ApplyOptions options;
  options.search = {.caution = 0.0, .stay = 0.0};  // a blend that is there to see
  const AppliedStyle replaced = apply_style(test::toy_model(), input, strong(), options);
  options.detail = Detail::kResidual;
  const AppliedStyle residual = apply_style(test::toy_model(), input, strong(), options);
  EXPECT_EQ(residual.pose.frame_count(), replaced.pose.frame_count()) << "timing is the blend's";
  EXPECT_TRUE(residual.pose.steps.isApprox(replaced.pose.steps)) << "and so is travel";
  return residual.pose.angles - replaced.pose.angles;
}

TEST(ResidualDetail, KeepsThePerformersPosture) {
  const auto joint = motion::StandardJoint::kLeftUpperArm;
  const Eigen::MatrixXd kept = manner_kept(with_manner(joint, 0.1, 0.0));
  const Eigen::Index row = 3 * motion::index_of(joint) + 2;
  EXPECT_NEAR(kept.row(row).minCoeff(), 0.1, 0.01);
  EXPECT_NEAR(kept.row(row).maxCoeff(), 0.1, 0.01);
}

TEST(ResidualDetail, TakesTimingAndTremblingFromTheStyle) {
  const auto joint = motion::StandardJoint::kLeftUpperArm;
  EXPECT_LT(manner_kept(with_manner(joint, 0.1, 0.8)).cwiseAbs().maxCoeff(), 0.02);
}

TEST(ResidualDetail, LeavesLegsToTheStyleForFeetStand) {
  const auto joint = motion::StandardJoint::kLeftThigh;
  EXPECT_LT(manner_kept(with_manner(joint, 0.1, 0.0)).cwiseAbs().maxCoeff(), 0.01);
}

// A quick fragment's speed makes a multiple of a performer's trembling.
TEST(ResidualDetail, TremblesNoMoreThanTheInput) {
  const auto trembling = [](const motion::PoseMatrix& pose) {
    const Eigen::Index count = pose.angles.cols() - 3;
    const auto& x = pose.angles;
    return (x.rightCols(count) - 3.0 * x.middleCols(2, count) + 3.0 * x.middleCols(1, count) -
            x.leftCols(count))
               .norm() /
           std::sqrt(static_cast<double>(count));
  };
  motion::PoseMatrix input = test::toy_clip(false, 1.1, 0.7, 0.05);
  for (int f = 0; f < input.frame_count(); ++f) input.angles(9, f) += 0.02 * std::sin(1.3 * f);
  const EffortTarget quick{{std::nullopt, std::nullopt, 1.2}, {1.0, 1.0, 1.0, 1.0}};
  const AppliedStyle applied =
      apply_style(test::toy_model(), input, quick, {.detail = Detail::kResidual});
  ASSERT_EQ(applied.snippets.size(), 1U);
  ASSERT_LT(applied.pose.frame_count(), 0.9 * input.frame_count());
  EXPECT_LE(trembling(applied.pose), 1.001 * trembling(input));
}

TEST(ResidualDetail, OnAFragmentItselfIsTheBlend) {
  const StyleModel& model = test::toy_model();
  const motion::PoseMatrix& input = model.fragments[2].pose;
  const AppliedStyle replaced = apply_style(model, input, strong());
  const AppliedStyle residual = apply_style(model, input, strong(), {.detail = Detail::kResidual});
  ASSERT_EQ(replaced.snippets.size(), 1U);
  ASSERT_EQ(replaced.snippets.front().fragment, 2);
  EXPECT_NEAR(residual.pose.frame_count(), replaced.pose.frame_count(), 1);
  EXPECT_NEAR(residual.snippets.front().measured.unclipped.weight,
              replaced.snippets.front().measured.unclipped.weight, 0.2);
}

TEST(Strength, ZeroGivesTheInputBackAndOneTheFullStyle) {
  const motion::PoseMatrix input = two_actions();
  const AppliedStyle none = apply_style(test::toy_model(), input, strong(), {.strength = 0.0});
  ASSERT_EQ(none.pose.frame_count(), input.frame_count());
  EXPECT_LT(largest_difference(none.pose, input), 1e-9);
  const AppliedStyle full = apply_style(test::toy_model(), input, strong());
  const AppliedStyle nearly =
      apply_style(test::toy_model(), input, strong(), {.strength = 1 - 1e-9});
  ASSERT_EQ(nearly.pose.frame_count(), full.pose.frame_count());
  EXPECT_LT(largest_difference(nearly.pose, full.pose), 1e-6);
}

TEST(Strength, HalfLiesBetweenInTimingAndPose) {
  const motion::PoseMatrix input = test::toy_clip(false, 0.7, 0.8, 0.0);
  const EffortTarget target{{std::nullopt, 1.0, 1.0}, {1.0, 1.0, 1.0, 1.0}};
  const auto applied = [&](double strength) {
    return apply_style(test::toy_model(), input, target, {.strength = strength});
  };
  const AppliedStyle half = applied(0.5);
  const AppliedStyle full = applied(1.0);
  EXPECT_NEAR(half.pose.frame_count(), 0.5 * (input.frame_count() + full.pose.frame_count()), 1.0);
  const int thigh = 3 * motion::index_of(motion::StandardJoint::kRightThigh);
  const auto swing = [&](const motion::PoseMatrix& pose) {
    return pose.angles.row(thigh).maxCoeff() - pose.angles.row(thigh).minCoeff();
  };
  EXPECT_NEAR(swing(half.pose), 0.5 * (swing(input) + swing(full.pose)), 0.03 * swing(input));
}

TEST(KeepTiming, EveryFrameShowsTheMomentOfTheInputsFrame) {
  const motion::PoseMatrix input = two_actions();
  for (const Detail detail : {Detail::kReplace, Detail::kResidual}) {
    const AppliedStyle applied =
        apply_style(test::toy_model(), input, strong(), {.detail = detail, .keep_timing = true});
    ASSERT_EQ(applied.pose.frame_count(), input.frame_count());
    ASSERT_EQ(applied.contacts.frame_count(), input.frame_count());
    for (std::size_t f = 0; f < applied.source_frames.size(); ++f)
      EXPECT_EQ(applied.source_frames[f], static_cast<double>(f));
    for (const AppliedSnippet& snippet : applied.snippets) {
      EXPECT_EQ(snippet.output_begin, snippet.begin);
      EXPECT_EQ(snippet.output_end, snippet.end);
    }
    // A swing's end is a swing's end: in both the thigh is farthest forward at the same time.
    const int thigh = 3 * motion::index_of(motion::StandardJoint::kRightThigh);
    Eigen::Index of_input = 0;
    Eigen::Index of_output = 0;
    input.angles.row(thigh).minCoeff(&of_input);
    applied.pose.angles.row(thigh).minCoeff(&of_output);
    EXPECT_NEAR(static_cast<double>(of_output), static_cast<double>(of_input), 3.0);
  }
}

TEST(KeepTiming, ClipsOfAnotherRateHaveTheirOwnFrameCountToo) {
  const motion::Capture at_model_rate =
      motion::find_capture(motion::to_standard_clip(two_actions()));
  for (const double rate_hz : {120.0, 50.0, 29.97}) {
    motion::Capture input = at_model_rate;
    input.clip = motion::resample(input.clip, rate_hz);
    const motion::PoseMatrix pose =
        motion::to_pose_matrix(motion::resample(input.clip, 60.0), input.humanoid);
    const AppliedStyle applied =
        apply_style(test::toy_model(), pose, strong(), {.keep_timing = true});
    const StyledClip styled = play_style(test::toy_model(), applied, input);
    EXPECT_EQ(styled.clip.frame_count(), input.clip.frame_count()) << rate_hz;
  }
}

TEST(Restyle, OneSegmentationServesManyTargets) {
  const motion::PoseMatrix input = two_actions();
  const SegmentedInput segmented = segment_input(test::toy_model(), input);
  for (const double weight : {-1.0, 1.0}) {
    const EffortTarget target{{std::nullopt, weight, std::nullopt}, {1.0, 1.0, 1.0, 1.0}};
    const AppliedStyle again = restyle(test::toy_model(), segmented, {target, {}, std::nullopt});
    EXPECT_EQ(again.pose.angles, apply_style(test::toy_model(), input, target).pose.angles);
  }
}

TEST(Restyle, RelativeTargetsCountFromWhatTheInputMeasures) {
  const SegmentedInput segmented = segment_input(test::toy_model(), two_actions());
  AskedEffort asked{strong(), {false, true, false}, std::nullopt};
  asked.target.factors[1] = -0.5;
  for (const AppliedSnippet& snippet : restyle(test::toy_model(), segmented, asked).snippets) {
    EXPECT_NEAR(*snippet.asked.factors[1], snippet.before.effort.weight - 0.5, 1e-12);
    EXPECT_FALSE(snippet.asked.factors[0]);
  }
}

TEST(Restyle, WhereACurveAsksNothingTheInputIsKept) {
  const motion::PoseMatrix input = two_actions();
  const SegmentedInput segmented = segment_input(test::toy_model(), input);
  ASSERT_EQ(segmented.snippets.size(), 2U);
  const double middle_s = segmented.snippets.front().end / 60.0;
  AskedEffort asked;
  asked.curve = TargetCurve{{{0.0, {}}, {middle_s, {}}, {middle_s + 0.01, {{{}, 1.0, {}}}}}};
  const AppliedStyle applied = restyle(test::toy_model(), segmented, asked);
  EXPECT_TRUE(applied.snippets[0].kept);
  EXPECT_FALSE(applied.snippets[1].kept);
  EXPECT_EQ(*applied.snippets[1].asked.factors[1], 1.0);
  // Long before the join, the first action is the input's.
  const int far = segmented.snippets.front().end - 48;
  ASSERT_GT(far, 0);
  EXPECT_LT((applied.pose.angles.leftCols(far) - input.angles.leftCols(far)).cwiseAbs().maxCoeff(),
            0.01);
}

// What a memory knows from other targets, and other searches, changes nothing.
TEST(PlayMemory, GivesWhatAFreshOneGives) {
  const StyleModel& model = test::toy_model();
  const SegmentedInput segmented = segment_input(model, two_actions());
  PlayMemory memory(model);
  for (const int neighbors : {25, 3, 25}) {
    ApplyOptions options;
    options.search.neighbors = neighbors;
    for (const double weight : {-1.0, 0.5, 1.0, -1.0}) {
      const AskedEffort asked{
          {{std::nullopt, weight, 0.2}, {1.0, 1.0, 1.0, 1.0}}, {}, std::nullopt};
      const AppliedStyle again = restyle(memory, segmented, asked, options);
      const AppliedStyle fresh = restyle(model, segmented, asked, options);
      EXPECT_EQ(again.pose.angles, fresh.pose.angles);
      EXPECT_EQ(again.pose.steps, fresh.pose.steps);
      ASSERT_EQ(again.snippets.size(), fresh.snippets.size());
      for (std::size_t n = 0; n < fresh.snippets.size(); ++n) {
        EXPECT_EQ(again.snippets[n].choice.alpha, fresh.snippets[n].choice.alpha);
        EXPECT_EQ(again.snippets[n].measured.effort.time, fresh.snippets[n].measured.effort.time);
      }
    }
  }
}

// More pairs than are kept, so that some are made anew.
TEST(PlayMemory, PairsAreThoseOfTheirFragmentsAndTheirSlope) {
  const StyleModel& model = test::toy_model();
  PlayMemory memory(model);
  const auto frames_of = [](const blend::BlendPair& pair, double alpha) {
    return blend::blend(pair, alpha).pose.angles;
  };
  for (int round = 0; round < 2; ++round) {
    for (const auto& list : model.neighbors) {
      for (const int j : {list[1], list[2]}) {
        for (const double alpha : {0.5, 1.25}) {
          PlayMemory fresh(model);
          const Eigen::MatrixXd kept =
              frames_of(memory.pair(list[0], j, alpha, kFastestPlay), alpha);
          EXPECT_EQ(kept, frames_of(fresh.pair(list[0], j, alpha, kFastestPlay), alpha));
          if (alpha == 0.5) {
            const auto aligned = align_pair(model.fragments[static_cast<std::size_t>(list[0])].pose,
                                            model.fragments[static_cast<std::size_t>(j)].pose);
            EXPECT_EQ(kept, frames_of(aligned, alpha)) << "the warp that labels were learnt from";
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace laban::transfer
