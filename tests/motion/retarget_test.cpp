#include "laban/motion/retarget.h"

#include <algorithm>
#include <cmath>
#include <iostream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/resample.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

#include "captures.h"
#include "rigs.h"

namespace laban::motion {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::kDegree;
using test::mixamo_skeleton;
using test::random_motion;

/// Largest difference of two clips on one skeleton: any joint's rotations (degrees), positions (m).
struct ClipDifference {
  double local_degrees = 0.0;
  double model_degrees = 0.0;
  double position_m = 0.0;
};

ClipDifference difference(const Clip& a, const Clip& b) {
  EXPECT_EQ(a.frame_count(), b.frame_count());
  ClipDifference worst;
  for (int f = 0; f < std::min(a.frame_count(), b.frame_count()); ++f) {
    const ModelPose x = forward_kinematics(a, f);
    const ModelPose y = forward_kinematics(b, f);
    worst.position_m =
        std::max(worst.position_m, (x.positions - y.positions).cwiseAbs().maxCoeff());
    for (int j = 0; j < a.joint_count(); ++j) {
      const auto cell = static_cast<std::size_t>(j);
      worst.local_degrees = std::max(
          worst.local_degrees, math::angle_between(a.rotation(f, j), b.rotation(f, j)) / kDegree);
      worst.model_degrees = std::max(
          worst.model_degrees, math::angle_between(x.rotations[cell], y.rotations[cell]) / kDegree);
    }
  }
  return worst;
}

Quaterniond angles_of(const PoseMatrix& pose, int joint, int frame) {
  return math::exp(pose.angles.block<3, 1>(3 * joint, frame));
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

TEST(Retarget, TheStandardClipOfAPoseMatrixGivesItBack) {
  PoseMatrix pose = test::random_pose_matrix({.frames = 50});
  // Hinges have no turn about their bones.
  using enum StandardJoint;
  for (const StandardJoint arm : {kLeftForearm, kRightForearm}) {
    pose.angles.row(3 * index_of(arm)).setZero();
  }
  for (const StandardJoint leg : {kLeftShin, kRightShin}) {
    pose.angles.row(3 * index_of(leg) + 1).setZero();
  }
  // The tilt of the hips has no heading.
  pose.angles.row(1).setZero();
  const PlanarPose start{.x = 0.5, .z = -1.0, .yaw = 2.0};
  const Clip clip = to_standard_clip(pose, start);
  const Humanoid humanoid = find_humanoid(clip);
  const PoseMatrix again = to_pose_matrix(clip, humanoid);
  EXPECT_LT((again.angles - pose.angles).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((again.height - pose.height).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((again.steps - pose.steps).cwiseAbs().maxCoeff(), 1e-9);
  const PlanarPose found = planar_start(clip, humanoid);
  EXPECT_NEAR(found.x, start.x, 1e-9);
  EXPECT_NEAR(found.z, start.z, 1e-9);
  EXPECT_NEAR(found.yaw, start.yaw, 1e-9);
}

TEST(Retarget, ARigInItsTPoseIsZero) {
  const Clip clip = test::at_rest(mixamo_skeleton());
  const PoseMatrix pose = to_pose_matrix(clip, find_humanoid(clip));
  // Its shins lean by 4 degrees and its feet turn out by 5: the bind pose is that far from the
  // standard T-pose, and straight everywhere else.
  EXPECT_LT(pose.angles.cwiseAbs().maxCoeff(), 5.0 * kDegree);
  EXPECT_LT(pose.angles.topRows(3 * index_of(StandardJoint::kLeftThigh)).cwiseAbs().maxCoeff(),
            1e-9);
  EXPECT_NEAR(pose.height(0), (0.99 - 0.067) / pose.leg_length_m + 0.06 / kStandardLegLengthM,
              1e-9);
}

TEST(Retarget, OneMotionOnTwoRigsGivesOnePoseMatrix) {
  const PoseMatrix pose = test::random_pose_matrix({.frames = 30});
  const Clip clip = to_standard_clip(pose);
  const Humanoid humanoid = find_humanoid(clip);
  const Clip walk = from_pose_matrix(pose, humanoid, clip);
  const Clip mixamo = test::at_rest(mixamo_skeleton());
  const Humanoid other = find_humanoid(mixamo);
  const PoseMatrix a = to_pose_matrix(walk, humanoid);
  const PoseMatrix b = to_pose_matrix(from_pose_matrix(pose, other, mixamo), other);
  EXPECT_LT((a.angles - b.angles).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((a.steps - b.steps).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((a.height - b.height).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Retarget, HeadingAndPlaceAreOnlyInTheSteps) {
  const Clip clip = random_motion(mixamo_skeleton(), 40, 3);
  const Humanoid humanoid = find_humanoid(clip);
  const Quaterniond turn = math::yaw_rotation(1.3);
  Eigen::Matrix3Xd root = turn.toRotationMatrix() * clip.root_positions();
  root.colwise() += Vector3d(2.0, 0.0, -3.0);
  std::vector<Quaterniond> rotations;
  for (int f = 0; f < clip.frame_count(); ++f) {
    for (int j = 0; j < clip.joint_count(); ++j) {
      rotations.push_back(j == 0 ? turn * clip.rotation(f, j) : clip.rotation(f, j));
    }
  }
  const Clip moved(clip.shared_skeleton(), clip.frame_rate_hz(), root, rotations);
  const PoseMatrix a = to_pose_matrix(clip, humanoid);
  const PoseMatrix b = to_pose_matrix(moved, humanoid);
  EXPECT_LT((a.angles - b.angles).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((a.steps - b.steps).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((a.height - b.height).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Retarget, AnglesAreUnwrappedPastAHalfTurn) {
  // The head turns by 400 degrees about +Y, a degree a frame.
  std::vector<Quaterniond> rotations;
  const int frames = 401;
  for (int f = 0; f < frames; ++f) {
    for (int s = 0; s < kStandardJointCount; ++s) {
      rotations.push_back(s == index_of(StandardJoint::kHead) ? math::yaw_rotation(f * kDegree)
                                                              : Quaterniond::Identity());
    }
  }
  const Clip clip(standard_skeleton(), 60.0, Vector3d(0, 1, 0).replicate(1, frames), rotations);
  const PoseMatrix pose = to_pose_matrix(clip, find_humanoid(clip));
  EXPECT_NEAR(pose.angles(3 * index_of(StandardJoint::kHead) + 1, 400), 400.0 * kDegree, 1e-9);
}

TEST(Retarget, JointsBetweenTwoStandardOnesFallToTheLower) {
  const Skeleton skeleton = mixamo_skeleton();
  const Humanoid humanoid = find_humanoid(test::at_rest(skeleton));
  std::vector<Quaterniond> rotations(static_cast<std::size_t>(skeleton.joint_count()),
                                     Quaterniond::Identity());
  const Quaterniond bend = math::exp({0.4, 0.1, -0.2});
  rotations[static_cast<std::size_t>(*skeleton.find("mixamorig:Spine1"))] = bend;
  const Clip clip(std::make_shared<const Skeleton>(skeleton), 30.0, Vector3d(0, 1, 0), rotations);
  const PoseMatrix pose = to_pose_matrix(clip, humanoid);
  EXPECT_LT(math::angle_between(angles_of(pose, index_of(StandardJoint::kChest), 0), bend), 1e-9);
  EXPECT_LT(pose.angles.col(0).segment<3>(3 * index_of(StandardJoint::kSpine)).norm(), 1e-9);
}

TEST(Retarget, TheTurnOfAForearmFallsToTheHand) {
  const Skeleton skeleton = mixamo_skeleton();
  const Humanoid humanoid = find_humanoid(test::at_rest(skeleton));
  const Quaterniond hinge = math::exp({0.0, -1.2, 0.0});
  const Quaterniond twist = math::exp({0.7, 0.0, 0.0});
  std::vector<Quaterniond> rotations(static_cast<std::size_t>(skeleton.joint_count()),
                                     Quaterniond::Identity());
  rotations[static_cast<std::size_t>(*skeleton.find("mixamorig:LeftForeArm"))] = hinge * twist;
  const Clip clip(std::make_shared<const Skeleton>(skeleton), 30.0, Vector3d(0, 1, 0), rotations);
  const PoseMatrix pose = to_pose_matrix(clip, humanoid);
  EXPECT_LT(math::angle_between(angles_of(pose, index_of(StandardJoint::kLeftForearm), 0), hinge),
            1e-9);
  EXPECT_LT(math::angle_between(angles_of(pose, index_of(StandardJoint::kLeftHand), 0), twist),
            1e-9);
  EXPECT_LT(difference(clip, from_pose_matrix(pose, humanoid, clip)).local_degrees, 1e-6);
}

TEST(Retarget, OtherJointsFollowTheSourceAtTheWarpedTime) {
  const Clip source = random_motion(mixamo_skeleton(), 21, 4);
  const Humanoid humanoid = find_humanoid(source);
  const PoseMatrix pose = to_pose_matrix(source, humanoid);
  std::vector<double> backwards;
  for (int f = 0; f < pose.frame_count(); ++f) backwards.push_back(20.0 - f);
  backwards[3] = 16.5;
  const Clip warped = from_pose_matrix(pose, humanoid, source, {.source_frames = backwards});
  const int finger = *source.skeleton().find("mixamorig:LeftHandIndex1");
  const int hand = *source.skeleton().find("mixamorig:LeftHand");
  EXPECT_LT(math::angle_between(warped.rotation(0, finger), source.rotation(20, finger)), 1e-9);
  EXPECT_LT(
      math::angle_between(warped.rotation(3, finger),
                          source.rotation(16, finger).slerp(0.5, source.rotation(17, finger))),
      1e-9);
  EXPECT_LT(
      math::angle_between(forward_kinematics(warped, 7).rotations[static_cast<std::size_t>(hand)],
                          forward_kinematics(source, 7).rotations[static_cast<std::size_t>(hand)]),
      1e-9);
}

TEST(Retarget, TravelScalesByTheLegAndBeginsWhereAsked) {
  const Clip source = random_motion(mixamo_skeleton(), 30, 5);
  const Humanoid humanoid = find_humanoid(source);
  const PoseMatrix pose = to_pose_matrix(source, humanoid);
  std::vector<Joint> joints = source.skeleton().joints();
  for (Joint& joint : joints) joint.rest_offset *= 0.5;
  const Clip small = test::at_rest(Skeleton(std::move(joints)));
  const Clip out = from_pose_matrix(pose, find_humanoid(small), small,
                                    {.start = planar_start(source, humanoid)});
  EXPECT_LT((2.0 * out.root_positions() - source.root_positions()).cwiseAbs().maxCoeff(), 1e-9);
  const Clip there = from_pose_matrix(pose, humanoid, source, {.start = PlanarPose{1.0, 2.0, 0.5}});
  const PlanarPose start = planar_start(there, humanoid);
  EXPECT_NEAR(start.x, 1.0, 1e-9);
  EXPECT_NEAR(start.z, 2.0, 1e-9);
  EXPECT_NEAR(start.yaw, 0.5, 1e-9);
}

// Hips below a root that moves, and joints that animate their position: the root keeps its motion.
TEST(Retarget, AMovingRootAboveTheHipsKeepsItsMotion) {
  std::vector<Joint> joints = {{"reference", -1, Vector3d::Zero(), std::nullopt}};
  const Skeleton mixamo = mixamo_skeleton();
  for (Joint joint : mixamo.joints()) {
    ++joint.parent;
    joints.push_back(joint);
  }
  const Clip source = random_motion(Skeleton(std::move(joints)), 25, 6);
  const Humanoid humanoid = find_humanoid(source);
  const Clip out = from_pose_matrix(to_pose_matrix(source, humanoid), humanoid, source);
  EXPECT_TRUE(out.has_translations());
  const ClipDifference worst = difference(source, out);
  EXPECT_LT(worst.local_degrees, 1e-6);
  EXPECT_LT(worst.position_m, 1e-9);
}

TEST(Retarget, ThereAndBackOnAMixamoRig) {
  const Clip source = random_motion(mixamo_skeleton(), 120, 1);
  const Humanoid humanoid = find_humanoid(source);
  const Clip out = from_pose_matrix(to_pose_matrix(source, humanoid), humanoid, source);
  const ClipDifference worst = difference(source, out);
  EXPECT_FALSE(out.has_translations());
  EXPECT_LT(worst.local_degrees, 1e-6);
  EXPECT_LT(worst.model_degrees, 1e-6);
  EXPECT_LT(worst.position_m, 1e-9);
}

TEST(Retarget, RefusesWhatDoesNotFit) {
  const Clip source = random_motion(mixamo_skeleton(), 5, 1);
  const Humanoid humanoid = find_humanoid(source);
  const PoseMatrix pose = to_pose_matrix(source, humanoid);
  const Clip other = test::at_rest(*standard_skeleton());
  const std::vector<double> short_times = {0.0, 1.0};
  const std::vector<double> broken_times = {0.0, 1.0, std::nan(""), 3.0, 4.0};
  const auto message = [&](auto&& call) -> std::string {
    try {
      call();
    } catch (const base::Error& error) {
      EXPECT_EQ(error.kind(), base::ErrorKind::kUsage);
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(message([&] { (void)to_pose_matrix(other, humanoid); }),
            "to_pose_matrix: the clip has 21 joints, the humanoid was made for 24");
  EXPECT_EQ(message([&] {
              (void)from_pose_matrix(pose, humanoid, source, {.source_frames = short_times});
            }),
            "RetargetOptions::source_frames has 2 values for 5 pose frames");
  EXPECT_EQ(message([&] {
              (void)from_pose_matrix(pose, humanoid, source, {.source_frames = broken_times});
            }),
            "RetargetOptions::source_frames: value 2 is not finite");
}

TEST(RetargetCaptures, ThereAndBackWithinHalfADegree) {
  const auto root = test::captures_root();
  if (!root) GTEST_SKIP() << test::kNoCaptures;
  for (const char* file :
       {"bandai1/dataset-1_walk_normal_001.bvh", "bandai1/dataset-1_byebye_happy_001.bvh",
        "cmu_clips/ballet_05_06_pirouettes_jete.bvh", "cmu_clips/walk_08_01.bvh",
        "cmu_dance/modern_06.bvh", "cmu_dance/martial_04.bvh",
        "cmu_clips/kungfu_135_07_one_kick_209f_60fps.bvh"}) {
    SCOPED_TRACE(file);
    const Capture source = find_capture(test::load_capture(*root / file));
    const PoseMatrix pose = to_pose_matrix(source.clip, source.humanoid);
    const ClipDifference worst =
        difference(source.clip, from_pose_matrix(pose, source.humanoid, source.clip));
    EXPECT_LT(worst.local_degrees, 0.5);
    EXPECT_LT(worst.model_degrees, 0.5);
    EXPECT_LT(worst.position_m, 1e-6);
    std::cout << file << ": " << worst.local_degrees << " degrees, " << worst.position_m << " m\n";
  }
}

TEST(RetargetCaptures, OneTakeOnTwoRigsGivesOnePoseMatrix) {
  const auto root = test::captures_root();
  if (!root) GTEST_SKIP() << test::kNoCaptures;
  for (const auto& [file_31, file_43] :
       {std::pair("cmu_clips/ballet_05_02_expressive_arms_pirouette.bvh",
                  "cmu_dance/modern_02.bvh"),
        std::pair("cmu_clips/ballet_05_06_pirouettes_jete.bvh", "cmu_dance/modern_06.bvh")}) {
    SCOPED_TRACE(file_31);
    const Capture a = find_capture(test::load_capture(*root / file_31));
    const Capture b = find_capture(test::load_capture(*root / file_43));
    EXPECT_EQ(a.humanoid.rig_name(), "cmu-31");
    EXPECT_EQ(b.humanoid.rig_name(), "cmu-43");
    const PoseMatrix x = to_pose_matrix(a.clip, a.humanoid);
    const PoseMatrix y = to_pose_matrix(b.clip, b.humanoid);
    ASSERT_EQ(x.frame_count(), y.frame_count());
    std::vector<double> all;
    double worst = 0.0;
    for (int s = 0; s < kStandardJointCount; ++s) {
      const auto which = static_cast<StandardJoint>(s);
      if (!a.humanoid.mapped(which) || !b.humanoid.mapped(which)) continue;
      std::vector<double> degrees;
      for (int f = 0; f < x.frame_count(); ++f) {
        degrees.push_back(math::angle_between(angles_of(x, s, f), angles_of(y, s, f)) / kDegree);
      }
      const double middle = median(degrees);
      EXPECT_LE(middle, 5.0) << kStandardJointNames[static_cast<std::size_t>(s)];
      worst = std::max(worst, middle);
      all.insert(all.end(), degrees.begin(), degrees.end());
    }
    EXPECT_LE(median(all), 3.0);
    std::cout << file_31 << ": worst joint " << worst << ", all " << median(all) << " degrees\n";
  }
}

/// Mean exponential maps of a capture, 3 x 21, averaged with their mirror image: left and right
/// differences of a performer's posture cancel.
Eigen::Matrix3Xd mean_pose(const std::filesystem::path& path) {
  const Capture capture = find_capture(test::load_capture(path));
  const Eigen::VectorXd mean =
      to_pose_matrix(capture.clip, capture.humanoid).angles.rowwise().mean();
  Eigen::Matrix3Xd both(3, kStandardJointCount);
  for (int s = 0; s < kStandardJointCount; ++s) {
    const int other = s < 5 ? s : (s < 9 || (s >= 13 && s < 17)) ? s + 4 : s - 4;
    const Vector3d mirrored = mean.segment<3>(3 * other).cwiseProduct(Vector3d(1.0, -1.0, -1.0));
    both.col(s) = 0.5 * (mean.segment<3>(3 * s) + mirrored);
  }
  return both;
}

// Two studios, two rigs, different people walking: mean poses can only be alike if every joint's
// reference has the right twist. Without the elbow hinges the hands are 30 degrees off, with an
// axis swapped any joint is off by 90 or 180.
TEST(RetargetCaptures, WalksOfTwoStudiosHaveSimilarMeanPoses) {
  const auto root = test::captures_root();
  if (!root) GTEST_SKIP() << test::kNoCaptures;
  const Eigen::Matrix3Xd cmu = 0.5 * (mean_pose(*root / "cmu_clips/walk_07_01.bvh") +
                                      mean_pose(*root / "cmu_clips/walk_08_01.bvh"));
  Eigen::Matrix3Xd bandai = Eigen::Matrix3Xd::Zero(3, kStandardJointCount);
  const std::vector<std::string> styles = {"normal", "masculinity", "feminine", "active"};
  for (const std::string& style : styles) {
    bandai += mean_pose(*root / "bandai1" / ("dataset-1_walk_" + style + "_001.bvh")) /
              static_cast<double>(styles.size());
  }
  for (int s = 0; s < kStandardJointCount; ++s) {
    const double degrees =
        math::angle_between(math::exp(cmu.col(s)), math::exp(bandai.col(s))) / kDegree;
    const bool hand =
        s == index_of(StandardJoint::kLeftHand) || s == index_of(StandardJoint::kRightHand);
    // No rig says where its hand points: the wrist is the least sure.
    EXPECT_LE(degrees, hand ? 30.0 : 20.0) << kStandardJointNames[static_cast<std::size_t>(s)];
    std::cout << kStandardJointNames[static_cast<std::size_t>(s)] << " " << degrees << "\n";
  }
}

// A person walks the way the hips face, knees bend backward, hands hang below the shoulders.
TEST(RetargetCaptures, AWalkLooksLikeAWalkOnTheStandardBody) {
  const auto root = test::captures_root();
  if (!root) GTEST_SKIP() << test::kNoCaptures;
  for (const char* file : {"bandai1/dataset-1_walk_normal_001.bvh", "cmu_clips/walk_07_01.bvh"}) {
    SCOPED_TRACE(file);
    const Capture capture = find_capture(test::load_capture(*root / file));
    const PoseMatrix pose = to_pose_matrix(capture.clip, capture.humanoid);
    EXPECT_GT(pose.steps.row(1).mean(), 5.0 * std::abs(pose.steps.row(0).mean()));
    const Clip clip = to_standard_clip(pose);
    using enum StandardJoint;
    double lowest = 1.0;
    for (int f = 0; f < clip.frame_count(); f += 5) {
      const ModelPose model = forward_kinematics(clip, f);
      const auto at = [&](StandardJoint joint) -> Vector3d {
        return model.positions.col(index_of(joint));
      };
      EXPECT_GT(at(kHead).y(), at(kChest).y());
      for (const auto& [hand, upper_arm] :
           {std::pair(kLeftHand, kLeftUpperArm), std::pair(kRightHand, kRightUpperArm)}) {
        EXPECT_LT(at(hand).y(), at(upper_arm).y() - 0.25);
      }
      for (const StandardJoint shin : {kLeftShin, kRightShin}) {
        const Vector3d bend = pose.angles.col(f).segment<3>(3 * index_of(shin));
        EXPECT_GT(bend.x(), -5.0 * kDegree);
      }
      lowest = std::min({lowest, at(kLeftToe).y(), at(kRightToe).y()});
    }
    EXPECT_NEAR(lowest, 0.0, 0.06);  // it walks on the floor
  }
}

}  // namespace
}  // namespace laban::motion
