#include "laban/motion/humanoid.h"

#include <filesystem>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/standard_body.h"

#include "captures.h"
#include "rigs.h"

namespace laban::motion {
namespace {

using Eigen::Vector3d;
using test::at_rest;
using test::kDegree;
using test::mixamo_skeleton;
using testing::AllOf;
using testing::HasSubstr;

Skeleton renamed(const Skeleton& skeleton, const std::string& from, const std::string& to) {
  std::vector<Joint> joints = skeleton.joints();
  for (Joint& joint : joints) {
    if (joint.name == from) joint.name = to;
  }
  return Skeleton(std::move(joints));
}

TEST(Humanoid, TheStandardBodyIsItsOwnReference) {
  const Humanoid humanoid = find_humanoid(at_rest(*standard_skeleton()));
  EXPECT_EQ(humanoid.rig_name(), "standard");
  EXPECT_TRUE(humanoid.missing().empty());
  EXPECT_NEAR(humanoid.leg_length_m(), kStandardLegLengthM, 1e-12);
  EXPECT_LT(humanoid.root_point().norm(), 1e-12);
  for (int s = 0; s < kStandardJointCount; ++s) {
    const auto& mapped = humanoid.mapped(static_cast<StandardJoint>(s));
    ASSERT_TRUE(mapped.has_value());
    EXPECT_EQ(mapped->joint, s);
    EXPECT_LT(math::angle_between(mapped->reference, Eigen::Quaterniond::Identity()), 1e-12) << s;
  }
}

TEST(Humanoid, FindsMixamoBehindItsPrefix) {
  const Skeleton skeleton = mixamo_skeleton();
  const Humanoid humanoid = find_humanoid(at_rest(skeleton));
  EXPECT_EQ(humanoid.rig_name(), "mixamo");
  EXPECT_FALSE(humanoid.has_t_pose_frame());
  const auto name = [&](StandardJoint which) {
    return skeleton.joint(humanoid.mapped(which)->joint).name;
  };
  EXPECT_EQ(name(StandardJoint::kChest), "mixamorig:Spine2");
  EXPECT_EQ(name(StandardJoint::kLeftForearm), "mixamorig:LeftForeArm");
  EXPECT_EQ(name(StandardJoint::kRightToe), "mixamorig:RightToeBase");
  EXPECT_EQ(humanoid.played_by(humanoid.mapped(StandardJoint::kHead)->joint), StandardJoint::kHead);
  EXPECT_EQ(humanoid.played_by(*skeleton.find("mixamorig:Spine1")), std::nullopt);
}

TEST(Humanoid, NamesMayDifferInCaseAndSeparators) {
  Skeleton skeleton = mixamo_skeleton();
  std::vector<Joint> joints = skeleton.joints();
  for (Joint& joint : joints) joint.name = "mixamorig12_" + joint.name.substr(10);
  EXPECT_EQ(find_humanoid(at_rest(Skeleton(std::move(joints)))).rig_name(), "mixamo");
}

TEST(Humanoid, AbsentOptionalJointsAreListed) {
  const Skeleton skeleton = renamed(renamed(mixamo_skeleton(), "mixamorig:LeftShoulder", "x"),
                                    "mixamorig:RightToeBase", "y");
  EXPECT_THAT(find_humanoid(at_rest(skeleton)).missing(),
              testing::ElementsAre(StandardJoint::kLeftClavicle, StandardJoint::kRightToe));
}

TEST(Humanoid, NamesWhatItCouldNotFindAndWhatItSaw) {
  const Skeleton skeleton = renamed(mixamo_skeleton(), "mixamorig:LeftLeg", "plank");
  try {
    (void)find_humanoid(at_rest(skeleton));
    FAIL();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kData);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("plays left_shin (nearest name table: mixamo)"),
                                    HasSubstr("'plank'"), HasSubstr("'mixamorig:Hips'")));
  }
}

TEST(Humanoid, TheUsersNamesGoFirst) {
  const Skeleton skeleton = renamed(mixamo_skeleton(), "mixamorig:LeftLeg", "plank");
  const HumanoidOptions options{.joint_names = {{StandardJoint::kLeftShin, "plank"}}};
  EXPECT_EQ(find_humanoid(at_rest(skeleton), options).mapped(StandardJoint::kLeftShin)->joint,
            *skeleton.find("plank"));
  const HumanoidOptions wrong{.joint_names = {{StandardJoint::kLeftShin, "plonk"}}};
  try {
    (void)find_humanoid(at_rest(skeleton), wrong);
    FAIL();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kUsage);
    EXPECT_STREQ(error.what(), "humanoid: the skeleton has no joint 'plonk' to play left_shin");
  }
}

