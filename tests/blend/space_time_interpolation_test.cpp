#include "laban/blend/space_time_interpolation.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "laban/math/cubic_interpolation.h"
#include "laban/math/rotation.h"
#include "support/clips.h"

namespace laban::blend {
namespace {

using motion::PoseMatrix;

constexpr double kPi = std::numbers::pi;

align::TimeWarp warp_between(const PoseMatrix& a, const PoseMatrix& b) {
  return align::warp_of_path(align::dtw(a.angles, b.angles).path);
}

BlendPair pair_of(const PoseMatrix& a, const PoseMatrix& b) {
  return {a, b, warp_between(a, b)};
}

PoseMatrix random_pose(int frames, unsigned seed) {
  return test::random_pose_matrix({.frames = frames, .seed = seed});
}

/// Clips of many lengths whose time warps are anything but diagonal.
std::vector<std::array<PoseMatrix, 2>> random_pairs() {
  const std::vector<std::array<int, 2>> lengths = {
      {40, 40}, {40, 61}, {90, 30}, {25, 97}, {2, 2}, {2, 5}, {5, 2}, {1, 1}, {3, 3}, {120, 119}};
  std::vector<std::array<PoseMatrix, 2>> pairs;
  unsigned seed = 1;
  for (const auto& [i, j] : lengths) {
    pairs.push_back({random_pose(i, seed), random_pose(j, seed + 1)});
    pairs.back()[1].leg_length_m = 0.7;
    seed += 2;
  }
  return pairs;
}

/// A still pose whose root moves by the same rigid step every frame.
PoseMatrix steady_walk(int frames, const Eigen::Vector3d& step) {
  PoseMatrix pose;
  pose.frame_rate_hz = 60.0;
  pose.leg_length_m = 0.84;
  pose.angles = Eigen::MatrixXd::Zero(motion::kAngleRowCount, frames);
  pose.height = Eigen::RowVectorXd::Ones(frames);
  pose.steps = step.replicate(1, frames);
  return pose;
}

align::TimeWarp straight_warp(int frames_i, int frames_j) {
  return {Eigen::Vector2d(0.0, frames_i - 1), Eigen::Vector2d(0.0, frames_j - 1)};
}

double difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return 1e300;
  return a.size() == 0 ? 0.0 : (a - b).cwiseAbs().maxCoeff();
}

void expect_same(const PoseMatrix& a, const PoseMatrix& b, double tolerance) {
  EXPECT_EQ(a.frame_rate_hz, b.frame_rate_hz);
  EXPECT_NEAR(a.leg_length_m, b.leg_length_m, tolerance);
  EXPECT_LE(difference(a.angles, b.angles), tolerance);
  EXPECT_LE(difference(a.height, b.height), tolerance);
  EXPECT_LE(difference(a.steps, b.steps), tolerance);
  EXPECT_LE(difference(planar_path(a), planar_path(b)), tolerance);
}

TEST(SpaceTimeInterpolation, AlphaZeroAndOneGiveTheClipsBack) {
  for (const auto& [i, j] : random_pairs()) {
    SCOPED_TRACE(testing::Message() << i.frame_count() << " and " << j.frame_count());
    const BlendPair pair = pair_of(i, j);
    expect_same(blend(pair, 0.0).pose, i, 1e-11);
    expect_same(blend(pair, 1.0).pose, j, 1e-11);
  }
}

TEST(SpaceTimeInterpolation, ExchangingTheClipsMirrorsAlpha) {
  for (const auto& [i, j] : random_pairs()) {
    SCOPED_TRACE(testing::Message() << i.frame_count() << " and " << j.frame_count());
    const BlendPair forward = pair_of(i, j);
    const BlendPair backward = {j, i, forward.warp().swapped()};
    for (const double alpha : {-0.25, -0.1, 0.25, 0.5, 0.7, 1.25}) {
      expect_same(blend(forward, alpha).pose, blend(backward, 1.0 - alpha).pose, 1e-10);
    }
  }
}

TEST(SpaceTimeInterpolation, AClipBlendedWithItselfIsItself) {
  const PoseMatrix clip = random_pose(77, 5);
  const BlendPair pair = pair_of(clip, clip);
  for (const double alpha : {-0.25, 0.0, 0.37, 1.0, 1.25}) {
    expect_same(blend(pair, alpha).pose, clip, 1e-11);
  }
}

TEST(SpaceTimeInterpolation, ShowsTheWeightedMeanOfTheSampledFrames) {
  const PoseMatrix i = random_pose(50, 8);
  const PoseMatrix j = random_pose(80, 9);
  const Blend blended = blend(pair_of(i, j), 0.3);
  for (int k = 0; k < blended.pose.frame_count(); ++k) {
    const auto n = static_cast<std::size_t>(k);
    const Eigen::VectorXd expected = 0.7 * math::interpolate(i.angles, blended.times_i[n]) +
                                     0.3 * math::interpolate(j.angles, blended.times_j[n]);
    EXPECT_LT((blended.pose.angles.col(k) - expected).norm(), 1e-12);
  }
  EXPECT_EQ(blended.times_i.front(), 0.0);
  EXPECT_EQ(blended.times_i.back(), 49.0);
  EXPECT_EQ(blended.times_j.back(), 79.0);
}

// Between two alphas of one frame count the blend moves by no more than its derivative allows; at a
// change of frame count the same motion is sampled at other times.
TEST(SpaceTimeInterpolation, IsContinuousInAlpha) {
  const PoseMatrix i = random_pose(40, 21);
  const PoseMatrix j = random_pose(70, 22);
  const BlendPair pair = pair_of(i, j);
  constexpr double h = 1e-6;
  for (double alpha = -0.25; alpha + h <= 1.25; alpha += 0.01) {
    const PoseMatrix a = blend(pair, alpha).pose;
    const PoseMatrix b = blend(pair, alpha + h).pose;
    if (a.frame_count() != b.frame_count()) continue;
    EXPECT_LT(difference(a.angles, b.angles), 1e-3) << alpha;  // |dX / d alpha| below 1e3
    EXPECT_LT(difference(a.steps, b.steps), 1e-3) << alpha;
  }
}

TEST(SpaceTimeInterpolation, TwoStraightWalksTravelTheWeightedWay) {
  const PoseMatrix slow = steady_walk(61, {0.0, 0.01, 0.0});
  const PoseMatrix fast = steady_walk(41, {0.0, 0.03, 0.0});
  const BlendPair pair(slow, fast, straight_warp(61, 41));
  for (const double alpha : {-0.25, 0.0, 0.5, 0.8, 1.25}) {
    const PoseMatrix pose = blend(pair, alpha).pose;
    const Eigen::Vector3d end = planar_path(pose).rightCols<1>();
    EXPECT_NEAR(end.y(), (1.0 - alpha) * 60 * 0.01 + alpha * 40 * 0.03, 1e-12);
    EXPECT_NEAR(end.x(), 0.0, 1e-12);
    EXPECT_NEAR(end.z(), 0.0, 1e-12);
  }
}

// However the warp bends, the travel of the whole is the mean of the travels: sampling displacement
// per frame without the local rate would not give it.
TEST(SpaceTimeInterpolation, TravelDoesNotDependOnTheWarp) {
  const PoseMatrix slow = steady_walk(41, {0.0, 0.01, 0.0});
  const PoseMatrix fast = steady_walk(41, {0.0, 0.03, 0.0});
  std::vector<align::FramePair> path;
  for (int p = 0; p < 41; ++p) path.push_back({p, 0});
  for (int q = 1; q < 41; ++q) path.push_back({40, q});
  const PoseMatrix pose = blend(BlendPair(slow, fast, align::warp_of_path(path)), 0.25).pose;
  EXPECT_NEAR(planar_path(pose)(1, 40), 0.75 * 0.4 + 0.25 * 1.2, 1e-12);
}

// Closed form: on a circle of radius r walked with `turn` radians a frame, the motion over dt
// frames is the chord 2 r sin(turn dt / 2), turn dt / 2 off the heading at its beginning.
TEST(SpaceTimeInterpolation, TwoCirclesBlendTheirChords) {
  struct Circle {
    double radius;
    double turn;
    Eigen::Vector3d motion(double frames) const {
      const double half = 0.5 * turn * frames;
      const double chord = 2.0 * radius * std::sin(half);
      return {chord * std::sin(half), chord * std::cos(half), turn * frames};
    }
  };
  const Circle a{2.0, 0.02};
  const Circle b{3.0, 0.03};
  const PoseMatrix walk_a = steady_walk(101, a.motion(1.0));
  const PoseMatrix walk_b = steady_walk(71, b.motion(1.0));
  const BlendPair pair(walk_a, walk_b, straight_warp(101, 71));
  for (const double alpha : {-0.25, 0.0, 0.4, 1.0, 1.25}) {
    const Blend blended = blend(pair, alpha);
    for (int k = 1; k < blended.pose.frame_count(); ++k) {
      const auto n = static_cast<std::size_t>(k);
      const Eigen::Vector3d expected =
          (1.0 - alpha) * a.motion(blended.times_i[n] - blended.times_i[n - 1]) +
          alpha * b.motion(blended.times_j[n] - blended.times_j[n - 1]);
      // The cubic through a circle of 0.03 rad a frame is off by about 0.03^3 r / 10.
      EXPECT_LT((blended.pose.steps.col(k) - expected).norm(), 1e-5) << k;
    }
  }
}

TEST(SpaceTimeInterpolation, WhereTheRootStartsDoesNotMatter) {
  PoseMatrix turned = random_pose(60, 31);
  const PoseMatrix other = random_pose(50, 32);
  const PoseMatrix before = blend(pair_of(turned, other), 0.4).pose;
  turned.steps.col(0).setConstant(9.0);  // never integrated
  expect_same(blend(pair_of(turned, other), 0.4).pose, before, 0.0);
}

/// One joint turning about a slowly tilting axis, from angle `from` to `to`.
PoseMatrix turning_joint(int frames, double from, double to) {
  PoseMatrix pose = steady_walk(frames, Eigen::Vector3d::Zero());
  for (int f = 0; f < frames; ++f) {
    const double s = static_cast<double>(f) / (frames - 1);
    const Eigen::Vector3d axis = Eigen::Vector3d(1.0, 0.2 * s, 0.1).normalized();
    pose.angles.block<3, 1>(30, f) = (from + s * (to - from)) * axis;
  }
  return pose;
}

TEST(SpaceTimeInterpolation, AJointOnTheOtherBranchIsBlendedTheShortWay) {
  // The same motion but for 0.2 rad, described as 3 .. 2.5 and as -3.08 .. -3.58 rad.
  const PoseMatrix i = turning_joint(40, 3.0, 2.5);
  const PoseMatrix j = turning_joint(40, 3.2 - 2.0 * kPi, 2.7 - 2.0 * kPi);
  const BlendPair forward(i, j, straight_warp(40, 40));
  const BlendPair backward(j, i, straight_warp(40, 40));
  for (const double alpha : {-0.25, 0.0, 0.5, 1.0, 1.25}) {
    const PoseMatrix pose = blend(forward, alpha).pose;
    const PoseMatrix mirrored = blend(backward, 1.0 - alpha).pose;
    for (int f = 0; f < 40; ++f) {
      const Eigen::Vector3d axis = i.angles.block<3, 1>(30, f).normalized();
      const Eigen::Vector3d expected =
          i.angles.block<3, 1>(30, f) + 0.2 * alpha * axis;  // both clips turn about one axis
      const Eigen::Quaterniond got = math::exp(pose.angles.block<3, 1>(30, f));
      EXPECT_LT(math::angle_between(got, math::exp(expected)), 1e-9);
      EXPECT_LT(math::angle_between(got, math::exp(mirrored.angles.block<3, 1>(30, f))), 1e-9);
    }
  }
}

TEST(SpaceTimeInterpolation, ABranchIsChosenOnceAClipAndNotAFrame) {
  // Apart by 2.9 rad at first and by 3.4 at last: each frame alone would change its mind half-way.
  const PoseMatrix i = turning_joint(60, 1.0, 1.0);
  const PoseMatrix j = turning_joint(60, -1.9, -2.4);
  const PoseMatrix pose = blend(BlendPair(i, j, straight_warp(60, 60)), 0.5).pose;
  for (int f = 1; f < 60; ++f) {
    EXPECT_LT((pose.angles.col(f) - pose.angles.col(f - 1)).norm(), 0.02) << f;
  }
}

// Which of the two clips moves matters where their axes differ: it must not depend on their order.
TEST(SpaceTimeInterpolation, TheChosenBranchDoesNotDependOnTheOrder) {
  const PoseMatrix i = turning_joint(40, 3.0, 2.8);
  PoseMatrix j = turning_joint(40, -2.9, -2.6);
  j.angles.row(31).array() += 0.6;
  const BlendPair forward(i, j, straight_warp(40, 40));
  const BlendPair backward(j, i, straight_warp(40, 40));
  EXPECT_NE(forward.sources()[0].rows.topRows(63) == i.angles,
            forward.sources()[1].rows.topRows(63) == j.angles);
  for (const double alpha : {-0.25, 0.3, 0.5, 1.25}) {
    expect_same(blend(forward, alpha).pose, blend(backward, 1.0 - alpha).pose, 1e-10);
  }
}

// Both clips spend most of their time half a turn from 0, on opposite sides, and then run past 0, a
// little beside it: on another branch either would whirl round there.
TEST(SpaceTimeInterpolation, ABranchOnWhichAJointWouldWhirlIsNotTaken) {
  const auto past_zero = [](double from) {
    PoseMatrix pose = steady_walk(100, Eigen::Vector3d::Zero());
    for (int f = 0; f < 100; ++f) {
      const double s = f < 60 ? 1.0 : 1.0 - (f - 60) / 30.0;  // 1 .. 1, down to -0.3
      pose.angles.block<3, 1>(30, f) = Eigen::Vector3d(from * s, 0.02, 0.0);
    }
    return pose;
  };
  const PoseMatrix i = past_zero(3.0);
  const PoseMatrix j = past_zero(-3.1);
  const BlendPair pair(i, j, straight_warp(100, 100));
  EXPECT_EQ(pair.sources()[0].rows.topRows(63), i.angles);
  EXPECT_EQ(pair.sources()[1].rows.topRows(63), j.angles);
}

TEST(SpaceTimeInterpolation, SaysWhatIsWrong) {
  using testing::HasSubstr;
  const auto message_of = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const base::Error& error) {
      return error.what();
    }
    return "no error";
  };
  const PoseMatrix i = random_pose(20, 1);
  const PoseMatrix j = random_pose(30, 2);
  const BlendPair pair = pair_of(i, j);
  EXPECT_THAT(message_of([&] { (void)blend(pair, -0.26); }), HasSubstr("alpha = -0.26"));
  PoseMatrix other = j;
  other.frame_rate_hz = 30.0;
  EXPECT_THAT(message_of([&] { BlendPair(i, other, pair.warp()); }), HasSubstr("Hz"));
  EXPECT_THAT(message_of([&] { BlendPair(j, i, pair.warp()); }), HasSubstr("20 and 30 frames"));
  other = j;
  other.height.resize(3);
  EXPECT_THAT(message_of([&] { BlendPair(i, other, pair.warp()); }), HasSubstr("3 heights"));
}

}  // namespace
}  // namespace laban::blend
