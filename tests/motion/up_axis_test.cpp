#include "laban/motion/up_axis.h"

#include <gtest/gtest.h>

#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

#include "rigs.h"

namespace laban::motion {
namespace {

using Eigen::Vector3d;

/// A person who stands, as a file with that axis up has him.
Clip standing_along(UpAxis up) {
  test::ClipShape shape;
  shape.amplitude_rad = 0.15;
  const Clip upright = to_standard_clip(test::random_pose_matrix(shape));
  return turned(upright, y_up_from(up).conjugate());
}

TEST(UpAxis, IsFoundFromHowTheBodyStands) {
  for (const UpAxis up : {UpAxis::kX, UpAxis::kY, UpAxis::kZ}) {
    EXPECT_EQ(find_up_axis(standing_along(up)), up);
  }
}

TEST(UpAxis, SomeoneWhoLiesDownIsNotMistakenForAnotherAxis) {
  const Clip upright = standing_along(UpAxis::kY);
  // On the back: the motion lies along z, the rest skeleton still stands along y.
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < upright.frame_count(); ++f) {
    const auto frame = upright.rotations(f);
    rotations.insert(rotations.end(), frame.begin(), frame.end());
    auto& root = rotations[rotations.size() - frame.size()];
    root = y_up_from(UpAxis::kZ).conjugate() * root;
  }
  const Clip lying(upright.shared_skeleton(), upright.frame_rate_hz(), upright.root_positions(),
                   rotations);
  EXPECT_EQ(find_up_axis(lying), UpAxis::kY);
}

TEST(UpAxis, IsYWhereNoPersonIsFound) {
  EXPECT_EQ(find_up_axis(turned(test::random_clip(), y_up_from(UpAxis::kZ))), UpAxis::kY);
}

TEST(UpAxis, TurningTurnsEveryPositionAndBack) {
  const Clip clip = test::random_motion(test::mixamo_skeleton(), 10, 2);
  const Eigen::Quaterniond turn = y_up_from(UpAxis::kZ);
  const Clip seen = turned(clip, turn);
  const Eigen::Matrix3Xd expected = turn.toRotationMatrix() * joint_positions(clip);
  EXPECT_LT((joint_positions(seen) - expected).cwiseAbs().maxCoeff(), 1e-12);
  const Eigen::Matrix3Xd rest = turn.toRotationMatrix() * rest_pose(clip.skeleton()).positions;
  EXPECT_LT((rest_pose(seen.skeleton()).positions - rest).cwiseAbs().maxCoeff(), 1e-12);
  const Clip again = turned(seen, turn.conjugate());
  EXPECT_LT((joint_positions(again) - joint_positions(clip)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(UpAxis, TurnsTheNamedAxisUpwards) {
  EXPECT_LT((y_up_from(UpAxis::kZ) * Vector3d::UnitZ() - Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_LT((y_up_from(UpAxis::kX) * Vector3d::UnitX() - Vector3d::UnitY()).norm(), 1e-12);
}

}  // namespace
}  // namespace laban::motion
