// Every rig we know by name: found, mapped, read and written. Names as in the sources that the
// builders in rigs.cpp name.

#include <algorithm>
#include <cctype>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/retarget.h"

#include "rigs.h"

namespace laban::motion {
namespace {

using test::kDegree;
using test::NamedRig;
using testing::HasSubstr;

std::string standard_name(StandardJoint joint) {
  return std::string(kStandardJointNames[static_cast<std::size_t>(index_of(joint))]);
}

/// The rig in the T-pose: arms raised by what its rest lets them hang.
Clip in_t_pose(const NamedRig& rig) {
  const auto joints = static_cast<std::size_t>(rig.skeleton.joint_count());
  std::vector<Eigen::Quaterniond> rotations(joints, Eigen::Quaterniond::Identity());
  for (const auto& [which, up] : {std::pair(StandardJoint::kLeftUpperArm, 1.0),
                                  std::pair(StandardJoint::kRightUpperArm, -1.0)}) {
    rotations[static_cast<std::size_t>(*rig.skeleton.find(rig.expected.at(which)))] =
        math::exp({0.0, 0.0, up * rig.arms_down_degrees * kDegree});
  }
  return {std::make_shared<const Skeleton>(rig.skeleton), 30.0, rig.skeleton.joint(0).rest_offset,
          std::move(rotations)};
}

TEST(RigTables, EachRigIsFoundWithEveryJoint) {
  for (const NamedRig& rig : test::upright_rigs()) {
    SCOPED_TRACE(rig.rig_name + ", " + rig.skeleton.joint(0).name);
    const Humanoid humanoid = find_humanoid(test::at_rest(rig.skeleton));
    EXPECT_EQ(humanoid.rig_name(), rig.rig_name);
    EXPECT_TRUE(humanoid.missing().empty());
    ASSERT_EQ(rig.expected.size(), static_cast<std::size_t>(kStandardJointCount));
    for (const auto& [which, name] : rig.expected) {
      ASSERT_TRUE(humanoid.mapped(which).has_value()) << standard_name(which);
      EXPECT_EQ(rig.skeleton.joint(humanoid.mapped(which)->joint).name, name)
          << standard_name(which);
    }
  }
}

TEST(RigTables, NamesAreKnownInAnyCaseAndWithAnySeparator) {
  for (const NamedRig& rig : test::upright_rigs()) {
    if (rig.skeleton.joint(0).name.find_first_of(":|-.") != std::string::npos) continue;
    SCOPED_TRACE(rig.rig_name);
    std::vector<Joint> joints = rig.skeleton.joints();
    for (Joint& joint : joints) {
      for (char& c : joint.name) {
        c = c == ' ' || c == '_' ? '-'
                                 : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
      }
      joint.name.insert(0, "actor_2:");
    }
    const Humanoid humanoid = find_humanoid(test::at_rest(Skeleton(std::move(joints))));
    EXPECT_EQ(humanoid.rig_name(), rig.rig_name);
    EXPECT_TRUE(humanoid.missing().empty());
  }
}

TEST(RigTables, TheTPoseReadsAsNoRotation) {
  for (const NamedRig& rig : test::upright_rigs()) {
    SCOPED_TRACE(rig.rig_name + ", " + rig.skeleton.joint(0).name);
    const Clip clip = in_t_pose(rig);
    const PoseMatrix pose = to_pose_matrix(clip, find_humanoid(test::at_rest(rig.skeleton)));
    EXPECT_LT(pose.angles.cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(RigTables, AnyMotionGoesThereAndBack) {
  std::vector<Skeleton> skeletons = {test::lafan_skeleton()};
  for (const NamedRig& rig : test::upright_rigs()) skeletons.push_back(rig.skeleton);
  for (const Skeleton& skeleton : skeletons) {
    SCOPED_TRACE(skeleton.joint(skeleton.joint_count() - 1).name);
    const Clip clip = test::random_motion(skeleton, 40, 3);
    const Humanoid humanoid = find_humanoid(clip);
    const Clip again = from_pose_matrix(to_pose_matrix(clip, humanoid), humanoid, clip);
    for (int f = 0; f < clip.frame_count(); f += 3) {
      const ModelPose before = forward_kinematics(clip, f);
      const ModelPose after = forward_kinematics(again, f);
      EXPECT_LT((before.positions - after.positions).colwise().norm().maxCoeff(), 1e-6);
      for (std::size_t j = 0; j < before.rotations.size(); ++j) {
        EXPECT_LT(math::angle_between(before.rotations[j], after.rotations[j]), 0.5 * kDegree);
      }
    }
  }
}

// The first frame of the data set's files is a T-pose to the eye: elbows and knees bend by 10 to 30
// degrees, the right way, and no other joint is off by more.
TEST(RigTables, Lafan1IsReadFromItsOwnZeroPose) {
  const Clip clip = test::lafan_first_frame();
  const Humanoid humanoid = find_humanoid(clip);
  EXPECT_EQ(humanoid.rig_name(), "lafan1");
  EXPECT_TRUE(humanoid.missing().empty());
  const PoseMatrix pose = to_pose_matrix(clip, humanoid);
  for (int s = 0; s < kStandardJointCount; ++s) {
    const Eigen::Vector3d angles = pose.angles.block<3, 1>(3 * s, 0);
    EXPECT_LT(angles.norm(), 32.0 * kDegree) << standard_name(static_cast<StandardJoint>(s));
  }
  const auto angles = [&](StandardJoint joint) -> Eigen::Vector3d {
    return pose.angles.block<3, 1>(3 * index_of(joint), 0);
  };
  EXPECT_GT(angles(StandardJoint::kLeftShin).x(), 5.0 * kDegree);
  EXPECT_GT(angles(StandardJoint::kRightShin).x(), 5.0 * kDegree);
  EXPECT_LT(angles(StandardJoint::kLeftForearm).y(), -15.0 * kDegree);
  EXPECT_GT(angles(StandardJoint::kRightForearm).y(), 15.0 * kDegree);
}

// The same names on a body that stands upright at rest are not LAFAN1's.
TEST(RigTables, Lafan1IsKnownByItsBonesToo) {
  const std::vector<NamedRig> rigs = test::upright_rigs();
  const auto plain = std::find_if(rigs.begin(), rigs.end(), [](const NamedRig& rig) {
    return rig.skeleton.joint(0).name == "Hips" && rig.rig_name == "motionbuilder";
  });
  ASSERT_NE(plain, rigs.end());
  std::vector<Joint> joints = plain->skeleton.joints();
  for (Joint& joint : joints) {
    if (joint.name == "LeftToeBase") joint.name = "LeftToe";
    if (joint.name == "RightToeBase") joint.name = "RightToe";
  }
  EXPECT_EQ(find_humanoid(test::at_rest(Skeleton(std::move(joints)))).rig_name(), "motionbuilder");
}

TEST(RigTables, SaysTheWayOutWhereNoneFits) {
  std::vector<Joint> joints;
  for (int i = 0; i < 80; ++i)
    joints.push_back({"bone" + std::to_string(i), i - 1, {0, 0.1, 0}, {}});
  joints[7].name = "Pelvis";
  try {
    (void)find_humanoid(test::at_rest(Skeleton(std::move(joints))));
    FAIL();
  } catch (const base::Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("no joint of the skeleton plays spine, chest"));
    EXPECT_THAT(error.what(), HasSubstr("(nearest name table: "));
    EXPECT_THAT(error.what(), HasSubstr("name the joints that do in a JSON file (--map)"));
    EXPECT_THAT(error.what(), HasSubstr("'bone59' and 20 more"));
  }
}

}  // namespace
}  // namespace laban::motion
