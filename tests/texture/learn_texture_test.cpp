#include "laban/texture/learn_texture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"
#include "laban/io/clip_file.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/texture/texture_file.h"

namespace laban::texture {
namespace {

using Eigen::MatrixXd;

TextureSource embedded(const std::string& name) {
  const std::string path = LABAN_SOURCE_DIR "/data/phrase/" + name + ".bvh";
  return {name + ".bvh", motion::find_capture(io::read_clip(path).clip), 0};
}

TextureLearning quick() {
  TextureLearning options;
  options.min_frames = 20;
  options.threshold = 0.08;
  return options;
}

/// One texture for all tests.
const LearntTexture& walks() {
  static const LearntTexture learnt = [] {
    const std::vector<TextureSource> sources = {
        embedded("phrase_walk_p01"), embedded("phrase_walk_p02"), embedded("phrase_bow_p01")};
    return learn_texture(sources, quick());
  }();
  return learnt;
}

TEST(LearnTexture, KeepsTakesRigAndObservations) {
  const MotionTexture& texture = walks().texture;
  const TextureSource walk = embedded("phrase_walk_p01");
  ASSERT_EQ(texture.takes.size(), 3U);
  EXPECT_EQ(texture.takes[0].name, "phrase_walk_p01.bvh");
  EXPECT_EQ(texture.takes[0].length, walk.capture.clip.frame_count());
  EXPECT_EQ(texture.takes[1].begin, texture.takes[0].length);
  EXPECT_EQ(texture.takes[2].begin + texture.takes[2].length, texture.observations.cols());
  EXPECT_EQ(texture.rig.stance.joint_count(), walk.capture.clip.joint_count());
  EXPECT_TRUE(texture.rig.floor.has_value());
  const MatrixXd pose = motion::to_pose_matrix(walk.capture.clip, walk.capture.humanoid).height;
  EXPECT_TRUE(texture.observations.row(motion::kAngleRowCount)
                  .head(pose.cols())
                  .isApprox(pose.row(0), 1e-12));
  EXPECT_EQ(texture.transition_counts.rows(), texture.texton_count());
}

/// The same capture with its floor elsewhere.
TextureSource raised(TextureSource source, double by_m) {
  const motion::Clip& clip = source.capture.clip;
  Eigen::Matrix3Xd roots = clip.root_positions();
  roots.row(1).array() += by_m;
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < clip.frame_count(); ++f) {
    rotations.insert(rotations.end(), clip.rotations(f).begin(), clip.rotations(f).end());
  }
  source.capture.clip = {clip.shared_skeleton(), clip.frame_rate_hz(), roots, rotations};
  return source;
}

TEST(LearnTexture, PutsAllTakesOnOneFloor) {
  const TextureSource walk = embedded("phrase_walk_p01");
  const std::vector<TextureSource> sources = {walk, raised(walk, 0.05)};
  const MotionTexture texture = learn_texture(sources, quick()).texture;
  const MatrixXd height = texture.observations.row(motion::kAngleRowCount);
  const Eigen::Index frames = texture.takes[0].length;
  // 5 cm would be 0.06 leg lengths; contacts found at other heights move the floor by hairs.
  EXPECT_LT((height.rightCols(frames) - height.leftCols(frames)).cwiseAbs().maxCoeff(), 0.002);
}

TEST(LearnTexture, OtherRatesAreBroughtToTheOneAskedFor) {
  TextureSource fast = embedded("phrase_walk_p02");
  fast.capture.clip = motion::resample(fast.capture.clip, 120.0);
  const int frames = fast.capture.clip.frame_count();
  const std::vector<TextureSource> sources = {embedded("phrase_walk_p01"), fast};
  TextureLearning options = quick();
  const MotionTexture at_first = learn_texture(sources, options).texture;
  EXPECT_EQ(at_first.frame_rate_hz, 60.0);
  EXPECT_EQ(at_first.takes[1].file_frames_per_frame, 2.0);
  EXPECT_EQ(at_first.takes[1].length, (frames + 1) / 2);
  options.frame_rate_hz = 30.0;
  const MotionTexture slow = learn_texture(sources, options).texture;
  EXPECT_EQ(slow.frame_rate_hz, 30.0);
  EXPECT_EQ(slow.takes[1].file_frames_per_frame, 4.0);
  EXPECT_EQ(slow.rig.stance.frame_rate_hz(), 30.0);
}

TEST(LearnTexture, RefusesNothingAndAnotherRunsState) {
  EXPECT_THROW((void)learn_texture({}, quick()), base::Error);
  const std::vector<TextureSource> one = {embedded("phrase_walk_p01")};
  EXPECT_THROW((void)learn_texture(one, quick(), nullptr, {}, &walks()), base::Error);
}

TEST(TextureFile, ComesBackAsItWas) {
  const std::string bytes = write_texture(walks().texture);
  const MotionTexture back = read_texture(bytes, "walk.texture");
  EXPECT_EQ(write_texture(back), bytes);
  const MotionTexture& texture = walks().texture;
  EXPECT_EQ(back.observations, texture.observations);
  EXPECT_EQ(back.transition_counts, texture.transition_counts);
  ASSERT_EQ(back.texton_count(), texture.texton_count());
  for (std::size_t i = 0; i < texture.textons.size(); ++i) {
    EXPECT_EQ(back.textons[i].basis, texture.textons[i].basis);
    EXPECT_EQ(back.textons[i].dynamics.a2, texture.textons[i].dynamics.a2);
    EXPECT_EQ(back.textons[i].dynamics.covariance, texture.textons[i].dynamics.covariance);
    EXPECT_EQ(back.textons[i].start_covariance, texture.textons[i].start_covariance);
    EXPECT_EQ(back.textons[i].residual_variance, texture.textons[i].residual_variance);
  }
}

// tests/texture/files/version_1.texture was written when version 1 of the format was the newest.
TEST(TextureFile, FilesOfVersionOneAreRead) {
  const MotionTexture texture =
      read_texture(base::read_file(LABAN_SOURCE_DIR "/tests/texture/files/version_1.texture"),
                   "version_1.texture");
  EXPECT_EQ(texture.frame_rate_hz, 15.0);
  EXPECT_EQ(texture.texton_count(), 2);
  EXPECT_EQ(texture.takes.size(), 1U);
}

TEST(TextureFile, DamageIsRefusedByName) {
  const std::string bytes = write_texture(walks().texture);
  EXPECT_THROW((void)read_texture("", "x.texture"), base::Error);
  for (std::size_t at = 9; at < bytes.size(); at += bytes.size() / 37) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x20);
    try {
      (void)read_texture(damaged, "x.texture");
      ADD_FAILURE() << "byte " << at;
    } catch (const base::Error& error) {
      EXPECT_EQ(error.kind(), base::ErrorKind::kFormat);
      EXPECT_THAT(error.what(), ::testing::StartsWith("x.texture: "));
    }
    EXPECT_THROW((void)read_texture(bytes.substr(0, at), "x.texture"), base::Error);
  }
}

