#include "laban/motion/foot_lock.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/motion_quality.h"
#include "laban/motion/standard_body.h"

namespace laban::motion {
namespace {

constexpr double kRateHz = 60.0;
constexpr int kFrames = 180;
constexpr int kBegin = 60;  // of the contact
constexpr int kEnd = 120;

/// The standard body with both knees bent, sliding forward at 0.12 m/s while it sways: a stance of
/// a second drifts by 12 cm.
Clip sliding(double knee_rad = 0.5, double speed_m_s = 0.12) {
  Eigen::Matrix3Xd root(3, kFrames);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < kFrames; ++f) {
    const double t = f / kRateHz;
    const double bend = knee_rad * (1.0 + 0.1 * std::sin(4.0 * t));
    root.col(f) << 0.01 * std::sin(5.0 * t), 0.98 - 0.84 * (1.0 - std::cos(0.5 * bend)),
        speed_m_s * t;
    for (int s = 0; s < kStandardJointCount; ++s) {
      const auto joint = static_cast<StandardJoint>(s);
      double angle = 0.0;
      if (joint == StandardJoint::kLeftThigh || joint == StandardJoint::kRightThigh)
        angle = -0.5 * bend;
      if (joint == StandardJoint::kLeftShin || joint == StandardJoint::kRightShin) angle = bend;
      if (joint == StandardJoint::kLeftFoot || joint == StandardJoint::kRightFoot)
        angle = -0.5 * bend;
      rotations.push_back(math::exp({angle, 0.0, 0.0}));
    }
  }
  return {standard_skeleton(), kRateHz, std::move(root), std::move(rotations)};
}

Humanoid humanoid_of(const Clip& clip) {
  return find_humanoid(clip);
}

/// The left toe touches the ground in [kBegin, kEnd).
FootContacts left_toe() {
  FootContacts contacts{kRateHz, Eigen::Matrix4Xd::Zero(4, kFrames)};
  contacts.share.row(index_of(FootPoint::kLeftToe)).segment(kBegin, kEnd - kBegin).setOnes();
  return contacts;
}

Eigen::Matrix3Xd left_toe_path(const Clip& clip) {
  return foot_paths(clip, humanoid_of(clip)).points[1];
}

/// Bend of the left knee, radians, positive as a knee bends.
double knee_bend(const Clip& clip, int frame) {
  const ModelPose pose = forward_kinematics(clip, frame);
  const auto at = [&](StandardJoint joint) { return pose.positions.col(index_of(joint)); };
  const Eigen::Vector3d thigh = at(StandardJoint::kLeftShin) - at(StandardJoint::kLeftThigh);
  const Eigen::Vector3d shin = at(StandardJoint::kLeftFoot) - at(StandardJoint::kLeftShin);
  const Eigen::Vector3d side =
      pose.rotations[static_cast<std::size_t>(index_of(StandardJoint::kLeftThigh))] *
      Eigen::Vector3d::UnitX();
  return std::atan2(side.dot(thigh.cross(shin)), thigh.dot(shin));
}

TEST(FootLock, HoldsAFootWithinAMillimetreWhileItTouches) {
  const Clip clip = sliding();
  const LockedFeet locked = lock_feet(clip, humanoid_of(clip), left_toe());
  const Eigen::Matrix3Xd before = left_toe_path(clip);
  const Eigen::Matrix3Xd toe = left_toe_path(locked.clip);
  EXPECT_GT((before.col(kEnd - 1) - before.col(kBegin)).norm(), 0.08) << "there is a slide";
  for (int f = kBegin; f < kEnd; ++f) {
    EXPECT_LT((toe.col(f) - toe.col(kBegin)).norm(), 1e-3) << f;
  }
  EXPECT_EQ(locked.stances, 1);
  EXPECT_EQ(locked.steps, 0);
}

// Position and velocity go on: no frame bends more than the eased cubic needs, 6 / ease^2 of the
// offset and 4 / ease of its speed (0.15 m/s at most), which the lift of the swing about doubles; a
// pop of the 6 cm offset would bend ten times as much.
TEST(FootLock, IsEasedInAndOut) {
  const Clip clip = sliding();
  const Clip locked = lock_feet(clip, humanoid_of(clip), left_toe()).clip;
  const Eigen::Matrix3Xd offset = left_toe_path(locked) - left_toe_path(clip);
  double largest = 0.0;
  for (int f = 1; f + 1 < kFrames; ++f) {
    largest =
        std::max(largest, (offset.col(f + 1) - 2.0 * offset.col(f) + offset.col(f - 1)).norm());
  }
  const double farthest = std::sqrt(offset.colwise().squaredNorm().maxCoeff());
  EXPECT_LT(largest, 2.0 * (6.0 * farthest / 0.0625 + 4.0 * 0.15 / 0.25) / (kRateHz * kRateHz));
  EXPECT_LT(offset.col(0).norm(), 2e-3);
  EXPECT_LT(offset.col(kFrames - 1).norm(), 2e-3);
}

TEST(FootLock, KeepsTheFootsOrientationAndTheOtherLeg) {
  const Clip clip = sliding();
  const Clip locked = lock_feet(clip, humanoid_of(clip), left_toe()).clip;
  for (const int f : {0, kBegin - 5, kBegin + 3, kEnd - 1, kEnd + 6}) {
    const ModelPose a = forward_kinematics(clip, f);
    const ModelPose b = forward_kinematics(locked, f);
    for (const auto joint : {StandardJoint::kLeftFoot, StandardJoint::kLeftToe,
                             StandardJoint::kRightFoot, StandardJoint::kHead}) {
      const auto j = static_cast<std::size_t>(index_of(joint));
      EXPECT_LT(math::angle_between(a.rotations[j], b.rotations[j]), 1e-6) << f;
    }
    EXPECT_LT((a.positions.col(index_of(StandardJoint::kRightFoot)) -
               b.positions.col(index_of(StandardJoint::kRightFoot)))
                  .norm(),
              1e-6);
  }
}

TEST(FootLock, BendsTheKneeAboutItsOwnAxisOnly) {
  const Clip clip = sliding();
  const Clip locked = lock_feet(clip, humanoid_of(clip), left_toe()).clip;
  for (int f = 0; f < kFrames; ++f) {
    const Eigen::Vector3d turn = math::log(locked.rotation(f, index_of(StandardJoint::kLeftShin)));
    EXPECT_NEAR(turn.y(), 0.0, 1e-9) << f;
    EXPECT_NEAR(turn.z(), 0.0, 1e-9) << f;
    EXPECT_GT(turn.x(), 0.0) << f;
  }
}

TEST(FootLock, NeverOverstretchesAKnee) {
  // Nearly straight legs, and far more drift than they can follow.
  const Clip clip = sliding(0.12, 0.45);
  const LockedFeet locked = lock_feet(clip, humanoid_of(clip), left_toe());
  const double four_degrees = 4.0 * std::numbers::pi / 180.0;
  for (int f = 0; f < kFrames; ++f) {
    EXPECT_GT(knee_bend(locked.clip, f), std::min(four_degrees, knee_bend(clip, f)) - 1e-6) << f;
  }
  EXPECT_LE(locked.deepest_m, FootLockOptions{}.deepest_m + 1e-12);
  EXPECT_GT(locked.deepest_m, 0.0) << "the pelvis goes down first";
}

// Knees that a blend has overstretched by a few degrees, on and off: solved frame by frame they
// snapped between bent and overstretched. What is added may bend a knee's path as an 8 Hz movement
// of a few centimetres does, and no more.
TEST(FootLock, NearlyStraightKneesDoNotSnap) {
  Clip clip = sliding(0.02, 0.05);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < kFrames; ++f) {
    const auto local = clip.rotations(f);
    rotations.insert(rotations.end(), local.begin(), local.end());
    const auto shin =
        static_cast<std::size_t>(f * kStandardJointCount + index_of(StandardJoint::kLeftShin));
    rotations[shin] = math::exp({0.06 * std::sin(0.3 * f), 0.0, 0.0});
  }
  clip = Clip(clip.shared_skeleton(), kRateHz, clip.root_positions(), rotations);
  const Clip locked = lock_feet(clip, humanoid_of(clip), left_toe()).clip;
  const auto knee = [&](const Clip& of, int f) {
    return Eigen::Vector3d(
        forward_kinematics(of, f).positions.col(index_of(StandardJoint::kLeftShin)));
  };
  double largest = 0.0;
  for (int f = 1; f + 1 < kFrames; ++f) {
    const Eigen::Vector3d bend = knee(locked, f + 1) - 2.0 * knee(locked, f) + knee(locked, f - 1);
    largest = std::max(largest, bend.norm() * kRateHz * kRateHz);
  }
  EXPECT_LT(largest, 0.04 * std::pow(2.0 * std::numbers::pi * 8.0, 2));
}

