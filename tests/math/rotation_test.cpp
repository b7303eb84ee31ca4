#include "laban/math/rotation.h"

#include <numbers>

#include <gtest/gtest.h>

#include "laban/base/rng.h"
#include "support/clips.h"

namespace laban::math {
namespace {

using test::IsNearRotation;

TEST(Rotation, LogIsTheInverseOfExpOnThePrincipalBranch) {
  base::Rng rng(1);
  for (int trial = 0; trial < 1000; ++trial) {
    Eigen::Vector3d r(rng.normal(), rng.normal(), rng.normal());
    r *= rng.uniform(0.0, std::numbers::pi - 1e-6) / r.norm();
    EXPECT_LT((log(exp(r)) - r).norm(), 1e-9);
  }
}

TEST(Rotation, TinyAnglesKeepTheirDirection) {
  const Eigen::Vector3d r(3e-12, -1e-12, 2e-12);
  EXPECT_LT((log(exp(r)) - r).norm(), 1e-20);
}

TEST(Rotation, NearestBranchIsTheSameRotationAndTheNearest) {
  base::Rng rng(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Vector3d r = 2.0 * Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal());
    const Eigen::Vector3d previous =
        3.0 * Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal());
    const Eigen::Vector3d near = nearest_branch(r, previous);
    EXPECT_THAT(exp(near), IsNearRotation(exp(r), 1e-9));
    for (int k = -3; k <= 3; ++k) {
      const Eigen::Vector3d other = r + r.normalized() * (2.0 * std::numbers::pi * k);
      EXPECT_LE((near - previous).norm(), (other - previous).norm() + 1e-9);
    }
  }
}

TEST(Rotation, AFullTurnStaysContinuous) {
  Eigen::Vector3d previous = Eigen::Vector3d::Zero();
  for (int i = 1; i <= 400; ++i) {
    const Eigen::Vector3d r =
        nearest_branch(log(exp(Eigen::Vector3d(0.0, 0.02 * i, 0.0))), previous);
    EXPECT_NEAR(r.y(), 0.02 * i, 1e-9);
    previous = r;
  }
}

TEST(Rotation, HeadingTimesTiltIsTheRotation) {
  const Eigen::Quaterniond q = yaw_rotation(2.5) * exp(Eigen::Vector3d(0.4, 0.0, -0.2));
  const Eigen::Quaterniond tilt = yaw_rotation(heading_of(q)).conjugate() * q;
  EXPECT_NEAR(tilt.y(), 0.0, 1e-12);
  EXPECT_NEAR(heading_of(q), 2.5, 1e-12);
}

TEST(Rotation, BetweenFramesTakesOneFrameToTheOther) {
  const Eigen::Quaterniond turn = exp(Eigen::Vector3d(0.3, -1.0, 0.7));
  const Eigen::Vector3d x(0.2, 1.0, 0.1);
  const Eigen::Vector3d y(1.0, 0.0, 0.4);
  EXPECT_THAT(rotation_between_frames(x, y, turn * x, turn * y), IsNearRotation(turn, 1e-9));
}

}  // namespace
}  // namespace laban::math