TEST(Humanoid, RefusesAJointThatPlaysTwo) {
  const Skeleton skeleton = mixamo_skeleton();
  const Humanoid good = find_humanoid(at_rest(skeleton));
  Humanoid::Mapping mapping;
  for (int s = 0; s < kStandardJointCount; ++s) {
    mapping[static_cast<std::size_t>(s)] = good.mapped(static_cast<StandardJoint>(s));
  }
  mapping[4]->joint = mapping[3]->joint;
  EXPECT_THROW(Humanoid("x", skeleton, mapping, 0.8, Vector3d::Zero(), 0), base::Error);
}

// A rest skeleton in an A-pose, turned about the vertical, still gives references that stand the
// rig in the T-pose: the same arms, 45 degrees up and turned back.
TEST(Humanoid, AnAPoseIsTurnedIntoTheTPose) {
  const Eigen::Quaterniond turn = math::yaw_rotation(0.6);
  std::vector<Joint> joints = mixamo_skeleton().joints();
  for (Joint& joint : joints) {
    const bool left = joint.name.find(":Left") != std::string::npos;
    const bool arm = joint.name.find("ForeArm") != std::string::npos ||
                     joint.name.find("Hand") != std::string::npos;
    if (arm) {
      joint.rest_offset =
          math::exp({0.0, 0.0, (left ? -45.0 : 45.0) * kDegree}) * joint.rest_offset;
    }
    joint.rest_offset = turn * joint.rest_offset;
  }
  const Humanoid humanoid = find_humanoid(at_rest(Skeleton(std::move(joints))));
  const auto reference = [&](StandardJoint which) { return humanoid.mapped(which)->reference; };
  EXPECT_LT(math::angle_between(reference(StandardJoint::kHips), turn.conjugate()), 1e-9);
  EXPECT_LT(math::angle_between(reference(StandardJoint::kLeftForearm),
                                math::exp({0.0, 0.0, 45.0 * kDegree}) * turn.conjugate()),
            1e-9);
  EXPECT_LT(math::angle_between(reference(StandardJoint::kRightHand),
                                math::exp({0.0, 0.0, -45.0 * kDegree}) * turn.conjugate()),
            1e-9);
}

TEST(Humanoid, ABentKneeTellsTheHinge) {
  // Knees bent by 30 degrees about an axis 20 degrees off the hip line: the reference turns the
  // hinge to +X and the bones down.
  std::vector<Joint> joints = mixamo_skeleton().joints();
  const Eigen::Quaterniond out = math::yaw_rotation(20.0 * kDegree);
  const Eigen::Quaterniond bend = out * math::exp({30.0 * kDegree, 0.0, 0.0});
  for (Joint& joint : joints) {
    if (joint.name == "mixamorig:LeftLeg") joint.rest_offset = {0.0, -0.44, 0.0};
    if (joint.name == "mixamorig:LeftFoot") joint.rest_offset = bend * Vector3d(0.0, -0.44, 0.0);
  }
  const Humanoid humanoid = find_humanoid(at_rest(Skeleton(std::move(joints))));
  const auto& thigh = *humanoid.mapped(StandardJoint::kLeftThigh);
  const auto& shin = *humanoid.mapped(StandardJoint::kLeftShin);
  EXPECT_LT((thigh.reference * (out * Vector3d::UnitX()) - Vector3d::UnitX()).norm(), 1e-9);
  EXPECT_LT((shin.reference * (bend * -Vector3d::UnitY()) + Vector3d::UnitY()).norm(), 1e-9);
}

