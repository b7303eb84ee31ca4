#include "laban/motion/join.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "support/clips.h"

namespace laban::motion {
namespace {

constexpr double kPi = std::numbers::pi;

PoseMatrix random_pose(int frames, unsigned seed) {
  return test::random_pose_matrix({.frames = frames, .seed = seed});
}

/// A pose that stands still; the root too.
PoseMatrix still(int frames, double angle = 0.0, double height = 1.0) {
  PoseMatrix pose;
  pose.frame_rate_hz = 60.0;
  pose.leg_length_m = 0.84;
  pose.angles = Eigen::MatrixXd::Constant(kAngleRowCount, frames, angle);
  pose.height = Eigen::RowVectorXd::Constant(frames, height);
  pose.steps = Eigen::Matrix3Xd::Zero(3, frames);
  return pose;
}

PoseMatrix join(const std::vector<PoseMatrix>& parts, const JoinOptions& options = {}) {
  return concatenate(parts, options);
}

double difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return 1e300;
  return (a - b).cwiseAbs().maxCoeff();
}

Eigen::MatrixXd second_differences(const Eigen::MatrixXd& rows) {
  const auto count = rows.cols() - 2;
  return rows.rightCols(count) - 2.0 * rows.middleCols(1, count) + rows.leftCols(count);
}

TEST(Join, OnePartIsReturnedAsItIs) {
  const PoseMatrix pose = random_pose(30, 1);
  const PoseMatrix joined = join({pose});
  EXPECT_EQ(joined.angles, pose.angles);
  EXPECT_EQ(joined.height, pose.height);
  EXPECT_EQ(joined.steps, pose.steps);
  EXPECT_EQ(joined.leg_length_m, pose.leg_length_m);
}

TEST(Join, AClipCutInPiecesComesBack) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    PoseMatrix clip = random_pose(150, seed);
    // A steady walk on a circle: the step over a cut, which slices lose, is known from its sides.
    clip.steps = Eigen::Vector3d(0.001, 0.02, 0.03).replicate(1, 150);
    const PoseMatrix joined =
        join({clip.slice(0, 40 + static_cast<int>(seed)),
              clip.slice(40 + static_cast<int>(seed), 90), clip.slice(90, 150)});
    EXPECT_EQ(joined.angles, clip.angles) << seed;
    EXPECT_EQ(joined.height, clip.height) << seed;
    EXPECT_LT(difference(joined.steps, clip.steps), 1e-15) << seed;
    EXPECT_LT(difference(planar_path(joined), planar_path(clip)), 1e-12) << seed;
  }
}

TEST(Join, AWindingRootPathComesBackButForHalfTheBendOfOneStep) {
  const PoseMatrix clip = random_pose(120, 3);
  const PoseMatrix joined = join({clip.slice(0, 61), clip.slice(61, 120)});
  Eigen::Matrix3Xd steps = joined.steps;
  EXPECT_LT(
      (steps.col(61) - clip.steps.col(61)).norm(),
      0.5 * (clip.steps.col(62) - 2.0 * clip.steps.col(61) + clip.steps.col(60)).norm() + 1e-12);
  steps.col(61) = clip.steps.col(61);
  EXPECT_LT(difference(steps, clip.steps), 1e-15);
}

TEST(Join, AStepOfPoseIsSharedAndDecaysAsACriticallyDampedSpring) {
  const PoseMatrix joined = join({still(60, 0.0, 1.0), still(60, 0.0, 1.1)}, {.halflife_s = 0.1});
  const auto offset = [&](int f) { return joined.height(60 + f) - 1.1; };
  // Both sides stand still, so the join stands half-way for two frames on either side, then leaves.
  EXPECT_NEAR(offset(0), -0.05, 1e-12);
  EXPECT_NEAR(offset(1), -0.05, 1e-12);
  // Half-life of 6 frames after a start at rest (half a frame of doubt where the rest ends).
  EXPECT_LT(offset(6), -0.025);
  EXPECT_GT(offset(8), -0.025);
  for (int f = 2; f < 60; ++f) {
    EXPECT_GT(offset(f), offset(f - 1)) << "comes nearer, never over";
    EXPECT_LE(offset(f), 0.0);
  }
  EXPECT_NEAR(offset(59), 0.0, 1e-5);
  for (int f = 0; f < 60; ++f) {
    EXPECT_NEAR(joined.height(59 - f) - 1.0, -offset(f), 1e-12) << "the part before as the new one";
  }
}

