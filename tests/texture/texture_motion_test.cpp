#include "laban/texture/texture_motion.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/motion_quality.h"
#include "laban/motion/retarget.h"
#include "laban/texture/choreography.h"
#include "support/listener.h"

#include "synthetic_texture.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

const MotionTexture& texture() {
  static const MotionTexture learnt = test::synthetic_texture();
  return learnt;
}

double largest_difference(const motion::Clip& a, const motion::Clip& b) {
  double largest = (a.root_positions() - b.root_positions()).cwiseAbs().maxCoeff();
  for (int f = 0; f < a.frame_count(); ++f) {
    for (int j = 0; j < a.joint_count(); ++j) {
      largest = std::max(largest, math::angle_between(a.rotation(f, j), b.rotation(f, j)));
    }
  }
  return largest;
}

TEST(TextureMotion, IsTheSameInWhateverPiecesItIsAskedFor) {
  for (const bool hold_feet : {true, false}) {
    TextureMotion whole(texture(), {.seed = 5, .hold_feet = hold_feet});
    TextureMotion pieces(texture(), {.seed = 5, .hold_feet = hold_feet});
    const motion::Clip all = whole.next(700).clip;
    int begin = 0;
    for (const int count : {1, 255, 44, 400}) {
      const motion::Clip piece = pieces.next(count).clip;
      EXPECT_LE(largest_difference(piece, all.slice(begin, begin + count)), 1e-12);
      begin += count;
    }
  }
}

TEST(TextureMotion, SaysWhichTextonIsDancedWhen) {
  TextureMotion motion(texture(), {.seed = 2});
  std::int64_t end = 0;
  for (const int count : {300, 300}) {
    const TextureClip made = motion.next(count);
    ASSERT_FALSE(made.parts.empty());
    if (end == 0) EXPECT_EQ(made.parts.front().begin, 0);
    for (std::size_t n = 1; n < made.parts.size(); ++n) {
      EXPECT_EQ(made.parts[n].begin, made.parts[n - 1].end);
    }
    end += count;
    EXPECT_GE(made.parts.back().end, end);
    EXPECT_LT(made.parts.back().begin, end);
  }
}

TEST(TextureMotion, DependsOnItsSeed) {
  const motion::Clip a = TextureMotion(texture(), {.seed = 1}).next(200).clip;
  const motion::Clip b = TextureMotion(texture(), {.seed = 3}).next(200).clip;
  EXPECT_GT(largest_difference(a, b), 0.01);
}

/// Largest acceleration of a clip as it is played, m/s^2, in frames [begin, end).
double largest_acceleration(const motion::Clip& clip, int begin, int end) {
  const auto quality =
      motion::measure_quality(clip, texture().rig.humanoid, motion::FootFloor{}).acceleration_m_s2;
  return *std::max_element(quality.begin() + begin, quality.begin() + end);
}

// Poses and velocities are continuous across textons: a jump of 1 mm alone would be an acceleration
// of 3.6 m/s^2 at 60 Hz, one of a cm/s in velocity 0.6.
TEST(TextureMotion, BendsAtJoinsLittleMoreThanTheSmoothestCapturesDo) {
  double captured = 0.0;
  for (const Take& take : texture().takes) {
    const motion::Clip clip =
        play_observations(texture(), texture().observations.middleCols(take.begin, take.length),
                          {.hold_feet = false});
    captured = std::max(captured, largest_acceleration(clip, 0, clip.frame_count()));
  }
  TextureMotion motion(texture(), {.seed = 4, .variation = 0.0, .hold_feet = false});
  const TextureClip made = motion.next(1500);
  int joins = 0;
  for (std::size_t n = 1; n + 1 < made.parts.size(); ++n) {
    const auto join = static_cast<int>(made.parts[n].begin);
    EXPECT_LE(largest_acceleration(made.clip, join - 2, join + 3), 1.25 * captured) << join;
    ++joins;
  }
  EXPECT_GT(joins, 5);
}