// A blend beyond its sources bends knees the wrong way, here by 23 degrees and back: solved for
// either side of straight by turns, the foot jumped by centimetres from one frame to the next.
TEST(FootLock, KneesThatAreBentTheWrongWayAreStraightenedWithoutAJump) {
  Clip clip = sliding(0.02, 0.3);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < kFrames; ++f) {
    const auto local = clip.rotations(f);
    rotations.insert(rotations.end(), local.begin(), local.end());
    const auto shin =
        static_cast<std::size_t>(f * kStandardJointCount + index_of(StandardJoint::kLeftShin));
    rotations[shin] = math::exp({0.2 + 0.6 * std::sin(0.06 * f), 0.0, 0.0});
  }
  clip = Clip(clip.shared_skeleton(), kRateHz, clip.root_positions(), rotations);
  double straightest = 0.0;
  for (int f = 0; f < kFrames; ++f) straightest = std::min(straightest, knee_bend(clip, f));
  ASSERT_LT(straightest, -0.3) << "there is a knee bent the wrong way";
  const Clip locked = lock_feet(clip, humanoid_of(clip), left_toe()).clip;
  const auto ankle = [&](int f) {
    return Eigen::Vector3d(
        forward_kinematics(locked, f).positions.col(index_of(StandardJoint::kLeftFoot)));
  };
  for (int f = 1; f + 1 < kFrames; ++f) {
    EXPECT_GT(knee_bend(locked, f), -0.02) << f;
    // 1 cm a frame squared is 36 m/s^2; a jump of 5 cm would be five times that.
    EXPECT_LT((ankle(f + 1) - 2.0 * ankle(f) + ankle(f - 1)).norm(), 0.01) << f;
  }
}

