#include "laban/motion/pose_matrix.h"

#include <gtest/gtest.h>

#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::motion {
namespace {

TEST(PoseMatrix, StepsOfAnIntegratedPathAreTheStepsAgain) {
  const PoseMatrix pose = test::random_pose_matrix({.frames = 60});
  const Eigen::Matrix3Xd path = planar_path(pose, {.x = 1.0, .z = -2.0, .yaw = 0.7});
  EXPECT_LT((planar_steps(path) - pose.steps).norm(), 1e-12);
}

TEST(PoseMatrix, TheRestPoseStandsOnTheFloor) {
  PoseMatrix pose;
  pose.frame_rate_hz = 60.0;
  pose.leg_length_m = 0.84;
  pose.angles = Eigen::MatrixXd::Zero(kAngleRowCount, 1);
  pose.height = Eigen::RowVectorXd::Constant(1, 0.98 / kStandardLegLengthM);
  pose.steps = Eigen::Matrix3Xd::Zero(3, 1);
  const auto model = forward_kinematics(to_standard_clip(pose), 0);
  EXPECT_NEAR(model.positions(1, index_of(StandardJoint::kLeftToe)), 0.02,
              1e-12);                                                      // toe end site at 0
  EXPECT_GT(model.positions(0, index_of(StandardJoint::kLeftHand)), 0.5);  // left is +X
}

}  // namespace
}  // namespace laban::motion
