// The generator of the embedded corpus: curves, bodies and manners by their laws, and what the
// corpus as a whole promises (data/README.md).

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_joint.h"

#include "body.h"
#include "corpus.h"
#include "performer.h"
#include "timing.h"

namespace laban::phrase {
namespace {

using motion::StandardJoint;

const std::vector<Fragment>& corpus() {
  static const std::vector<Fragment> fragments = make_corpus();
  return fragments;
}

Track bent_track() {
  Track track;
  for (const Key& key : {Key{0.0, 1.0}, Key{0.4, 3.0}, Key{1.0, 4.0}, Key{1.3, -2.0}}) {
    track.add(key);
  }
  return track;
}

TEST(Track, GoesThroughItsKeysAndRestsBeyond) {
  const Track track = bent_track();
  for (const double fluency : {0.0, 0.6, 1.0}) {
    EXPECT_NEAR(track.value(0.4, fluency, 0.3), 3.0, 1e-12);
    EXPECT_NEAR(track.value(1.0, fluency, 0.3), 4.0, 1e-12);
    EXPECT_EQ(track.value(-5.0, fluency, 0.3), 1.0);
    EXPECT_EQ(track.value(9.0, fluency, 0.3), -2.0);
  }
}

// A jump of the acceleration would show as a second difference that does not shrink with the step.
TEST(Track, HasNoJumpInVelocityOrAcceleration) {
  const Track track = bent_track();
  constexpr double kStep = 1e-4;
  for (const double at : {0.0, 0.4, 1.0, 1.3}) {
    const auto acceleration = [&](double time) {
      return (track.value(time - kStep, 0.7, 0.5) - 2.0 * track.value(time, 0.7, 0.5) +
              track.value(time + kStep, 0.7, 0.5)) /
             (kStep * kStep);
    };
    EXPECT_NEAR(acceleration(at), 0.0, 1.0) << at;  // jerk (up to 5e3) times the step
  }
}

TEST(Track, StopsAtKeysOnlyWithoutFluency) {
  const Track track = bent_track();
  const auto velocity = [&](double fluency) {
    return (track.value(0.4001, fluency, 0.0) - track.value(0.3999, fluency, 0.0)) / 0.0002;
  };
  EXPECT_NEAR(velocity(0.0), 0.0, 1e-3);
  EXPECT_NEAR(velocity(1.0), 2.0 * 5.0 * (1.0 / 0.6) / (5.0 + 1.0 / 0.6), 1e-3);
}

TEST(PerformedTimes, LastLongerTheMoreOneHesitates) {
  const auto plain = performed_times(2.0, 60.0, {});
  const auto halting = performed_times(2.0, 60.0, {{.at_s = 1.0, .length_s = 0.4, .depth = 0.9}});
  EXPECT_EQ(plain.size(), 120U);
  EXPECT_GT(halting.size(), plain.size() + 10);
  EXPECT_TRUE(std::is_sorted(halting.begin(), halting.end()));
}

TEST(Body, StandsOnItsFeetInTheNeutralPose) {
  const auto skeleton = build_skeleton({.height = 0.9, .legs = 1.1, .hips = 1.2});
  ControlPose pose = posture_of({});
  const BodyPose body = pose_body(*skeleton, pose);
  const motion::Clip clip(skeleton, 60.0, body.root_position, body.rotations);
  const motion::ModelPose model = motion::forward_kinematics(clip, 0);
  for (const StandardJoint toe : {StandardJoint::kLeftToe, StandardJoint::kRightToe}) {
    const int j = index_of(toe);
    const Eigen::Vector3d tip =
        model.positions.col(j) +
        model.rotations[static_cast<std::size_t>(j)] * *skeleton->joint(j).end_site;
    EXPECT_NEAR(tip.y(), 0.0, 2e-3);
  }
}

TEST(DrawEfforts, SpreadsEveryFactorEvenlyInEveryAction) {
  for (const auto& of_action : draw_efforts(5, 12, 7)) {
    double sum = 0.0, lowest = 1.0, highest = -1.0;
    for (const Effort& effort : of_action) {
      sum += effort.time;
      lowest = std::min(lowest, effort.time);
      highest = std::max(highest, effort.time);
    }
    EXPECT_NEAR(sum, 0.0, 1e-12);
    EXPECT_EQ(lowest, -1.0);
    EXPECT_EQ(highest, 1.0);
  }
}

TEST(PhraseCorpus, HasFiveActionsByTwelvePerformers) {
  ASSERT_EQ(corpus().size(), 60U);
  EXPECT_EQ(corpus().front().file_name, "phrase_walk_p01.bvh");
  EXPECT_EQ(corpus().back().file_name, "phrase_kick_p12.bvh");
}

// Pairs beyond a quarter or four times the length cannot be blended (METHODS 1.2).
TEST(PhraseCorpus, HasNoTwoTakesOfAnActionTooUnlikeInLengthToBlend) {
  for (std::size_t a = 0; a < kActions.size(); ++a) {
    int shortest = 1 << 20, longest = 0;
    for (std::size_t p = 0; p < 12; ++p) {
      const int frames = corpus()[12 * a + p].clip.frame_count();
      shortest = std::min(shortest, frames);
      longest = std::max(longest, frames);
    }
    EXPECT_LT(longest - 1, 4 * (shortest - 1)) << name_of(kActions[a]);
  }
}

TEST(PhraseCorpus, KeepsTheStandingFootWhereItIs) {
  for (const Fragment& fragment : corpus()) {
    if (fragment.action == Action::kWalk) continue;  // its feet travel
    SCOPED_TRACE(fragment.file_name);
    const motion::Clip& clip = fragment.clip;
    const int foot = index_of(StandardJoint::kLeftToe);
    const Eigen::Vector3d begin = motion::forward_kinematics(clip, 0).positions.col(foot);
    double farthest = 0.0;
    for (int f = 0; f < clip.frame_count(); ++f) {
      const Eigen::Vector3d at = motion::forward_kinematics(clip, f).positions.col(foot);
      farthest = std::max(farthest, (at - begin).norm());
    }
    EXPECT_LT(farthest, 0.02);  // the heel lifts in the reach, the foot rolls over its ball
  }
}

// 5 m/s^2 is a gentle stop, 40 m/s^2 four times free fall: more at the pelvis is a jolt, not a
// step.
TEST(PhraseCorpus, NeverJoltsThePelvis) {
  for (const Fragment& fragment : corpus()) {
    const Eigen::Matrix3Xd& root = fragment.clip.root_positions();
    double hardest = 0.0;
    for (Eigen::Index f = 1; f + 1 < root.cols(); ++f) {
      hardest = std::max(hardest, (root.col(f - 1) - 2.0 * root.col(f) + root.col(f + 1)).norm());
    }
    EXPECT_LT(hardest * 3600.0, 40.0) << fragment.file_name;
  }
}

}  // namespace
}  // namespace laban::phrase