TEST(FootLock, PutsTheFeetOnTheFloorThatIsGiven) {
  const Clip clip = sliding();
  FootLockOptions options;
  const double toe_m = left_toe_path(clip)(1, 90) + 0.2;
  options.floor = FootFloor{toe_m, toe_m};
  const Clip locked = lock_feet(clip, humanoid_of(clip), left_toe(), options).clip;
  for (int f = kBegin; f < kEnd; ++f) EXPECT_NEAR(left_toe_path(locked)(1, f), toe_m, 1e-3);
}

TEST(FootLock, StepsWhereAJoinWouldMakeAFootSlide) {
  // The body jumps by 25 cm in a quarter of a second: no foot can stay.
  const Clip clip = sliding(0.5, 0.0);
  Eigen::Matrix3Xd root = clip.root_positions();
  for (int f = 0; f < kFrames; ++f) {
    const double x = std::clamp((f - 90) / 15.0, 0.0, 1.0);
    root(2, f) += 0.25 * x * x * (3.0 - 2.0 * x);
  }
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < kFrames; ++f) {
    const auto local = clip.rotations(f);
    rotations.insert(rotations.end(), local.begin(), local.end());
  }
  const Clip jumping(clip.shared_skeleton(), kRateHz, root, rotations);
  FootContacts contacts{kRateHz, Eigen::Matrix4Xd::Zero(4, kFrames)};
  contacts.share.row(index_of(FootPoint::kLeftToe)).setOnes();
  // What moves at 1 m/s is no contact, so the foot is on the ground before and after.
  FootLockOptions options;
  options.joins = {88};
  const LockedFeet locked = lock_feet(jumping, humanoid_of(clip), contacts, options);
  const Eigen::Matrix3Xd toe = left_toe_path(locked.clip);
  EXPECT_GT(toe.row(1).segment(88, 20).maxCoeff(), toe(1, 60) + 0.015) << "the foot is lifted";
  EXPECT_LT((toe.col(80) - toe.col(10)).norm(), 1e-3);
  EXPECT_LT((toe.col(170) - toe.col(125)).norm(), 1e-3);
}

