#include "laban/transfer/styled_clip.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/motion/retarget.h"
#include "laban/motion/standard_body.h"

#include "toy_corpus.h"

namespace laban::transfer {
namespace {

motion::PoseMatrix input_pose() {
  return test::toy_clip(false, 1.1, 0.95, 0.05);
}

motion::Capture input_capture() {
  return motion::find_capture(motion::to_standard_clip(input_pose()));
}

AppliedStyle applied() {
  return apply_style(test::toy_model(), input_pose(),
                     {{std::nullopt, 1.0, std::nullopt}, {1.0, 1.0, 1.0}});
}

TEST(StyledClip, WithoutHeldFeetIsTheRetargetedMotionBitForBit) {
  const AppliedStyle style = applied();
  const motion::Capture input = input_capture();
  const motion::Clip clip = play_style(test::toy_model(), style, input, {.hold_feet = false}).clip;
  const motion::Clip plain = motion::from_pose_matrix(style.pose, input.humanoid, input.clip,
                                                      {style.source_frames, std::nullopt});
  ASSERT_EQ(clip.frame_count(), plain.frame_count());
  EXPECT_EQ(clip.root_positions(), plain.root_positions());
  for (int f = 0; f < clip.frame_count(); ++f) {
    for (int j = 0; j < clip.joint_count(); ++j)
      EXPECT_EQ(clip.rotation(f, j).coeffs(), plain.rotation(f, j).coeffs());
  }
}

TEST(StyledClip, ContactsGoWithTheMotion) {
  const AppliedStyle style = applied();
  EXPECT_EQ(style.contacts.frame_count(), style.pose.frame_count());
  EXPECT_EQ(style.contacts.frame_rate_hz, style.pose.frame_rate_hz);
}

TEST(StyledClip, IsMeasuredBesideItsSources) {
  const StyledClip styled = play_style(test::toy_model(), applied(), input_capture());
  EXPECT_FALSE(styled.sources.empty());
  const StyledQuality quality = measure_styled(styled, input_capture().humanoid);
  EXPECT_GT(quality.source_jerk_m_s3, 0.0);
  EXPECT_EQ(quality.join_percentile.has_value(), !styled.joins.empty());
}

}  // namespace
}  // namespace laban::transfer
