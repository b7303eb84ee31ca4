#include "laban/motion/inverse_kinematics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::motion {
namespace {

using Eigen::Matrix3Xd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Where the joints come to lie by those rotations.
Matrix3Xd reach(const Skeleton& skeleton, const Vector3d& root,
                const std::vector<Quaterniond>& rotations) {
  Matrix3Xd positions(3, skeleton.joint_count());
  positions.col(0) = root;
  for (int j = 1; j < skeleton.joint_count(); ++j) {
    const int parent = skeleton.joint(j).parent;
    positions.col(j) = positions.col(parent) +
                       rotations[static_cast<std::size_t>(parent)] * skeleton.joint(j).rest_offset;
  }
  return positions;
}

class InverseKinematics : public ::testing::Test {
 protected:
  const Clip clip_ = to_standard_clip(test::random_pose_matrix({.frames = 20}));
  const Skeleton& body_ = clip_.skeleton();
};

TEST_F(InverseKinematics, IsTheInverseOfForwardKinematics) {
  for (int f = 0; f < clip_.frame_count(); ++f) {
    const ModelPose pose = forward_kinematics(clip_, f);
    const auto rotations = rotations_from_positions(body_, pose.positions, pose.rotations);
    for (std::size_t j = 0; j < rotations.size(); ++j) {
      EXPECT_THAT(rotations[j], test::IsNearRotation(pose.rotations[j], 1e-6)) << f << ' ' << j;
    }
  }
}

TEST_F(InverseKinematics, PositionsAreMetWhateverTheGuideSaysOfBonesThatFit) {
  const ModelPose pose = forward_kinematics(clip_, 3);
  std::vector<Quaterniond> guide = pose.rotations;
  const Quaterniond off(Eigen::AngleAxisd(0.5, Vector3d(1.0, 2.0, 0.5).normalized()));
  for (Quaterniond& q : guide) q = off * q;
  const auto rotations = rotations_from_positions(body_, pose.positions, guide);
  const Matrix3Xd reached = reach(body_, pose.positions.col(0), rotations);
  // Joints of several bones keep a thousandth of the guide: half a radian moves them by less.
  EXPECT_LT((reached - pose.positions).colwise().norm().maxCoeff(), 2e-3);
}

TEST_F(InverseKinematics, LengthsThatDoNotFitMakeNoErrorThatGrowsAlongALimb) {
  const ModelPose pose = forward_kinematics(clip_, 5);
  // The whole body 3 % smaller around the hips: the hands are off by about what one bone is.
  const Matrix3Xd smaller =
      (0.97 * (pose.positions.colwise() - pose.positions.col(0))).colwise() + pose.positions.col(0);
  const auto rotations = rotations_from_positions(body_, smaller, pose.rotations);
  const Matrix3Xd reached = reach(body_, smaller.col(0), rotations);
  for (int j = 1; j < body_.joint_count(); ++j) {
    const double bone = body_.joint(j).rest_offset.norm();
    const double around =
        (reached.col(body_.joint(j).parent) - smaller.col(body_.joint(j).parent)).norm();
    EXPECT_LE((reached.col(j) - smaller.col(j)).norm(), 0.03 * bone + 1.5 * around + 0.012) << j;
  }
}

TEST_F(InverseKinematics, FollowsPlacesWithoutFlips) {
  std::vector<Quaterniond> before;
  for (int f = 0; f < clip_.frame_count(); ++f) {
    const ModelPose pose = forward_kinematics(clip_, f);
    auto now = rotations_from_positions(body_, pose.positions, pose.rotations);
    for (std::size_t j = 0; j < before.size(); ++j) {
      EXPECT_LT(math::angle_between(before[j], now[j]), 0.5) << f << ' ' << j;
    }
    before = std::move(now);
  }
}

TEST_F(InverseKinematics, APlaceOnTheJointItselfLeavesTheGuide) {
  ModelPose pose = forward_kinematics(clip_, 0);
  const int forearm = index_of(StandardJoint::kLeftForearm);
  const int hand = index_of(StandardJoint::kLeftHand);
  pose.positions.col(hand) = pose.positions.col(forearm);
  const auto rotations = rotations_from_positions(body_, pose.positions, pose.rotations);
  EXPECT_THAT(rotations[static_cast<std::size_t>(forearm)],
              test::IsNearRotation(pose.rotations[static_cast<std::size_t>(forearm)], 1e-3));
}

TEST_F(InverseKinematics, RefusesWhatDoesNotFitTheSkeleton) {
  const ModelPose pose = forward_kinematics(clip_, 0);
  EXPECT_THROW((void)rotations_from_positions(body_, pose.positions.leftCols(3), pose.rotations),
               base::Error);
  Matrix3Xd broken = pose.positions;
  broken(1, 4) = std::nan("");
  EXPECT_THROW((void)rotations_from_positions(body_, broken, pose.rotations), base::Error);
}

}  // namespace
}  // namespace laban::motion
