#include "texture/joint_detour.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "laban/math/constants.h"
#include "laban/math/rotation.h"

#include "standard_rig.h"
#include "texture/pose_join.h"

namespace laban::texture {
namespace {

using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr int kJoint = 10;
constexpr double kFree = 8.0 * math::kDegree;

/// A limb tilted by 60 degrees, to all sides of a half circle: `degrees` from 0 to 180.
Quaterniond tilted(double degrees) {
  const double side = degrees * math::kDegree;
  return math::exp(std::numbers::pi / 3.0 * Vector3d(std::cos(side), 0.0, std::sin(side)));
}

/// It was captured on its way round that half circle, in four seconds.
MotionTexture half_circle() {
  MotionTexture texture = test::empty_texture();
  texture.space.reference.fill(Quaterniond::Identity());
  texture.space.scale = Eigen::VectorXd::Ones(kObservationRows);
  texture.observations = MatrixXd::Zero(kObservationRows, 241);
  texture.takes = {{"", 0, 241, 0, 1.0}};
  for (int f = 0; f <= 240; ++f) {
    texture.observations.block<3, 1>(3 * kJoint, f) = math::log(tilted(0.75 * f));
  }
  return texture;
}

/// Straight through the middle, where it never was.
std::vector<Quaterniond> straight_across(int frames) {
  std::vector<Quaterniond> rotations;
  for (int f = 0; f < frames; ++f) {
    const double x = static_cast<double>(f) / (frames - 1);
    rotations.push_back(tilted(0.0).slerp(x * x * (3.0 - 2.0 * x), tilted(180.0)));
  }
  return rotations;
}

double farthest(const RotationRange& range, const std::vector<Quaterniond>& rotations,
                const Eigen::Matrix3Xd& turns) {
  double farthest = 0.0;
  for (std::size_t f = 0; f < rotations.size(); ++f) {
    const Quaterniond turned = rotations[f] * math::exp(turns.col(static_cast<int>(f)));
    farthest = std::max(farthest, range.distance(kJoint, turned));
  }
  return farthest;
}

TEST(JointDetours, GoRoundWhereNothingWasCaptured) {
  const MotionTexture texture = half_circle();
  const RotationRange range(texture);
  const std::vector<Quaterniond> straight = straight_across(150);
  ASSERT_GT(farthest(range, straight, Eigen::Matrix3Xd::Zero(3, 150)), 55.0 * math::kDegree);
  const auto turns = JointDetours(texture, range).around(kJoint, straight, kFree);
  ASSERT_TRUE(turns);
  EXPECT_LT(farthest(range, straight, *turns), kFree + 2.0 * math::kDegree);
}

// Halfway round 40 degrees of side are left out, 34 of the joint's own, which the capture crosses
// from one frame to the next.
TEST(JointDetours, CrossAGapAsQuicklyAsTheCaptureDid) {
  MotionTexture texture = half_circle();
  for (int f = 94; f <= 146; ++f) {
    texture.observations.col(f) = texture.observations.col(f < 120 ? 93 : 147);
  }
  const RotationRange range(texture);
  const std::vector<Quaterniond> straight = straight_across(150);
  const auto turns = JointDetours(texture, range).around(kJoint, straight, kFree);
  ASSERT_TRUE(turns);
  ASSERT_GT(range.distance(kJoint, tilted(90.0)), kFree + 8.0 * math::kDegree);
  EXPECT_LT(farthest(range, straight, *turns), kFree + 3.0 * math::kDegree);
}

TEST(JointDetours, ComeFromNothingAndGoToNothingWithoutAJerk) {
  const MotionTexture texture = half_circle();
  const RotationRange range(texture);
  const std::vector<Quaterniond> straight = straight_across(150);
  const auto turns = JointDetours(texture, range).around(kJoint, straight, kFree);
  ASSERT_TRUE(turns);
  EXPECT_LT(turns->col(0).norm() + turns->col(149).norm(), 1e-12);
  EXPECT_LT((turns->col(1) - turns->col(0)).norm(), 0.2 * math::kDegree);
  EXPECT_LT((turns->col(149) - turns->col(148)).norm(), 0.2 * math::kDegree);
  Quaterniond before = straight[0];
  Vector3d speed = Vector3d::Zero();
  for (int f = 1; f < 150; ++f) {
    const Quaterniond here = straight[static_cast<std::size_t>(f)] * math::exp(turns->col(f));
    const Vector3d step = math::log(before.conjugate() * here);
    // 180 degrees of a circle in 2.5 s and 60 Hz are 1.2 degrees a frame; what it changes by in a
    // frame is a fraction of that.
    EXPECT_LT((step - speed).norm(), 0.8 * math::kDegree) << f;
    speed = step;
    before = here;
  }
}

TEST(JointDetours, LeaveRotationsAloneThatWereCaptured) {
  const MotionTexture texture = half_circle();
  const RotationRange range(texture);
  std::vector<Quaterniond> captured;
  for (int f = 0; f <= 120; ++f) captured.push_back(tilted(1.5 * f));
  const auto turns = JointDetours(texture, range).around(kJoint, captured, kFree);
  ASSERT_TRUE(turns);
  EXPECT_LT(turns->norm(), 1e-5);  // captured rotations are kept as floats
}

TEST(JointDetours, AreNotMadeWithoutTime) {
  const MotionTexture texture = half_circle();
  const RotationRange range(texture);
  EXPECT_FALSE(JointDetours(texture, range).around(kJoint, straight_across(20), kFree));
}

// The walk looks at how an end fades before it knows how long the next texton will be.
TEST(JointOffsetCurve, DoesNotDependOnTheLengthBeyondIt) {
  Eigen::Matrix<double, 3, 4> ends = Eigen::Matrix<double, 3, 4>::Zero();
  ends.leftCols(2) << 0.5, 0.49, 0.1, 0.11, 0.0, 0.0;
  const MatrixXd shorter = joint_offset_curve(60.0, 80, ends);
  const MatrixXd longer = joint_offset_curve(60.0, 140, ends);
  EXPECT_LT((longer.leftCols(80) - shorter).norm(), 1e-12);
  EXPECT_LT(longer.rightCols(60).norm(), 1e-12);
}

}  // namespace
}  // namespace laban::texture
