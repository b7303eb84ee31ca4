#include "laban/motion/calm.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/motion/standard_body.h"
#include "laban/motion/standard_joint.h"

namespace laban::motion {
namespace {

constexpr double kRateHz = 60.0;
constexpr int kFrames = 240;

/// An upper arm that swings at 1 Hz and, in frames [begin, end), trembles at 12 Hz.
PoseMatrix swinging(int begin, int end) {
  PoseMatrix pose{kRateHz, 0.84, Eigen::MatrixXd::Zero(kAngleRowCount, kFrames),
                  Eigen::RowVectorXd::Constant(kFrames, 1.1), Eigen::Matrix3Xd::Zero(3, kFrames)};
  const int row = 3 * index_of(StandardJoint::kLeftUpperArm) + 2;
  for (int f = 0; f < kFrames; ++f) {
    const double t = f / kRateHz;
    const double tremor =
        f >= begin && f < end ? 0.05 * std::sin(2.0 * std::numbers::pi * 12.0 * t) : 0.0;
    pose.angles(row, f) = 0.5 * std::sin(2.0 * std::numbers::pi * t) + tremor;
  }
  return pose;
}

TEST(Calm, LeavesAMotionWithLittleJerkAsItIs) {
  const PoseMatrix pose = swinging(0, 0);
  EXPECT_EQ(calm(pose, rms_jerk_m_s3(pose)).angles, pose.angles);
  EXPECT_EQ(calm_locally(pose, local_jerk_m_s3(pose)).angles, pose.angles);
}

TEST(Calm, JerkOfAMotionIsBothMeasures) {
  for (const PoseMatrix& pose : {swinging(110, 130), swinging(0, 0).slice(0, 5)}) {
    const Jerk jerk = jerk_of(pose);
    EXPECT_GT(jerk.usual_m_s3, 0.0);
    EXPECT_DOUBLE_EQ(jerk.usual_m_s3, rms_jerk_m_s3(pose));
    EXPECT_NEAR(jerk.largest_m_s3, local_jerk_m_s3(pose).maxCoeff(), 1e-9 * jerk.largest_m_s3);
  }
  EXPECT_EQ(jerk_of(swinging(0, 0).slice(0, 3)).largest_m_s3, 0.0);
}

TEST(Calm, BringsJerkDownToTheLimitAndKeepsTheMovement) {
  const PoseMatrix pose = swinging(0, kFrames);
  const double most = 1.2 * rms_jerk_m_s3(swinging(0, 0));
  ASSERT_GT(rms_jerk_m_s3(pose), 3.0 * most);
  const PoseMatrix calmer = calm(pose, most);
  EXPECT_LE(rms_jerk_m_s3(calmer), most);
  EXPECT_LT((calmer.angles - swinging(0, 0).angles).cwiseAbs().maxCoeff(), 0.06);
}

TEST(Calm, ByBothMeasuresIsOneAfterTheOtherAndPlayedOnce) {
  const PoseMatrix smooth = swinging(0, 0);
  const Jerk own = jerk_of(smooth);
  const double never = 1e6;
  for (const PoseMatrix& pose : {swinging(0, kFrames), swinging(110, 130), smooth}) {
    for (const Jerk most : {Jerk{1.2 * own.usual_m_s3, 1.1 * own.largest_m_s3},
                            Jerk{1.2 * own.usual_m_s3, never}, Jerk{never, own.largest_m_s3}}) {
      const PosedMotion both = calm(pose, most);
      const PoseMatrix usual = calm(pose, most.usual_m_s3);
      const Eigen::RowVectorXd limits = Eigen::RowVectorXd::Constant(kFrames, most.largest_m_s3);
      EXPECT_EQ(both.pose.angles, calm_locally(usual, limits).angles);
      EXPECT_EQ(both.joint_positions, standard_joint_positions(both.pose));
    }
  }
}

TEST(Calm, LocallyChangesNothingFarFromWhatJerks) {
  const PoseMatrix pose = swinging(110, 130);
  const double most = 1.1 * local_jerk_m_s3(swinging(0, 0)).maxCoeff();
  const PoseMatrix calmer = calm_locally(pose, Eigen::RowVectorXd::Constant(kFrames, most));
  // 0.1 s of local jerk and 0.3 s of fading on either side.
  EXPECT_EQ(calmer.angles.leftCols(80), pose.angles.leftCols(80));
  EXPECT_EQ(calmer.angles.rightCols(80), pose.angles.rightCols(80));
  EXPECT_GT(local_jerk_m_s3(pose).maxCoeff(), 3.0 * most);
  EXPECT_LT(local_jerk_m_s3(calmer).maxCoeff(), 1.2 * most) << "mixing adds a little";
}

TEST(Calm, AnInfiniteLimitLeavesTheFrame) {
  const PoseMatrix pose = swinging(110, 130);
  const auto none = Eigen::RowVectorXd::Constant(kFrames, std::numeric_limits<double>::infinity());
  EXPECT_EQ(calm_locally(pose, none).angles, pose.angles);
}

TEST(Calm, TakesAFewFrames) {
  for (const int frames : {1, 2, 3, 4, 5}) {
    const PoseMatrix pose = swinging(0, kFrames).slice(0, frames);
    EXPECT_EQ(calm(pose, 0.0).frame_count(), frames);
    EXPECT_EQ(calm_locally(pose, Eigen::RowVectorXd::Zero(frames)).frame_count(), frames);
  }
}

TEST(Calm, SaysThatALimitAFrameIsNeeded) {
  try {
    (void)calm_locally(swinging(0, 0), Eigen::RowVectorXd::Zero(3));
    FAIL() << "no error";
  } catch (const base::Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("3 limits for 240 frames"));
  }
}

}  // namespace
}  // namespace laban::motion