TEST(SynthesizePath, HitsItsEndsAndJoinsItsTextonsOnce) {
  const MatrixXd& y = texture().observations;
  const PathEnds ends{y.middleCols(10, 2), y.middleCols(300, 2)};
  const int last = texture().texton_count() - 1;
  const std::vector<PlannedTexton> path{{0, 40}, {last, 50}, {0, 60}};
  const PathMotion made = synthesize_path(texture(), path, ends);
  ASSERT_EQ(made.observations.cols(), 150);
  EXPECT_LE((made.observations.leftCols(2) - *ends.from).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LE((made.observations.rightCols(2) - *ends.to).cwiseAbs().maxCoeff(), 1e-6);
  ASSERT_EQ(made.parts.size(), 3U);
  EXPECT_EQ(made.parts[1].begin, 40);
  EXPECT_EQ(made.parts[2].end, 150);
}

TEST(SynthesizePath, WalkingAndPlayingTellProgressAndCanBeStopped) {
  const std::vector<PlannedTexton> path(6, {0, 40});
  PathMotion made;
  laban::test::expect_told_and_stopped(6, [&](base::Progress* progress) {
    made = synthesize_path(texture(), path, {}, {}, progress);
  });
  laban::test::expect_told_and_stopped(1, [&](base::Progress* progress) {
    (void)play_observations(texture(), made.observations, {}, progress);
  });
  laban::test::expect_told_and_stopped(6, [&](base::Progress* progress) {
    (void)TextureMotion(texture(), {.seed = 3}).next(600, progress);
  });
}

// A walk that was stopped loses nothing: it goes on where it stood.
TEST(TextureMotion, GoesOnAfterAStop) {
  const motion::Clip whole = TextureMotion(texture(), {.seed = 3}).next(600).clip;
  TextureMotion stopped(texture(), {.seed = 3});
  laban::test::Listener hasty(4);
  EXPECT_THROW((void)stopped.next(600, &hasty), base::Error);
  EXPECT_EQ(largest_difference(stopped.next(600).clip, whole), 0.0);
}

// With nothing drawn a texton between the ends of a segment of its own is that segment.
TEST(SynthesizePath, IsTheCaptureWhereNothingIsDrawn) {
  const Segment& segment = texture().segments.front();
  ASSERT_EQ(segments_of(texture(), segment.texton).size(), 1U);
  const MatrixXd captured = segment_observations(texture(), segment);
  const std::vector<PlannedTexton> path{{segment.texton, segment.length}};
  const PathMotion made = synthesize_path(texture(), path, {}, {.variation = 0.0});
  ASSERT_EQ(made.observations.cols(), captured.cols());
  // The last two innovations are those of two frames more, of the next texton.
  EXPECT_LE((made.observations - captured).cwiseAbs().maxCoeff(), 0.05);
}

TEST(SynthesizePath, RefusesWhatItCannotPlay) {
  const std::vector<PlannedTexton> none;
  const std::vector<PlannedTexton> unknown{{99, std::nullopt}};
  const std::vector<PlannedTexton> brief{{0, 4}};
  const std::vector<PlannedTexton> one{{0, std::nullopt}};
  EXPECT_THROW(static_cast<void>(synthesize_path(texture(), none)), base::Error);
  EXPECT_THROW(static_cast<void>(synthesize_path(texture(), unknown)), base::Error);
  EXPECT_THROW(static_cast<void>(synthesize_path(texture(), brief)), base::Error);
  EXPECT_THROW(static_cast<void>(synthesize_path(texture(), one, {MatrixXd::Zero(3, 2), {}})),
               base::Error);
  EXPECT_THROW(static_cast<void>(synthesize_path(texture(), one, {}, {.noise_level = -1.0})),
               base::Error);
  EXPECT_THROW(TextureMotion(texture(), {.variation = 2.0}), base::Error);
  EXPECT_THROW(TextureMotion(texture(), {.first = 99}), base::Error);
}

TEST(PlanChoreography, FillsTheFramesAskedForFromOnePoseToTheOther) {
  const MatrixXd& y = texture().observations;
  for (const int frames : {100, 320}) {
    const Choreography plan =
        plan_choreography(texture(), y.middleCols(0, 2), y.middleCols(238, 2), frames);
    int sum = 0;
    for (const PlannedTexton& planned : plan.path) sum += planned.length.value();
    EXPECT_EQ(sum, frames);
    EXPECT_EQ(plan.path.front().texton, texture().segments.front().texton);
  }
}

TEST(PlanChoreography, GoesTheWayOfTheCaptureWhereThatFits) {
  std::vector<int> expected;
  for (const Segment& segment : texture().segments) {
    if (segment.begin < 240) expected.push_back(segment.texton);
  }
  const MatrixXd& y = texture().observations;
  const Choreography plan =
      plan_choreography(texture(), y.middleCols(0, 2), y.middleCols(238, 2), 240);
  std::vector<int> path;
  for (const PlannedTexton& planned : plan.path) path.push_back(planned.texton);
  EXPECT_EQ(path, expected);
  EXPECT_EQ(plan.jumps, 0);
}

TEST(PlanChoreography, RefusesTimesAndPosesThatItCannotHave) {
  const MatrixXd two = texture().observations.leftCols(2);
  EXPECT_THROW(static_cast<void>(plan_choreography(texture(), two, two, 4)), base::Error);
  EXPECT_THROW(static_cast<void>(plan_choreography(texture(), two, two.leftCols(1), 100)),
               base::Error);
}

// Joints lie where they lay; the turn of forearms and shins about themselves goes to hands and
// feet.
TEST(PlayObservations, GivesTheCaptureBack) {
  const motion::Clip clip = motion::to_standard_clip(
      test::random_pose_matrix({.frames = 240, .seed = 1, .amplitude_rad = 0.4}));
  const motion::Clip played =
      play_observations(texture(), texture().observations.leftCols(240), {.hold_feet = false});
  const Eigen::RowVectorXd heights = motion::joint_positions(clip).row(1);
  EXPECT_LE((motion::joint_positions(played).row(1) - heights).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(PlayObservations, BeginsWhereItIsToldAndKeepsTheFramesItIsTold) {
  const MatrixXd y = texture().observations.leftCols(200);
  const motion::Clip plain = play_observations(texture(), y, {.hold_feet = false});
  const PlayOptions options{.start = {1.0, -2.0, 0.5}, .kept_frames = {0, 199}};
  const motion::Clip placed =
      play_observations(texture(), y, {.hold_feet = false, .start = options.start});
  const motion::Clip kept = play_observations(texture(), y, options);
  const double leg = texture().leg_length_m;
  EXPECT_NEAR(placed.root_positions()(0, 0) - plain.root_positions()(0, 0), leg, 1e-9);
  EXPECT_NEAR(placed.root_positions()(2, 0) - plain.root_positions()(2, 0), -2.0 * leg, 1e-9);
  ASSERT_TRUE(texture().rig.floor.has_value());
  EXPECT_GT(largest_difference(placed, kept), 1e-3);  // feet are held somewhere
  for (const int f : {0, 199}) {
    EXPECT_LE(largest_difference(placed.slice(f, f + 1), kept.slice(f, f + 1)), 1e-9) << f;
  }
}

/// All rotations of a joint, 4 x F.
MatrixXd quaternions(const motion::PoseMatrix& pose, int joint) {
  MatrixXd q(4, pose.frame_count());
  for (int f = 0; f < pose.frame_count(); ++f) {
    q.col(f) = math::exp(pose.angles.block<3, 1>(3 * joint, f)).coeffs();
  }
  return q;
}

TEST(TextureMotion, TurnsNoJointFarFromWhatItWasSeenToDo) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    TextureMotion motion(texture(), {.seed = seed, .hold_feet = false});
    const motion::PoseMatrix made =
        motion::to_pose_matrix(motion.next(900).clip, texture().rig.humanoid);
    const motion::PoseMatrix seen = motion::to_pose_matrix(
        play_observations(texture(), texture().observations, {.hold_feet = false}),
        texture().rig.humanoid);
    double farthest = 0.0;
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      const MatrixXd cosines = (quaternions(made, s).transpose() * quaternions(seen, s)).cwiseAbs();
      farthest = std::max(farthest, 2.0 * std::acos(cosines.rowwise().maxCoeff().minCoeff()));
    }
    // Two random dances have no poses in common: halfway, some joints are a little beyond 15.
    EXPECT_LE(farthest, 18.0 * math::kDegree) << seed;
  }
}

}  // namespace
}  // namespace laban::texture