PoseMatrix reversed(const PoseMatrix& pose) {
  PoseMatrix back = pose;
  back.angles = pose.angles.rowwise().reverse();
  back.height = pose.height.reverse();
  return back;
}

TEST(Join, IsTheSameBackwards) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const PoseMatrix a = random_pose(60, seed);
    const PoseMatrix b = random_pose(80, 100 + seed);
    const PoseMatrix forwards = join({a, b});
    const PoseMatrix backwards = reversed(join({reversed(b), reversed(a)}));
    EXPECT_LT(difference(forwards.angles, backwards.angles), 1e-12) << seed;
    EXPECT_LT(difference(forwards.height, backwards.height), 1e-12) << seed;
  }
}

// No jump: at the join each row bends no more than 1.25 times its parts do near it, and after it no
// more than that plus what the spring itself needs, y^2 offset.
TEST(Join, VelocityIsContinuousAtJoins) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    const PoseMatrix a = random_pose(60, seed);
    PoseMatrix b = random_pose(70, 100 + seed);
    b.height.array() += 0.2;
    const PoseMatrix joined = join({a, b});
    const auto bend_a = second_differences(a.angles);
    const auto bend_b = second_differences(b.angles);
    const auto bend = second_differences(joined.angles);
    for (int row = 0; row < kAngleRowCount; row += 3) {
      const double own = std::max(bend_a.middleRows(row, 3).colwise().norm().maxCoeff(),
                                  bend_b.middleRows(row, 3).colwise().norm().maxCoeff());
      for (const int f : {58, 59}) {  // around frames 59 and 60, on either side of the cut
        EXPECT_LE(bend.col(f).segment(row, 3).norm(), 1.25 * own + 1e-9);
      }
    }
    const double own_height = std::max(second_differences(a.height).cwiseAbs().maxCoeff(),
                                       second_differences(b.height).cwiseAbs().maxCoeff());
    const auto bend_height = second_differences(joined.height);
    EXPECT_LE(std::abs(bend_height(58)), 1.25 * own_height + 1e-12);
    EXPECT_LE(std::abs(bend_height(59)), 1.25 * own_height + 1e-12);
    const double y = 1.678 / 6.0;
    EXPECT_LE(bend_height.cwiseAbs().maxCoeff(), 1.25 * own_height + y * y * 0.25);
  }
}

TEST(Join, StepsChangeNoFasterThanInTheParts) {
  PoseMatrix walk = still(60);
  walk.steps.row(1).setConstant(0.03);
  const PoseMatrix joined = join({still(60), walk, still(60)});
  // Nothing in the parts speeds up, so the root starts and stops smoothly: half of it in the part
  // that stands.
  const Eigen::RowVectorXd speed = joined.steps.row(1);
  for (const int f : {59, 60, 61}) EXPECT_NEAR(speed(f), 0.015, 1e-6) << f;
  const double y = 1.678 / 6.0;
  for (int f = 1; f < 180; ++f) {
    EXPECT_LT(std::abs(speed(f) - speed(f - 1)), 0.015 * y / std::numbers::e * 1.1) << f;
  }
  EXPECT_NEAR(speed(1), 0.0, 1e-6);
  EXPECT_NEAR(speed(90), 0.03, 1e-4);
  EXPECT_NEAR(speed(179), 0.0, 1e-6);
  EXPECT_NEAR(speed.sum(), 60 * 0.03, 0.03) << "what one part gains in distance the other loses";
}

TEST(Join, PartsAreUnchangedFarFromTheJoin) {
  const PoseMatrix a = random_pose(150, 4);
  const PoseMatrix b = random_pose(150, 5);
  const PoseMatrix joined = join({a, b});
  // After 15 half-lives, (1 + 25) e^-25.
  EXPECT_LT(difference(joined.angles.leftCols(60), a.angles.leftCols(60)), 1e-8);
  EXPECT_LT(difference(joined.height.head(60), a.height.head(60)), 1e-9);
  EXPECT_LT(difference(joined.steps.leftCols(60), a.steps.leftCols(60)), 1e-9);
  EXPECT_LT(difference(joined.angles.rightCols(60), b.angles.rightCols(60)), 1e-8);
  EXPECT_LT(difference(joined.height.tail(60), b.height.tail(60)), 1e-9);
  EXPECT_LT(difference(joined.steps.rightCols(60), b.steps.rightCols(60)), 1e-9);
}