/// A sound container with one part changed: its checksum is right, its contents are not.
template <typename Change>
std::string message_after(const Change& change) {
  MotionTexture texture = walks().texture;
  change(texture);
  try {
    (void)read_texture(write_texture(texture), "x.texture");
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kFormat);
    return error.what();
  }
  return "";
}

TEST(TextureFile, PartsThatDoNotFitAreRefused) {
  using ::testing::HasSubstr;
  EXPECT_THAT(message_after([](MotionTexture& t) { t.takes[1].begin += 1; }),
              HasSubstr("takes do not join"));
  EXPECT_THAT(message_after([](MotionTexture& t) { t.takes.pop_back(); }),
              HasSubstr("do not cover its frames"));
  EXPECT_THAT(message_after([](MotionTexture& t) { t.segments.pop_back(); }),
              HasSubstr("do not cover its takes"));
  EXPECT_THAT(message_after([](MotionTexture& t) { t.segments[0].texton = t.texton_count(); }),
              HasSubstr("out of range"));
  EXPECT_THAT(message_after([](MotionTexture& t) { t.segments[0].length += 1000000; }),
              HasSubstr("x.texture: "));
  EXPECT_THAT(message_after([](MotionTexture& t) { t.textons[0].dynamics.covariance *= -1.0; }),
              HasSubstr("positive definite"));
  EXPECT_THAT(message_after([](MotionTexture& t) { t.textons[0].basis *= 2.0; }),
              HasSubstr("orthonormal"));
  EXPECT_THAT(message_after([](MotionTexture& t) { t.textons[0].residual_variance = 0.0; }),
              HasSubstr("not positive"));
  EXPECT_THAT(message_after([](MotionTexture& t) { t.space.scale[0] = 0.0; }),
              HasSubstr("scale of it is not positive"));
  EXPECT_THAT(message_after([](MotionTexture& t) { t.transition_counts(0, 0) = -1.0; }),
              HasSubstr("negative"));
  EXPECT_THAT(message_after([](MotionTexture& t) { t.min_frames = 2; }),
              HasSubstr("at least three frames"));
}

}  // namespace
}  // namespace laban::texture
