#include "laban/motion/reach.h"

#include <algorithm>

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

Clip reached(const Clip& clip, StandardJoint joint, const Vector3d& target) {
  return reach(clip, 0, find_humanoid(clip), joint, target);
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

/// All but the listed joints have the local rotations that they had.
void expect_others_unturned(const Clip& clip, const Clip& done,
                            const std::vector<StandardJoint>& turned) {
  for (int j = 0; j < clip.joint_count(); ++j) {
    if (std::ranges::count(turned, static_cast<StandardJoint>(j)) > 0) continue;
    EXPECT_EQ(done.rotation(0, j).coeffs(), clip.rotation(0, j).coeffs()) << j;
  }
}

/// Bones from hips and spine to the joints below are as long as they were.
void expect_same_bones(const Clip& clip, const Clip& done) {
  for (int j = 1; j < clip.joint_count(); ++j) {
    const auto parent = static_cast<StandardJoint>(clip.skeleton().joint(j).parent);
    const auto joint = static_cast<StandardJoint>(j);
    EXPECT_NEAR((place_of(done, joint) - place_of(done, parent)).norm(),
                (place_of(clip, joint) - place_of(clip, parent)).norm(), 1e-9);
  }
}

TEST(Reach, TheHeadIsReachedByTheTrunkWhichBendsForwards) {
  for (const double angle : {0.0, 1.0}) {
    const Clip clip = bent_by(angle);
    const Vector3d spine = place_of(clip, kSpine);
    const Vector3d target =
        spine + 0.85 * (place_of(clip, kHead) - spine) + Vector3d(0.05, 0.0, 0.04);
    const Clip done = reached(clip, kHead, target);
    EXPECT_LT((place_of(done, kHead) - target).norm(), 1e-9);
    expect_same_bones(clip, done);
    expect_others_unturned(clip, done, turned_for(kHead));
    for (const StandardJoint still : {kHips, kSpine, kLeftFoot, kRightFoot, kRightShin})
      EXPECT_LT((place_of(done, still) - place_of(clip, still)).norm(), 1e-12);
    const auto head = static_cast<std::size_t>(index_of(kHead));
    EXPECT_LT(forward_kinematics(done, 0).rotations[head].angularDistance(
                  forward_kinematics(clip, 0).rotations[head]),
              1e-9);
  }
  const Clip straight = bent_by(0.0);
  const Vector3d spine = place_of(straight, kSpine);
  const Clip bowed = reached(straight, kHead, spine + 0.8 * (place_of(straight, kHead) - spine));
  const Vector3d forwards = math::exp(Vector3d(0.1, 0.7, -0.2)) * Vector3d::UnitZ();
  // The chest gives way to the back, as the head comes down in front of it.
  EXPECT_LT((place_of(bowed, kChest) - place_of(straight, kChest)).dot(forwards), -0.02);
}

TEST(Reach, AnElbowSwivelsToWhereItsCircleComesNearest) {
  const Clip clip = bent_by(0.9);
  for (const auto& [upper, lower, end] : kLimbs) {
    const Vector3d root = place_of(clip, upper);
    const Vector3d axis = (place_of(clip, end) - root).normalized();
    const Vector3d arm = place_of(clip, lower) - root;
    for (const double angle : {-2.5, -0.4, 0.0, 1.3}) {
      const Vector3d on_circle = root + math::exp(angle * axis) * arm;
      // On its circle it is hit; beside it, it is as near as any place of the circle.
      const Clip done = reached(clip, lower, on_circle);
      EXPECT_LT((place_of(done, lower) - on_circle).norm(), 1e-9);
      const Vector3d aside = on_circle + Vector3d(0.1, -0.07, 0.12);
      const double nearest = (place_of(reached(clip, lower, aside), lower) - aside).norm();
      for (double turn = 0.0; turn < 6.3; turn += 0.1)
        EXPECT_LE(nearest, (root + math::exp(turn * axis) * arm - aside).norm() + 1e-9);
      EXPECT_LT((place_of(done, end) - place_of(clip, end)).norm(), 1e-9);
      expect_same_bones(clip, done);
      expect_others_unturned(clip, done, turned_for(lower));
    }
  }
}

TEST(Reach, AStraightLimbDoesNotSwivel) {
  const Clip clip = bent_by(0.0);
  const Clip done = reached(clip, kLeftForearm, Vector3d(1.0, 2.0, 3.0));
  expect_others_unturned(clip, done, {});
}

TEST(Reach, TheHipsMoveAndHandsAndFeetStay) {
  const Clip clip = bent_by(0.9);
  const Vector3d target = place_of(clip, kHips) + Vector3d(0.04, -0.06, 0.05);
  const Clip done = reached(clip, kHips, target);
  EXPECT_LT((place_of(done, kHips) - target).norm(), 1e-9);
  for (const auto& limb : kLimbs)
    EXPECT_LT((place_of(done, limb.end) - place_of(clip, limb.end)).norm(), 1e-9);
  expect_same_bones(clip, done);
  expect_others_unturned(clip, done, turned_for(kHips));
  // Out of reach: legs stretched towards where the feet were.
  const Clip high = reached(clip, kHips, place_of(clip, kHips) + Vector3d(0.0, 2.0, 0.0));
  const Vector3d way = place_of(clip, kLeftFoot) - place_of(high, kLeftThigh);
  const Vector3d leg = place_of(high, kLeftFoot) - place_of(high, kLeftThigh);
  EXPECT_LT((leg.normalized() - way.normalized()).norm(), 1e-6);
  expect_same_bones(clip, high);
}

TEST(Reach, KeepsAnimatedPositions) {
  const Clip clip = bent_by(0.9);
  Eigen::Matrix3Xd translations(3, clip.joint_count());
  for (int j = 0; j < clip.joint_count(); ++j)
    translations.col(j) = (j == 0 ? 1.0 : 1.1) * clip.translation(0, j);
  const auto rotations = clip.rotations(0);
  const Clip stretched(clip.shared_skeleton(), 60.0, clip.root_positions(),
                       {rotations.begin(), rotations.end()}, translations);
  const Vector3d target = place_of(stretched, kHips) - Vector3d(0.0, 0.05, 0.0);
  const Clip done = reach(stretched, 0, find_humanoid(clip), kHips, target);
  EXPECT_LT((place_of(done, kHips) - target).norm(), 1e-9);
  EXPECT_LT((place_of(done, kRightFoot) - place_of(stretched, kRightFoot)).norm(), 1e-9);
  expect_same_bones(stretched, done);
}

TEST(Reach, RefusesWhatCannotBeBroughtAnywhere) {
  const Clip clip = bent_by(0.5);
  const Humanoid humanoid = find_humanoid(clip);
  EXPECT_FALSE(can_reach(kNeck));
  EXPECT_THROW((void)turned_for(kNeck), base::Error);
  EXPECT_THROW((void)reach(clip, 0, humanoid, kLeftToe, Vector3d::Zero()), base::Error);
  EXPECT_THROW((void)reach(clip, 1, humanoid, kLeftHand, Vector3d::Zero()), base::Error);
  EXPECT_THROW((void)reach(clip, 0, humanoid, kLeftHand, Vector3d::Constant(std::nan(""))),
               base::Error);
}

}  // namespace
}  // namespace laban::motion