TEST(Join, AJointContinuesOnItsBranch) {
  PoseMatrix a = still(40);
  PoseMatrix b = still(80);
  for (int f = 0; f < 40; ++f) a.angles(30, f) = 2.9 + 0.005 * f;  // 2.9 .. 3.095
  for (int f = 0; f < 80; ++f) b.angles(30, f) = 3.1 + 0.005 * f - 2.0 * kPi;
  const PoseMatrix joined = join({a, b});
  for (int f = 0; f < 120; ++f) EXPECT_NEAR(joined.angles(30, f), 2.9 + 0.005 * f, 1e-9) << f;
}

TEST(Join, ATurnOfNearlyHalfDecaysTheShortWay) {
  // 3 rad one way and 3 the other are 0.28 rad apart; b then runs back through 0.
  PoseMatrix a = still(40);
  PoseMatrix b = still(120);
  a.angles.row(30).setConstant(3.0);
  for (int f = 0; f < 120; ++f) b.angles(30, f) = -3.0 * std::cos(0.02 * f);
  const PoseMatrix joined = join({a, b});
  for (int f = 1; f < 160; ++f) {
    const auto rotation = [&](int frame) {
      return math::exp(joined.angles.block<3, 1>(30, frame));
    };
    EXPECT_LT(math::angle_between(rotation(f - 1), rotation(f)), 0.1) << f;
  }
}

// The offset passes half a turn between the part's first two frames: as the shortest rotation it
// would point the other way in the second, and the joint would whirl.
TEST(Join, AnOffsetThatPassesHalfATurnKeepsItsWay) {
  const PoseMatrix before = still(30);
  PoseMatrix after = still(60);
  for (int f = 0; f < 60; ++f) after.angles(1, f) = kPi - 0.01 + 0.02 * f;
  const PoseMatrix joined = join({before, after});
  for (int f = 1; f < joined.frame_count(); ++f) {
    // pi y / e at most and the part's own pace, y = 1.68 / 6 frames.
    EXPECT_LT((joined.angles.col(f) - joined.angles.col(f - 1)).norm(), 0.36) << f;
  }
}

TEST(Join, ShortPartsAreJoinedToo) {
  const PoseMatrix joined =
      join({still(1, 0.0), still(1, 0.1), still(2, 0.2), random_pose(2, 7), random_pose(1, 8)});
  EXPECT_EQ(joined.frame_count(), 7);
  EXPECT_TRUE(joined.angles.allFinite());
  EXPECT_TRUE(joined.height.allFinite());
  EXPECT_TRUE(joined.steps.allFinite());
  EXPECT_EQ(joined.steps.col(0), joined.steps.col(1));
}

TEST(Join, OffsetsReachOverShortParts) {
  // A jump, then a part too short to forget it, then the same pose again: no second jump.
  const PoseMatrix joined = join({still(30, 0.0), still(3, 0.3), still(60, 0.3)});
  const auto bend = second_differences(joined.angles.row(30));
  const double y = 1.678 / 6.0;
  EXPECT_LE(bend.cwiseAbs().maxCoeff(), 2.0 * y * y * 0.3);
}

TEST(Join, SaysWhatIsWrong) {
  using testing::HasSubstr;
  const auto message_of = [](const std::vector<PoseMatrix>& parts,
                             const JoinOptions& options = {}) {
    try {
      (void)concatenate(parts, options);
    } catch (const base::Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(message_of({}), HasSubstr("no part"));
  EXPECT_THAT(message_of({still(3)}, {.halflife_s = 0.0}), HasSubstr("halflife_s"));
  EXPECT_THAT(message_of({still(3)}, {.halflife_s = std::numeric_limits<double>::quiet_NaN()}),
              HasSubstr("halflife_s"));
  PoseMatrix other = still(3);
  other.frame_rate_hz = 30.0;
  EXPECT_THAT(message_of({still(3), other}), HasSubstr("part 1 has 30"));
  other = still(3);
  other.height.resize(2);
  EXPECT_THAT(message_of({still(3), other}), HasSubstr("part 1 has 63 x 3 angles, 2 heights"));
}

}  // namespace
}  // namespace laban::motion
