#include "laban/motion/reach.h"

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"

namespace laban::motion {
namespace {

using Eigen::Vector3d;
using enum StandardJoint;

/// The standard body, arms and legs bent by so much.
Clip bent_by(double angle) {
  std::vector<Eigen::Quaterniond> rotations(kStandardJointCount, Eigen::Quaterniond::Identity());
  const auto turn = [&](StandardJoint joint, const Vector3d& by) {
    rotations[static_cast<std::size_t>(index_of(joint))] = math::exp(by);
  };
  turn(kLeftForearm, {0.0, -angle, 0.0});
  turn(kRightForearm, {0.0, angle, 0.0});
  turn(kLeftShin, {angle, 0.0, 0.0});
  turn(kRightShin, {angle, 0.0, 0.0});
  turn(kHips, {0.1, 0.7, -0.2});
  return {standard_skeleton(), 60.0, Eigen::Matrix3Xd(Vector3d(0.3, 0.9, -2.0)), rotations};
}

Clip reached(const Clip& clip, StandardJoint end, const Vector3d& target) {
  return {clip.shared_skeleton(), clip.frame_rate_hz(), clip.root_positions(),
          reach(clip, 0, find_humanoid(clip), end, target)};
}

Vector3d place_of(const Clip& clip, StandardJoint joint) {
  return forward_kinematics(clip, 0).positions.col(index_of(joint));
}

struct Limb {
  StandardJoint upper;
  StandardJoint lower;
  StandardJoint end;
};
constexpr Limb kLimbs[] = {{kLeftUpperArm, kLeftForearm, kLeftHand},
                           {kRightUpperArm, kRightForearm, kRightHand},
                           {kLeftThigh, kLeftShin, kLeftFoot},
                           {kRightThigh, kRightShin, kRightFoot}};

TEST(Reach, BringsEachLimbToItsPlaceAndLeavesAllElse) {
  for (const double angle : {0.0, 0.6, 1.4}) {
    const Clip clip = bent_by(angle);
    for (const auto& [upper, lower, end] : kLimbs) {
      const Vector3d shoulder = place_of(clip, upper);
      // Nearer to the shoulder, and aside.
      const Vector3d target =
          shoulder + 0.7 * (place_of(clip, end) - shoulder) + Vector3d(0.05, 0.08, -0.06);
      const Clip done = reached(clip, end, target);
      EXPECT_LT((place_of(done, end) - target).norm(), 1e-9);
      for (int j = 0; j < clip.joint_count(); ++j) {
        if (j == index_of(upper) || j == index_of(lower) || j == index_of(end)) continue;
        EXPECT_EQ(done.rotation(0, j).coeffs(), clip.rotation(0, j).coeffs());
      }
      const auto tip = static_cast<std::size_t>(index_of(end));
      const auto turned = [tip](const Clip& of) {
        return forward_kinematics(of, 0).rotations[tip];
      };
      EXPECT_LT(turned(done).angularDistance(turned(clip)), 1e-9);
    }
  }
}

TEST(Reach, StretchesTowardsWhatIsOutOfReach) {
  const Clip clip = bent_by(0.8);
  for (const auto& [upper, lower, end] : kLimbs) {
    const Vector3d shoulder = place_of(clip, upper);
    const Vector3d target = shoulder + Vector3d(2.0, -3.0, 1.0);
    const Clip done = reached(clip, end, target);
    const double length = (place_of(clip, lower) - shoulder).norm() +
                          (place_of(clip, end) - place_of(clip, lower)).norm();
    EXPECT_LT((place_of(done, end) - (shoulder + length * (target - shoulder).normalized())).norm(),
              1e-6);
  }
}

TEST(Reach, AStraightLimbBendsAsElbowsAndKneesDo) {
  const Clip clip = bent_by(0.0);
  const Vector3d forwards = math::exp(Vector3d(0.1, 0.7, -0.2)) * Vector3d::UnitZ();
  for (const auto& [upper, lower, end] : kLimbs) {
    const Vector3d shoulder = place_of(clip, upper);
    const Clip done = reached(clip, end, shoulder + 0.6 * (place_of(clip, end) - shoulder));
    const double side = (place_of(done, lower) - shoulder).dot(forwards);
    const bool arm = end == kLeftHand || end == kRightHand;
    EXPECT_GT(arm ? -side : side, 0.05);  // elbows to the back, knees to the front
  }
}

TEST(Reach, DoesNothingWhereItIsAlready) {
  const Clip clip = bent_by(0.5);
  for (const auto& limb : kLimbs) {
    const Clip done = reached(clip, limb.end, place_of(clip, limb.end));
    for (int j = 0; j < clip.joint_count(); ++j)
      EXPECT_LT(done.rotation(0, j).angularDistance(clip.rotation(0, j)), 1e-7);
  }
}

TEST(Reach, RefusesWhatIsNoEndOfALimb) {
  const Clip clip = bent_by(0.5);
  const Humanoid humanoid = find_humanoid(clip);
  EXPECT_THROW((void)reach(clip, 0, humanoid, kHead, Vector3d::Zero()), base::Error);
  EXPECT_THROW((void)reach(clip, 1, humanoid, kLeftHand, Vector3d::Zero()), base::Error);
  EXPECT_THROW((void)reach(clip, 0, humanoid, kLeftHand, Vector3d::Constant(std::nan(""))),
               base::Error);
}

}  // namespace
}  // namespace laban::motion
