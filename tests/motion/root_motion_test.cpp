#include "laban/motion/root_motion.h"

#include <gtest/gtest.h>

#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/retarget.h"
#include "support/clips.h"

#include "rigs.h"

namespace laban::motion {
namespace {

using Eigen::Vector3d;

TEST(RootMotion, InPlaceKeepsAllButTheTravelOverTheGround) {
  const Clip clip = test::random_motion(test::mixamo_skeleton(), 30, 5);
  const Humanoid humanoid = find_humanoid(clip);
  const Clip still = in_place(clip, humanoid);
  const PoseMatrix before = to_pose_matrix(clip, humanoid);
  const PoseMatrix after = to_pose_matrix(still, humanoid);
  EXPECT_TRUE(after.angles.isApprox(before.angles, 1e-9));
  EXPECT_TRUE(after.height.isApprox(before.height, 1e-9));
  EXPECT_TRUE(after.steps.row(2).isApprox(before.steps.row(2), 1e-9));  // turns
  EXPECT_GT(before.steps.topRows<2>().cwiseAbs().maxCoeff(), 0.01);
  EXPECT_LT(after.steps.topRows<2>().cwiseAbs().maxCoeff(), 1e-12);
  const PlanarPose start = planar_start(still, humanoid);
  EXPECT_NEAR(start.x, 0.0, 1e-12);
  EXPECT_NEAR(start.z, 0.0, 1e-12);
}

TEST(RootMotion, ARootJointTakesTravelAndTurnsAndMovesNothing) {
  const Clip clip = test::random_motion(test::mixamo_skeleton(), 30, 6);
  const Humanoid humanoid = find_humanoid(clip);
  const Clip moved = with_root_joint(clip, humanoid);
  ASSERT_EQ(moved.joint_count(), clip.joint_count() + 1);
  EXPECT_EQ(moved.skeleton().joint(0).name, "root");
  EXPECT_EQ(moved.skeleton().joint(1).name, "mixamorig:Hips");
  const PlanarPose start = planar_start(clip, humanoid);
  for (int f = 0; f < clip.frame_count(); ++f) {
    const ModelPose expected = forward_kinematics(clip, f);
    const ModelPose pose = forward_kinematics(moved, f);
    EXPECT_EQ(pose.positions(1, 0), 0.0);  // on the ground
    // It turns about the vertical only.
    EXPECT_LT((pose.rotations[0] * Vector3d::UnitY() - Vector3d::UnitY()).norm(), 1e-12);
    EXPECT_LT(
        (pose.positions.rightCols(clip.joint_count()) - expected.positions).cwiseAbs().maxCoeff(),
        1e-9);
    for (int j = 0; j < clip.joint_count(); ++j) {
      EXPECT_THAT(pose.rotations[static_cast<std::size_t>(j) + 1],
                  test::IsNearRotation(expected.rotations[static_cast<std::size_t>(j)], 1e-6));
    }
  }
  EXPECT_NEAR(math::heading_of(moved.rotation(0, 0)), start.yaw, 1e-9);
  EXPECT_NEAR(moved.root_positions()(0, 0), start.x * humanoid.leg_length_m(), 1e-9);
  EXPECT_NEAR(moved.root_positions()(2, 0), start.z * humanoid.leg_length_m(), 1e-9);
}

TEST(RootMotion, TheRigWithARootJointIsStillThePersonItWas) {
  const Clip clip = test::random_motion(test::mixamo_skeleton(), 20, 8);
  const Humanoid humanoid = find_humanoid(clip);
  const Clip moved = with_root_joint(clip, humanoid);
  const PoseMatrix before = to_pose_matrix(clip, humanoid);
  const PoseMatrix after = to_pose_matrix(moved, find_humanoid(moved));
  EXPECT_TRUE(after.angles.isApprox(before.angles, 1e-9));
  EXPECT_TRUE(after.steps.isApprox(before.steps, 1e-9));
}

}  // namespace
}  // namespace laban::motion
