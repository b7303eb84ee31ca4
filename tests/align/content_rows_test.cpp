#include "align/content_rows.h"

#include <gtest/gtest.h>

#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::align {
namespace {

using laban::test::random_pose_matrix;
using motion::PoseMatrix;

// Oracle: forward kinematics of the clip that stands still.
TEST(JointPlaces, AreThoseOfTheStandardBodySeenFromItsHips) {
  PoseMatrix pose = random_pose_matrix({.frames = 7, .amplitude_rad = 0.8});
  pose.steps.setZero();
  const Eigen::MatrixXd places = joint_places(pose);
  const Eigen::Matrix3Xd all = motion::joint_positions(motion::to_standard_clip(pose));
  ASSERT_EQ(places.rows(), 60);
  ASSERT_EQ(places.cols(), 7);
  for (int t = 0; t < 7; ++t) {
    for (int joint = 1; joint < motion::kStandardJointCount; ++joint) {
      const Eigen::Vector3d expected = (all.col(t * motion::kStandardJointCount + joint) -
                                        all.col(t * motion::kStandardJointCount)) /
                                       motion::kStandardLegLengthM;
      EXPECT_LT((places.col(t).segment<3>(3 * (joint - 1)) - expected).norm(), 1e-12);
    }
  }
}

TEST(JointPlaces, TellNeitherPlaceNorHeadingNorHeight) {
  const PoseMatrix pose = random_pose_matrix({.frames = 5});
  PoseMatrix elsewhere = pose;
  elsewhere.steps.array() += 0.3;
  elsewhere.height.array() += 0.2;
  EXPECT_EQ(joint_places(elsewhere), joint_places(pose));
}

// At 50 Hz 0.1 s are 5 frames on either side: 11 values, fewer at the ends.
TEST(Travel, IsTheMedianSpeedAround) {
  PoseMatrix pose = random_pose_matrix({.frames = 20});
  pose.frame_rate_hz = 50.0;
  for (int t = 0; t < 20; ++t) pose.steps.col(t) << 0.001 * t, 0.02, 9.0;
  const Eigen::MatrixXd rates = travel(pose);
  ASSERT_EQ(rates.rows(), 2);
  EXPECT_NEAR(rates(0, 10), 50.0 * 0.010, 1e-12);
  EXPECT_NEAR(rates(0, 0), 50.0 * 0.003, 1e-12);   // of 0 .. 5 the upper middle
  EXPECT_NEAR(rates(0, 19), 50.0 * 0.017, 1e-12);  // of 14 .. 19
  EXPECT_NEAR(rates(1, 7), 1.0, 1e-12);
}

TEST(Travel, DoesNotSeeTheOneStepAcrossACut) {
  PoseMatrix pose = random_pose_matrix({.frames = 30});
  pose.steps.setConstant(0.01);
  const Eigen::MatrixXd before = travel(pose);
  pose.steps.col(15) << 4.0, -7.0, 2.0;
  EXPECT_EQ(travel(pose), before);
}

}  // namespace
}  // namespace laban::align
