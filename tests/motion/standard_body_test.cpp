#include "laban/motion/standard_body.h"

#include <gtest/gtest.h>

#include "laban/motion/forward_kinematics.h"
#include "support/clips.h"

namespace laban::motion {
namespace {

/// Largest distance, metres, from where forward kinematics of the standard clip puts a joint.
double farthest(const PoseMatrix& pose, const PlanarPose& start) {
  const Eigen::Matrix3Xd joints = joint_positions(to_standard_clip(pose, start));
  const Eigen::MatrixXd positions = standard_joint_positions(pose, start);
  EXPECT_EQ(positions.rows(), 3 * kStandardJointCount);
  EXPECT_EQ(positions.cols(), pose.frame_count());
  return (Eigen::Map<const Eigen::MatrixXd>(joints.data(), positions.rows(), positions.cols()) -
          positions)
      .cwiseAbs()
      .maxCoeff();
}

TEST(StandardBody, JointPositionsAreThoseOfTheStandardClip) {
  for (const int frames : {1, 2, 7, 8, 9, 40}) {
    EXPECT_LT(farthest(test::random_pose_matrix({.frames = frames}), {}), 1e-13) << frames;
    EXPECT_LT(farthest(test::random_pose_matrix({.frames = frames, .seed = 2}), {1.5, -2.0, 0.7}),
              1e-13)
        << frames;
  }
}

TEST(StandardBody, JointPositionsKnowSmallLargeAndManyTurns) {
  for (const double scale : {0.0, 1e-9, 1e-4, 1.0, 5.0, 12.0}) {
    PoseMatrix pose = test::random_pose_matrix({.frames = 20});
    pose.angles *= scale;
    pose.steps.row(2).setConstant(scale);  // a yaw of many turns
    EXPECT_LT(farthest(pose, {}), 1e-12) << scale;
  }
}

}  // namespace
}  // namespace laban::motion