TEST(FootLock, PartsOfOneCaptureKeepTheirHeight) {
  // The toe is on the ground in two parts, in the second 3 cm higher.
  const Clip clip = sliding(0.5, 0.0);
  Eigen::Matrix3Xd root = clip.root_positions();
  root.row(1).tail(kFrames - 90).array() += 0.03;
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < kFrames; ++f) {
    const auto local = clip.rotations(f);
    rotations.insert(rotations.end(), local.begin(), local.end());
  }
  const Clip raised(clip.shared_skeleton(), kRateHz, root, rotations);
  FootContacts contacts{kRateHz, Eigen::Matrix4Xd::Zero(4, kFrames)};
  for (const int begin : {10, 120}) {
    contacts.share.row(index_of(FootPoint::kLeftToe)).segment(begin, 40).setOnes();
  }
  FootLockOptions options;
  const double toe_m = left_toe_path(clip)(1, 30);
  options.floor = FootFloor{toe_m, toe_m};
  options.joins = {90};
  const auto rise = [&](bool level_parts) {
    options.level_parts = level_parts;
    const Eigen::Matrix3Xd held =
        lock_feet(raised, humanoid_of(clip), contacts, options).clip.root_positions();
    return held(1, 175) - held(1, 5) - (root(1, 175) - root(1, 5));
  };
  EXPECT_NEAR(rise(false), 0.0, 0.002);
  EXPECT_NEAR(rise(true), -0.03, 0.005);
}

/// No steps but the capture's own.
std::array<Eigen::Matrix3Xd, 2> no_added_steps() {
  return {Eigen::Matrix3Xd::Zero(3, kFrames), Eigen::Matrix3Xd::Zero(3, kFrames)};
}

TEST(FootLock, OnTheGroundOfACaptureFeetStandStillAtTheHeightsTheyHave) {
  const Clip clip = sliding();
  const Eigen::Matrix3Xd toe = left_toe_path(clip);
  FootLockOptions options;
  options.floor = FootFloor{toe(1, 90) - 0.05, toe(1, 90) - 0.05};
  options.level_parts = false;
  options.deepest_m = 0.0;
  options.added_steps = no_added_steps();
  const Clip locked = lock_feet(clip, humanoid_of(clip), left_toe(), options).clip;
  const Eigen::Matrix3Xd held = left_toe_path(locked);
  for (int f = kBegin; f < kEnd; ++f) {
    EXPECT_NEAR(held(1, f), toe(1, f), 1e-3);
    EXPECT_LT(std::hypot(held(0, f) - held(0, 90), held(2, f) - held(2, 90)), 2e-3);
  }
  EXPECT_EQ(locked.root_positions(), clip.root_positions());
}

TEST(FootLock, OnTheGroundOfACaptureOnlySwingsThatStepsWereAddedToAreLifted) {
  // The toe drags 12 cm from one stance to the next.
  const Clip clip = sliding(0.5, 0.12);
  FootContacts contacts{kRateHz, Eigen::Matrix4Xd::Zero(4, kFrames)};
  for (const int begin : {10, 120}) {
    contacts.share.row(index_of(FootPoint::kLeftToe)).segment(begin, 40).setOnes();
  }
  FootLockOptions options;
  options.level_parts = false;
  options.added_steps = no_added_steps();
  const auto highest = [&] {
    const Clip locked = lock_feet(clip, humanoid_of(clip), contacts, options).clip;
    return (left_toe_path(locked) - left_toe_path(clip)).row(1).segment(55, 60).maxCoeff();
  };
  EXPECT_LT(highest(), 1e-3);
  (*options.added_steps)[0].row(2).segment(60, 50).setConstant(0.002);
  EXPECT_GT(highest(), 0.008);
  // What the other foot was given does not lift this one.
  std::swap((*options.added_steps)[0], (*options.added_steps)[1]);
  EXPECT_LT(highest(), 1e-3);
}

TEST(FootLock, WithoutContactsNothingChanges) {
  const Clip clip = sliding();
  const FootContacts none{kRateHz, Eigen::Matrix4Xd::Zero(4, kFrames)};
  const Clip locked = lock_feet(clip, humanoid_of(clip), none).clip;
  EXPECT_EQ(locked.root_positions(), clip.root_positions());
  for (int f = 0; f < kFrames; ++f) {
    for (int j = 0; j < clip.joint_count(); ++j)
      EXPECT_EQ(locked.rotation(f, j).coeffs(), clip.rotation(f, j).coeffs());
  }
}

