#include "laban/motion/foot_lock_stream.h"

#include <cmath>

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/motion_quality.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::motion {
namespace {

constexpr double kRateHz = 30.0;

/// The standard body swaying on the spot with its feet sliding: 25 s, three stretches.
Clip swaying() {
  test::ClipShape shape{.frames = 750, .frame_rate_hz = kRateHz, .amplitude_rad = 0.05};
  PoseMatrix pose = test::random_pose_matrix(shape);
  pose.steps *= 0.05;
  return to_standard_clip(pose);
}

double largest_difference(const Clip& a, const Clip& b) {
  double largest = (a.root_positions() - b.root_positions()).cwiseAbs().maxCoeff();
  for (int f = 0; f < a.frame_count(); ++f) {
    for (int j = 0; j < a.joint_count(); ++j) {
      largest = std::max(largest, math::angle_between(a.rotation(f, j), b.rotation(f, j)));
    }
  }
  return largest;
}

TEST(FootLockStream, GivesTheSameFramesInWhateverPiecesTheyCome) {
  const Clip clip = swaying();
  const Humanoid humanoid = find_humanoid(clip);
  const FootFloor floor = find_foot_contacts(clip, humanoid).floor.value_or(FootFloor{});
  FootLockStream whole(humanoid, floor);
  whole.push(clip);
  whole.finish();
  ASSERT_EQ(whole.ready(), clip.frame_count());
  const Clip all = whole.take(whole.ready());
  FootLockStream pieces(humanoid, floor);
  int taken = 0;
  int begin = 0;
  for (const int count : {1, 299, 200, 250}) {
    pieces.push(clip.slice(begin, begin + count));
    begin += count;
    if (begin == clip.frame_count()) pieces.finish();
    if (pieces.ready() == 0) continue;
    const int ready = pieces.ready();
    EXPECT_LE(largest_difference(pieces.take(ready), all.slice(taken, taken + ready)), 1e-12);
    taken += ready;
  }
  EXPECT_EQ(taken, clip.frame_count());
}

TEST(FootLockStream, HoldsFeetAndDoesNotJumpBetweenStretches) {
  const Clip clip = swaying();
  const Humanoid humanoid = find_humanoid(clip);
  const auto floor = find_foot_contacts(clip, humanoid).floor;
  ASSERT_TRUE(floor);
  FootLockStream stream(humanoid, *floor);
  stream.push(clip);
  stream.finish();
  const Clip held = stream.take(stream.ready());
  const auto skate = [&](const Clip& one) {
    return foot_skate_cm(foot_paths(one, humanoid), floor->toe_m);
  };
  EXPECT_LT(skate(held), skate(clip));
  const MotionQuality before = measure_quality(clip, humanoid, *floor);
  const MotionQuality after = measure_quality(held, humanoid, *floor);
  for (const int join : {240, 480}) {  // where stretches of 8 s meet
    for (int f = join - 2; f <= join + 2; ++f) {
      const auto frame = static_cast<std::size_t>(f);
      EXPECT_LE(after.acceleration_m_s2[frame], before.acceleration_m_s2[frame] + 2.0) << f;
    }
  }
}

TEST(FootLockStream, RefusesFramesAfterItsEndAndOfOtherRates) {
  const Clip clip = swaying();
  FootLockStream stream(find_humanoid(clip), FootFloor{});
  EXPECT_THROW(static_cast<void>(stream.take(1)), base::Error);
  stream.push(clip.slice(0, 10));
  const Clip other(clip.shared_skeleton(), 60.0, clip.root_positions().leftCols(1),
                   {clip.rotations(0).begin(), clip.rotations(0).end()});
  EXPECT_THROW(stream.push(other), base::Error);
  stream.finish();
  EXPECT_THROW(stream.push(clip), base::Error);
  EXPECT_EQ(stream.take(10).frame_count(), 10);
}

}  // namespace
}  // namespace laban::motion
