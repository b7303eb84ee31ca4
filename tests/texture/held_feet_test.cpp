#include "texture/held_feet.h"

#include <gtest/gtest.h>

#include "laban/math/constants.h"
#include "laban/math/rotation.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/foot_lock.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::texture {
namespace {

motion::Clip sliding_clip() {
  motion::PoseMatrix pose =
      test::random_pose_matrix({.frames = 400, .seed = 3, .amplitude_rad = 0.15});
  pose.steps.row(1).setConstant(0.012);  // feet that stand slide on
  return motion::to_standard_clip(pose);
}

motion::Clip all_of(HeldFeet& feet) {
  feet.finish();
  return feet.take(feet.ready());
}

TEST(HeldFeet, TurnsNoJointByMoreThanSevenDegrees) {
  const motion::Capture capture = motion::find_capture(sliding_clip());
  const motion::FootFloor floor{};
  HeldFeet feet(capture.humanoid, floor);
  feet.push(capture.clip);
  const motion::Clip held = all_of(feet);
  motion::FootLockStream lock(capture.humanoid, floor);
  lock.push(capture.clip);
  lock.finish();
  const motion::Clip locked = lock.take(lock.ready());
  ASSERT_EQ(held.frame_count(), capture.clip.frame_count());
  double by_lock = 0.0;
  double by_this = 0.0;
  for (int f = 0; f < held.frame_count(); ++f) {
    for (int j = 0; j < held.joint_count(); ++j) {
      const auto& plain = capture.clip.rotation(f, j);
      by_lock = std::max(by_lock, math::angle_between(plain, locked.rotation(f, j)));
      by_this = std::max(by_this, math::angle_between(plain, held.rotation(f, j)));
    }
  }
  EXPECT_GT(by_lock, 10.0 * math::kDegree);  // or this shows nothing
  EXPECT_LE(by_this, 7.01 * math::kDegree);
  EXPECT_GT(by_this, 1.0 * math::kDegree);
}

TEST(HeldFeet, GivesTheSameFramesInWhateverPiecesTheyComeAndGo) {
  const motion::Capture capture = motion::find_capture(sliding_clip());
  HeldFeet whole(capture.humanoid, motion::FootFloor{});
  whole.push(capture.clip);
  const motion::Clip all = all_of(whole);
  HeldFeet pieces(capture.humanoid, motion::FootFloor{});
  int given = 0;
  double largest = 0.0;
  const auto compare = [&](const motion::Clip& piece) {
    for (int f = 0; f < piece.frame_count(); ++f, ++given) {
      for (int j = 0; j < piece.joint_count(); ++j) {
        largest =
            std::max(largest, math::angle_between(piece.rotation(f, j), all.rotation(given, j)));
      }
    }
  };
  for (int begin = 0; begin < 400; begin += 50) {
    pieces.push(capture.clip.slice(begin, begin + 50));
    while (pieces.ready() >= 30) compare(pieces.take(30));
  }
  compare(all_of(pieces));
  EXPECT_EQ(given, 400);
  EXPECT_LE(largest, 1e-9);
}

}  // namespace
}  // namespace laban::texture