TEST(FootLock, SaysWhatIsWrong) {
  using testing::HasSubstr;
  const Clip clip = sliding();
  const auto message_of = [&](const FootContacts& contacts, const FootLockOptions& options = {}) {
    try {
      (void)lock_feet(clip, humanoid_of(clip), contacts, options);
    } catch (const base::Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(message_of({kRateHz, Eigen::Matrix4Xd::Zero(4, 3)}),
              HasSubstr("contacts of 3 frames"));
  FootLockOptions options;
  options.ease_s = 0.0;
  EXPECT_THAT(message_of(left_toe(), options), HasSubstr("ease_s"));
  options = {};
  options.joins = {kFrames};
  EXPECT_THAT(message_of(left_toe(), options), HasSubstr("joins"));
  options = {};
  options.added_steps = no_added_steps();
  (*options.added_steps)[1].resize(3, 7);
  EXPECT_THAT(message_of(left_toe(), options), HasSubstr("7 added steps for 180 frames"));
}

TEST(MotionQuality, FootSkateIsThatOfASlideWorkedByHand) {
  FootPaths paths;
  paths.frame_rate_hz = 60.0;
  for (auto& path : paths.points) path = Eigen::Matrix3Xd::Zero(3, 61);
  // One toe slides on the floor at 0.6 m/s: 2 cm a frame of 1/30 s; the other one stands.
  for (int f = 0; f <= 60; ++f) paths.points[1](2, f) = 0.01 * f;
  EXPECT_NEAR(foot_skate_cm(paths, 0.0), 0.5 * 2.0, 1e-12);
  // 2.5 cm up nothing counts; 1.25 cm up 2 - sqrt 2 of it.
  paths.points[1].row(1).setConstant(0.025);
  EXPECT_NEAR(foot_skate_cm(paths, 0.0), 0.0, 1e-12);
  paths.points[1].row(1).setConstant(0.0125);
  EXPECT_NEAR(foot_skate_cm(paths, 0.0), 2.0 - std::sqrt(2.0), 1e-12);
}

// The authors' own example, sparc.py: exp(-5 t^2) over [-1, 1) at 100 Hz gives -1.41403.
TEST(MotionQuality, SpectralArcLengthIsThatOfItsAuthors) {
  std::vector<double> stroke;
  for (int k = 0; k < 200; ++k) stroke.push_back(std::exp(-5.0 * std::pow(-1.0 + 0.01 * k, 2)));
  EXPECT_NEAR(spectral_arc_length(stroke, 100.0), -1.41403, 5e-6);
  // Its size does not matter; two strokes with a halt between them are less smooth than one.
  std::vector<double> larger = stroke;
  for (double& speed : larger) speed *= 7.0;
  EXPECT_NEAR(spectral_arc_length(larger, 100.0), -1.41403, 5e-6);
  std::vector<double> twice = stroke;
  twice.insert(twice.end(), stroke.begin(), stroke.end());
  EXPECT_LT(spectral_arc_length(twice, 100.0), -1.8);
  EXPECT_EQ(spectral_arc_length(std::vector<double>(50, 0.0), 100.0), 0.0);
  EXPECT_EQ(spectral_arc_length(std::vector<double>{1.0}, 100.0), 0.0);
}

TEST(MotionQuality, AJumpStandsOutAmongAccelerations) {
  const Clip clip = sliding();
  Eigen::Matrix3Xd root = clip.root_positions();
  root.row(2).tail(kFrames - 90).array() += 0.1;
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < kFrames; ++f) {
    const auto local = clip.rotations(f);
    rotations.insert(rotations.end(), local.begin(), local.end());
  }
  const Clip jumping(clip.shared_skeleton(), kRateHz, root, rotations);
  const MotionQuality smooth = measure_quality(clip, humanoid_of(clip), {});
  const MotionQuality jump = measure_quality(jumping, humanoid_of(clip), {});
  const int joins[] = {90};
  const MotionQuality references[] = {smooth};
  EXPECT_EQ(join_acceleration_percentile(jump, joins, references), 100.0);
  EXPECT_LT(*join_acceleration_percentile(smooth, joins, references), 100.0);
  EXPECT_EQ(join_acceleration_percentile(jump, {}, references), std::nullopt);
}

}  // namespace
}  // namespace laban::motion
