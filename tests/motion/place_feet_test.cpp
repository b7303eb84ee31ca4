#include "laban/motion/place_feet.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"

namespace laban::motion {
namespace {

constexpr int kFrames = 60;

/// The standard body with bent knees.
Clip crouching() {
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < kFrames; ++f) {
    for (int s = 0; s < kStandardJointCount; ++s) {
      const auto joint = static_cast<StandardJoint>(s);
      double angle = 0.0;
      if (joint == StandardJoint::kLeftThigh || joint == StandardJoint::kRightThigh) angle = -0.4;
      if (joint == StandardJoint::kLeftShin || joint == StandardJoint::kRightShin) angle = 0.8;
      if (joint == StandardJoint::kLeftFoot || joint == StandardJoint::kRightFoot) angle = -0.4;
      rotations.push_back(math::exp({angle, 0.0, 0.0}));
    }
  }
  Eigen::Matrix3Xd root = Eigen::Vector3d(0.0, 0.9, 0.0).replicate(1, kFrames);
  return {standard_skeleton(), 60.0, std::move(root), std::move(rotations)};
}

Eigen::Vector3d place_of(const Clip& clip, int frame, StandardJoint joint) {
  return forward_kinematics(clip, frame).positions.col(index_of(joint));
}

/// The left foot swings out by 4 cm and back; the right one stays.
std::array<Eigen::Matrix3Xd, 2> goals_of(const Clip& clip) {
  std::array<Eigen::Matrix3Xd, 2> goals{Eigen::Matrix3Xd(3, kFrames), Eigen::Matrix3Xd(3, kFrames)};
  for (int f = 0; f < kFrames; ++f) {
    const double sine = std::sin(std::numbers::pi * f / (kFrames - 1));
    goals[0].col(f) =
        place_of(clip, f, StandardJoint::kLeftFoot) + 0.04 * sine * sine * Eigen::Vector3d::UnitZ();
    goals[1].col(f) = place_of(clip, f, StandardJoint::kRightFoot);
  }
  return goals;
}

TEST(PlaceFeet, BringsAFootToItsGoalsAndLeavesTheOtherLegAlone) {
  const Clip clip = crouching();
  const auto goals = goals_of(clip);
  const Clip placed = place_feet(clip, find_humanoid(clip), goals);
  for (int f = 0; f < kFrames; ++f) {
    // A swing of 1 Hz lies far below the 8 Hz that are added at most.
    EXPECT_LT((place_of(placed, f, StandardJoint::kLeftFoot) - goals[0].col(f)).norm(), 1e-3);
    EXPECT_EQ(placed.rotation(f, index_of(StandardJoint::kRightThigh)).coeffs(),
              clip.rotation(f, index_of(StandardJoint::kRightThigh)).coeffs());
    EXPECT_EQ(placed.root_positions().col(f), clip.root_positions().col(f));
  }
}

TEST(PlaceFeet, RefusesGoalsThatDoNotFit) {
  const Clip clip = crouching();
  auto goals = goals_of(clip);
  goals[1].conservativeResize(3, kFrames - 1);
  const auto place = [&] { (void)place_feet(clip, find_humanoid(clip), goals); };
  EXPECT_THROW(place(), base::Error);
  goals = goals_of(clip);
  goals[0](1, 7) = std::nan("");
  EXPECT_THROW(place(), base::Error);
}

}  // namespace
}  // namespace laban::motion
