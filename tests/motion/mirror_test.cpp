#include "laban/motion/mirror.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/retarget.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

#include "rigs.h"

namespace laban::motion {
namespace {

using Eigen::Vector3d;

Vector3d mirror_image(const Vector3d& v) {
  return {-v.x(), v.y(), v.z()};
}

/// The joint of the Mixamo character on the other side, found by hand.
int other_side(const Skeleton& skeleton, int joint) {
  std::string name = skeleton.joint(joint).name;
  if (const auto at = name.find("Left"); at != std::string::npos) {
    name.replace(at, 4, "Right");
  } else if (const auto right = name.find("Right"); right != std::string::npos) {
    name.replace(right, 5, "Left");
  }
  return *skeleton.find(name);
}

TEST(Mirror, EveryJointIsWhereTheMirrorShowsTheOneOfTheOtherSide) {
  // The character is symmetric but for nothing: fingers, which play no part, included.
  const Clip clip = test::random_motion(test::mixamo_skeleton(), 40, 7);
  const Clip mirror = mirrored(clip, find_humanoid(clip));
  ASSERT_EQ(mirror.frame_count(), clip.frame_count());
  for (int f = 0; f < clip.frame_count(); ++f) {
    const Eigen::Matrix3Xd expected = forward_kinematics(clip, f).positions;
    const Eigen::Matrix3Xd positions = forward_kinematics(mirror, f).positions;
    for (int j = 0; j < clip.joint_count(); ++j) {
      const Vector3d seen = mirror_image(expected.col(other_side(clip.skeleton(), j)));
      EXPECT_LT((positions.col(j) - seen).norm(), 1e-9) << clip.skeleton().joint(j).name << f;
    }
  }
}

TEST(Mirror, TwiceIsTheClipItself) {
  const Clip clip = test::random_motion(test::mixamo_skeleton(), 30, 3);
  const Humanoid humanoid = find_humanoid(clip);
  const Clip again = mirrored(mirrored(clip, humanoid), humanoid);
  for (int f = 0; f < clip.frame_count(); ++f) {
    EXPECT_LT((again.root_positions().col(f) - clip.root_positions().col(f)).norm(), 1e-12);
    for (int j = 0; j < clip.joint_count(); ++j) {
      EXPECT_THAT(again.rotation(f, j), test::IsNearRotation(clip.rotation(f, j), 1e-6));
    }
  }
}

TEST(Mirror, CarriesAnimatedOffsetsToTheOtherSide) {
  const Clip still = test::at_rest(test::mixamo_skeleton());
  const Skeleton& skeleton = still.skeleton();
  Eigen::Matrix3Xd translations(3, skeleton.joint_count());
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    translations.col(j) = still.translation(0, j);
  }
  const int left = *skeleton.find("mixamorig:LeftHand");
  const int right = *skeleton.find("mixamorig:RightHand");
  const Vector3d moved(0.02, 0.03, 0.05);
  translations.col(left) += moved;
  const Clip clip(still.shared_skeleton(), 30.0, still.root_positions(),
                  {still.rotations(0).begin(), still.rotations(0).end()}, translations);
  const Clip mirror = mirrored(clip, find_humanoid(clip));
  EXPECT_LT((mirror.translation(0, left) - skeleton.joint(left).rest_offset).norm(), 1e-12);
  EXPECT_LT((mirror.translation(0, right) - skeleton.joint(right).rest_offset - mirror_image(moved))
                .norm(),
            1e-12);
}

TEST(Mirror, FindsTheOtherSideInEveryWayOfNaming) {
  // A joint below each hand that plays no part, named as rigs do, turned on the left only.
  const std::vector<std::pair<std::string, std::string>> kWays = {
      {"LeftHandThumb1", "RightHandThumb1"},  {"thumb.01.L", "thumb.01.R"}, {"thumb_l", "thumb_r"},
      {"Bip01 L Finger0", "Bip01 R Finger0"}, {"lThumb1", "rThumb1"},       {"LThumb", "RThumb"}};
  for (const auto& [left_name, right_name] : kWays) {
    SCOPED_TRACE(left_name);
    std::vector<Joint> joints = standard_skeleton()->joints();
    const int left = static_cast<int>(joints.size());
    const Vector3d offset(0.1, 0.0, 0.0);
    joints.push_back({left_name, index_of(StandardJoint::kLeftHand), offset, std::nullopt});
    joints.push_back({right_name, index_of(StandardJoint::kRightHand), -offset, std::nullopt});
    const Clip rest = test::at_rest(Skeleton(std::move(joints)));
    std::vector<Eigen::Quaterniond> rotations(rest.rotations(0).begin(), rest.rotations(0).end());
    rotations[static_cast<std::size_t>(left)] = math::exp({0.1, 0.2, 0.3});
    const Clip clip(rest.shared_skeleton(), 30.0, rest.root_positions(), rotations);
    const Clip mirror = mirrored(clip, find_humanoid(clip));
    EXPECT_THAT(mirror.rotation(0, left),
                test::IsNearRotation(Eigen::Quaterniond::Identity(), 1e-9));
    EXPECT_THAT(mirror.rotation(0, left + 1),
                test::IsNearRotation(math::exp({0.1, -0.2, -0.3}), 1e-9));
  }
}

TEST(Mirror, RefusesAHumanoidOfAnotherSkeleton) {
  const Clip clip = test::random_motion(test::mixamo_skeleton(), 2, 1);
  const Humanoid other = find_humanoid(test::at_rest(*standard_skeleton()));
  EXPECT_THROW((void)mirrored(clip, other), base::Error);
}

}  // namespace
}  // namespace laban::motion
