#include "laban/transfer/styled_clip.h"

#include <cmath>
#include <numbers>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/math/rotation.h"
#include "laban/motion/join.h"
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
                     {{std::nullopt, 1.0, std::nullopt}, {1.0, 1.0, 1.0, 1.0}});
}

TEST(StyledClip, WithoutHeldFeetIsTheRetargetedMotionBitForBit) {
  const AppliedStyle style = applied();
  const motion::Capture input = input_capture();
  const StyledClip styled = play_style(test::toy_model(), style, input, {.hold_feet = false});
  const motion::Clip& clip = styled.clip;
  const motion::Clip plain = motion::from_pose_matrix(style.pose, input.humanoid, input.clip,
                                                      {styled.source_frames, std::nullopt});
  ASSERT_EQ(clip.frame_count(), plain.frame_count());
  EXPECT_EQ(clip.root_positions(), plain.root_positions());
  for (int f = 0; f < clip.frame_count(); ++f) {
    for (int j = 0; j < clip.joint_count(); ++j)
      EXPECT_EQ(clip.rotation(f, j).coeffs(), plain.rotation(f, j).coeffs());
  }
}

TEST(StyledClip, ItsTimeNeverGoesBackNorFarFromTheWarp) {
  const AppliedStyle style = applied();
  const StyledClip styled = play_style(test::toy_model(), style, input_capture());
  ASSERT_EQ(styled.source_frames.size(), style.source_frames.size()) << "one rate";
  for (std::size_t f = 0; f < styled.source_frames.size(); ++f) {
    const std::size_t before = f == 0 ? 0 : f - 1;
    EXPECT_GE(styled.source_frames[f], styled.source_frames[before] - 1e-9) << f;
    EXPECT_NEAR(styled.source_frames[f], style.source_frames[f], 0.4 * style.pose.frame_rate_hz)
        << f;
  }
}

/// The input's capture with a finger on the left hand that bends and stretches once a second.
motion::Capture input_with_finger(const motion::PoseMatrix& pose) {
  const motion::Clip body = motion::to_standard_clip(pose);
  std::vector<motion::Joint> joints;
  for (int j = 0; j < body.joint_count(); ++j) joints.push_back(body.skeleton().joint(j));
  motion::Joint finger;
  finger.name = "LeftIndex";
  finger.parent = motion::index_of(motion::StandardJoint::kLeftHand);
  finger.rest_offset = Eigen::Vector3d(0.1, 0.0, 0.0);
  joints.push_back(finger);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < body.frame_count(); ++f) {
    const auto local = body.rotations(f);
    rotations.insert(rotations.end(), local.begin(), local.end());
    const double t = f / body.frame_rate_hz();
    rotations.push_back(math::exp({0.0, 0.0, 0.6 * std::sin(2.0 * std::numbers::pi * t)}));
  }
  return motion::find_capture(
      motion::Clip(std::make_shared<const motion::Skeleton>(motion::Skeleton(std::move(joints))),
                   body.frame_rate_hz(), body.root_positions(), std::move(rotations)));
}

// Two actions one after the other, so that there is a join.
TEST(StyledClip, FingersPlayTheInputInItsNewTimeOverJoinsToo) {
  const std::vector<motion::PoseMatrix> parts = {test::toy_clip(false, 1.1, 0.95, 0.05),
                                                 test::toy_clip(true, 1.1, 0.95, 0.05)};
  const motion::PoseMatrix pose = motion::concatenate(parts);
  const motion::Capture input = input_with_finger(pose);
  const AppliedStyle style = apply_style(test::toy_model(), pose,
                                         {{std::nullopt, 1.0, std::nullopt}, {1.0, 1.0, 1.0, 1.0}});
  const StyledClip styled = play_style(test::toy_model(), style, input);
  ASSERT_FALSE(styled.joins.empty());
  const int finger = styled.clip.joint_count() - 1;
  ASSERT_EQ(styled.clip.skeleton().joint(finger).name, "LeftIndex");
  double farthest = 0.0;
  for (int f = 0; f < styled.clip.frame_count(); ++f) {
    const double t = styled.source_frames[static_cast<std::size_t>(f)] / input.clip.frame_rate_hz();
    // Slerp between frames of the input: a chord of the sine.
    EXPECT_NEAR(math::log(styled.clip.rotation(f, finger)).z(),
                0.6 * std::sin(2.0 * std::numbers::pi * t), 0.01)
        << f;
    if (f == 0) continue;
    farthest = std::max(farthest, math::angle_between(styled.clip.rotation(f - 1, finger),
                                                      styled.clip.rotation(f, finger)));
  }
  // At most four times as fast as in the input, at a join as elsewhere.
  EXPECT_LT(farthest, 4.0 * 0.6 * 2.0 * std::numbers::pi / input.clip.frame_rate_hz());
}

TEST(StyledClip, ContactsGoWithTheMotion) {
  const AppliedStyle style = applied();
  EXPECT_EQ(style.contacts.frame_count(), style.pose.frame_count());
  EXPECT_EQ(style.contacts.frame_rate_hz, style.pose.frame_rate_hz);
}

TEST(StyledClip, IsMeasuredBesideItsSources) {
  const StyledClip styled = play_style(test::toy_model(), applied(), input_capture());
  const StyledSources sources = play_sources(test::toy_model(), applied(), input_capture());
  EXPECT_FALSE(sources.clips.empty());
  ASSERT_EQ(sources.shares.size(), sources.clips.size());
  EXPECT_NEAR(std::accumulate(sources.shares.begin(), sources.shares.end(), 0.0), 1.0, 1e-9);
  const StyledQuality quality = measure_styled(styled, sources, input_capture().humanoid);
  EXPECT_GT(quality.source_jerk_m_s3, 0.0);
  const auto content = content_ratio(test::toy_model(), applied(), input_pose());
  ASSERT_TRUE(content.has_value());
  EXPECT_GT(*content, 0.0);
  EXPECT_LT(*content, 5.0);
  EXPECT_EQ(quality.join_percentile.has_value(), !styled.joins.empty());
}

}  // namespace
}  // namespace laban::transfer