TEST(Humanoid, OtherFamiliesAreKnownByName) {
  struct Family {
    std::string rig;
    std::array<std::string, 13> left_and_middle;  // hips .. head, left clavicle .. toe
    std::string left, right;
  };
  const std::vector<Family> families = {
      {"3ds-max-biped",
       {"Bip01 Pelvis", "Bip01 Spine", "Bip01 Spine2", "Bip01 Neck", "Bip01 Head",
        "Bip01 L Clavicle", "Bip01 L UpperArm", "Bip01 L Forearm", "Bip01 L Hand", "Bip01 L Thigh",
        "Bip01 L Calf", "Bip01 L Foot", "Bip01 L Toe0"},
       " L ",
       " R "},
      {"unreal",
       {"pelvis", "spine_01", "spine_03", "neck_01", "head", "clavicle_l", "upperarm_l",
        "lowerarm_l", "hand_l", "thigh_l", "calf_l", "foot_l", "ball_l"},
       "_l",
       "_r"},
      {"vrm",
       {"J_Bip_C_Hips", "J_Bip_C_Spine", "J_Bip_C_UpperChest", "J_Bip_C_Neck", "J_Bip_C_Head",
        "J_Bip_L_Shoulder", "J_Bip_L_UpperArm", "J_Bip_L_LowerArm", "J_Bip_L_Hand",
        "J_Bip_L_UpperLeg", "J_Bip_L_LowerLeg", "J_Bip_L_Foot", "J_Bip_L_ToeBase"},
       "_L_",
       "_R_"},
      {"xsens-bvh",
       {"Hips", "Chest", "Chest4", "Neck", "Head", "LeftCollar", "LeftShoulder", "LeftElbow",
        "LeftWrist", "LeftHip", "LeftKnee", "LeftAnkle", "LeftToe"},
       "Left",
       "Right"},
      {"acclaim",
       {"root", "upperback", "thorax", "lowerneck", "head", "lclavicle", "lhumerus", "lradius",
        "lhand", "lfemur", "ltibia", "lfoot", "ltoes"},
       "l",
       "r"}};
  for (const Family& family : families) {
    SCOPED_TRACE(family.rig);
    std::vector<Joint> joints = standard_skeleton()->joints();
    for (int i = 0; i < kStandardJointCount; ++i) {
      const bool right = (i >= 9 && i <= 12) || i >= 17;
      const int name = i < 9 ? i : i < 17 ? i - 4 : i - 8;
      std::string& joint = joints[static_cast<std::size_t>(i)].name;
      joint = family.left_and_middle[static_cast<std::size_t>(name)];
      if (right) joint.replace(joint.find(family.left), family.left.size(), family.right);
    }
    const Humanoid humanoid = find_humanoid(at_rest(Skeleton(std::move(joints))));
    EXPECT_EQ(humanoid.rig_name(), family.rig);
    for (int s = 0; s < kStandardJointCount; ++s) {
      ASSERT_TRUE(humanoid.mapped(static_cast<StandardJoint>(s)).has_value()) << s;
      EXPECT_EQ(humanoid.mapped(static_cast<StandardJoint>(s))->joint, s);
    }
  }
}

TEST(Humanoid, ATPoseFrameIsOnlyDroppedWhereThereIsOne) {
  const auto root = test::captures_root();
  if (!root) GTEST_SKIP() << test::kNoCaptures;
  for (const auto& entry : std::filesystem::directory_iterator(*root / "cmu_dance")) {
    if (entry.path().extension() != ".bvh") continue;
    SCOPED_TRACE(entry.path().filename());
    EXPECT_TRUE(find_humanoid(test::load_capture(entry.path(), 3)).has_t_pose_frame());
  }
  const auto clips = *root / "cmu_clips";
  const Clip walk = test::load_capture(clips / "walk_07_01.bvh", 4);
  EXPECT_TRUE(find_humanoid(walk).has_t_pose_frame());
  EXPECT_FALSE(find_humanoid(walk.slice(1, 4)).has_t_pose_frame());
  EXPECT_FALSE(find_humanoid(test::load_capture(clips / "kungfu_135_07_one_kick_209f_60fps.bvh", 3))
                   .has_t_pose_frame());
  EXPECT_FALSE(
      find_humanoid(test::load_capture(*root / "bandai1" / "dataset-1_bow_normal_001.bvh", 3))
          .has_t_pose_frame());
}

// The table's T-pose stands in for the frame that a cut file lacks.
TEST(Humanoid, ACutFileGivesNearlyTheSameReference) {
  const auto root = test::captures_root();
  if (!root) GTEST_SKIP() << test::kNoCaptures;
  for (const auto& [file, tolerance_degrees] :
       {std::pair("cmu_clips/walk_07_01.bvh", 1e-6), std::pair("cmu_dance/modern_02.bvh", 4.0)}) {
    SCOPED_TRACE(file);
    const Clip clip = test::load_capture(*root / file, 5);
    const Humanoid whole = find_humanoid(clip);
    const Capture capture = find_capture(clip);
    const Humanoid cut = find_humanoid(capture.clip);
    EXPECT_EQ(capture.clip.frame_count(), 4);
    EXPECT_FALSE(capture.humanoid.has_t_pose_frame());
    for (int s = 0; s < kStandardJointCount; ++s) {
      const auto which = static_cast<StandardJoint>(s);
      if (!whole.mapped(which)) continue;
      EXPECT_LE(math::angle_between(whole.mapped(which)->reference, cut.mapped(which)->reference),
                tolerance_degrees * kDegree)
          << kStandardJointNames[static_cast<std::size_t>(s)];
    }
  }
}

}  // namespace
}  // namespace laban::motion
