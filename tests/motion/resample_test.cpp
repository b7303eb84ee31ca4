#include "laban/motion/resample.h"

#include <cmath>

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "support/clips.h"

namespace laban::motion {
namespace {

/// A clip of one joint turning at `speed` rad/s about an axis and moving at a constant velocity.
Clip steady(int frames, double rate, double speed) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1.0, 2.0, -0.5).normalized();
  Eigen::Matrix3Xd root(3, frames);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < frames; ++f) {
    root.col(f) = Eigen::Vector3d(1.0, 0.5, -2.0) * (f / rate);
    rotations.push_back(math::exp(axis * (speed * f / rate)));
  }
  auto skeleton = std::make_shared<const Skeleton>(
      std::vector<Joint>{{"only", -1, Eigen::Vector3d::Zero(), std::nullopt}});
  return {skeleton, rate, root, rotations};
}

TEST(Resample, TheSameRateChangesNothing) {
  const Clip clip = test::random_clip({.joints = 4, .frames = 33});
  const Clip same = resample(clip, clip.frame_rate_hz());
  ASSERT_EQ(same.frame_count(), clip.frame_count());
  EXPECT_EQ(same.root_positions(), clip.root_positions());
  for (int f = 0; f < clip.frame_count(); ++f) {
    for (int j = 0; j < clip.joint_count(); ++j) {
      EXPECT_EQ(same.rotation(f, j).coeffs(), clip.rotation(f, j).coeffs());
    }
  }
}

TEST(Resample, SteadyMotionStaysSteadyAtAnyRate) {
  for (const double rate : {24.0, 30.0, 59.94, 60.0, 120.0, 500.0}) {
    SCOPED_TRACE(rate);
    const Clip clip = steady(50, 60.0, 9.0);
    const Clip out = resample(clip, rate);
    const Clip expected = steady(out.frame_count(), rate, 9.0);
    EXPECT_LE(out.duration_s(), clip.duration_s() + 1e-6);
    EXPECT_GT(out.duration_s(), clip.duration_s() - 1.0 / rate - 1e-9);
    for (int f = 0; f < out.frame_count(); ++f) {
      EXPECT_LT(math::angle_between(out.rotation(f, 0), expected.rotation(f, 0)), 1e-6);
      EXPECT_LT((out.root_positions().col(f) - expected.root_positions().col(f)).norm(), 1e-6);
    }
  }
}

TEST(Resample, EveryOtherFrameOfDoubleRateIsTheClip) {
  const Clip clip = test::random_clip({.joints = 3, .frames = 20});
  const Clip twice = resample(clip, 2.0 * clip.frame_rate_hz());
  ASSERT_EQ(twice.frame_count(), 39);
  for (int f = 0; f < clip.frame_count(); ++f) {
    EXPECT_EQ(twice.root_positions().col(2 * f), clip.root_positions().col(f));
    EXPECT_EQ(twice.rotation(2 * f, 1).coeffs(), clip.rotation(f, 1).coeffs());
  }
}

TEST(Resample, PositionsOfOtherJointsAreKept) {
  const Clip plain = test::random_clip({.joints = 2, .frames = 3});
  Eigen::Matrix3Xd translations(3, 6);
  for (int f = 0; f < 3; ++f) {
    translations.col(2 * f) = plain.root_positions().col(f);
    translations.col(2 * f + 1) = Eigen::Vector3d(0.1 * f, 0.2, -0.3 * f);
  }
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < 3; ++f) {
    for (const Eigen::Quaterniond& q : plain.rotations(f)) rotations.push_back(q);
  }
  const Clip clip(plain.shared_skeleton(), 10.0, plain.root_positions(), rotations, translations);
  const Clip out = resample(clip, 20.0);
  ASSERT_TRUE(out.has_translations());
  EXPECT_LT((out.translation(3, 1) - Eigen::Vector3d(0.15, 0.2, -0.45)).norm(), 1e-12);
}

TEST(Resample, OneFrameStaysOneFrame) {
  const Clip clip = test::random_clip({.joints = 2, .frames = 1});
  EXPECT_EQ(resample(clip, 17.0).frame_count(), 1);
}

TEST(Sample, ReadsAPoseMatrixAtAnyFramesWithItsStepsBetweenThem) {
  const PoseMatrix pose = test::random_pose_matrix({.frames = 41});
  std::vector<double> frames;
  for (int f = 0; f <= 20; ++f) frames.push_back(2.0 * f);
  const PoseMatrix read = sample(pose, frames, 30.0);
  ASSERT_EQ(read.frame_count(), 21);
  EXPECT_EQ(read.frame_rate_hz, 30.0);
  const Eigen::Matrix3Xd path = planar_path(pose);
  const Eigen::Matrix3Xd read_path = planar_path(read);
  for (int f = 0; f <= 20; ++f) {
    EXPECT_EQ(read.angles.col(f), pose.angles.col(2 * f));
    EXPECT_EQ(read.height(f), pose.height(2 * f));
    EXPECT_LT((read_path.col(f) - path.col(2 * f)).norm(), 1e-12);
  }
  EXPECT_THROW((void)sample(pose, {}, 30.0), base::Error);
  EXPECT_THROW((void)sample(pose, frames, 0.0), base::Error);
}

TEST(Resample, RefusesARateThatIsNone) {
  const Clip clip = test::random_clip({.joints = 1, .frames = 2});
  for (const double rate : {0.0, -30.0, std::nan(""), HUGE_VAL}) {
    try {
      (void)resample(clip, rate);
      FAIL() << rate;
    } catch (const base::Error& error) {
      EXPECT_EQ(error.kind(), base::ErrorKind::kUsage);
    }
  }
}

}  // namespace
}  // namespace laban::motion
