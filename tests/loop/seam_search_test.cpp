#include "loop/seam_search.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "laban/io/clip_file.h"
#include "laban/math/rotation.h"
#include "laban/motion/foot_contacts.h"

namespace laban::loop {
namespace {

motion::Capture phrase(const std::string& name) {
  return motion::find_capture(io::read_clip(std::filesystem::path(LABAN_SOURCE_DIR) /
                                            "data/phrase" / ("phrase_" + name + ".bvh"))
                                  .clip);
}

/// Frames of a capture of the embedded corpus.
struct Frames {
  explicit Frames(const std::string& name)
      : capture(phrase(name)),
        rows(capture.clip.skeleton(), capture.humanoid),
        contacts(motion::find_foot_contacts(capture.clip, capture.humanoid)),
        all(to_body_frames(capture.clip, rows, contacts.contacts)) {}
  [[nodiscard]] SeamTask task(const std::vector<BodyFrame>& frames) const {
    const double rate_hz = capture.clip.frame_rate_hz();
    return {rows,    frames,         frames, rate_hz, usual_motion(rows, frames, rate_hz),
            capture, contacts.floor, true};
  }

  motion::Capture capture;
  BodyRows rows;
  motion::FoundContacts contacts;
  std::vector<BodyFrame> all;
};

// It stands still in the middle: there a seam is perfect, and a loop of nothing.
TEST(SeamSearch, ALoopShowsAThirdOfTheClipAtLeast) {
  const Frames kick("kick_p01");
  std::vector<BodyFrame> frames(kick.all.begin(), kick.all.begin() + 40);
  frames.insert(frames.end(), 30, kick.all[40]);
  frames.insert(frames.end(), kick.all.begin() + 41, kick.all.begin() + 80);
  SeamOptions options;
  options.texton_s = 0.0;
  options.texton_frames = 54;
  options.overlap_frames = 10;
  options.blend_frames = 8;
  const auto count = static_cast<double>(frames.size());
  for (const SewnSeam& seam : find_seams(kick.task(frames), options, 3)) {
    EXPECT_GE((seam.found.out_begin - seam.found.in_begin) / count, 1.0 / 3.0);
  }
}

// One pose all the time, so that what else differs is all of a seam's distance.
TEST(SeamSearch, VelocityAndStandingFeetCountToTheDistance) {
  const Frames kick("kick_p01");
  const double rate_hz = kick.capture.clip.frame_rate_hz();
  SeamOptions options;
  options.texton_s = 0.0;
  options.texton_frames = 30;
  options.overlap_frames = 10;
  options.blend_frames = 8;
  const auto least_distance_m = [&](const std::vector<BodyFrame>& frames) {
    double least = 1e9;
    for (const SewnSeam& seam : find_seams(kick.task(frames), options, 3)) {
      least = std::min(least, seam.found.distance_m);
    }
    return least;
  };
  std::vector<BodyFrame> still(60, kick.all[40]);
  EXPECT_NEAR(least_distance_m(still), 0.0, 1e-6);
  // The first half walks at 1 m/s, which parts the two by so much in a quarter of the overlap.
  std::vector<BodyFrame> moving = still;
  for (std::size_t f = 0; f < 30; ++f) moving[f].hips.z() -= static_cast<double>(30 - f) / rate_hz;
  EXPECT_GT(least_distance_m(moving), 0.5 * (2.5 / rate_hz) / kick.rows.count());
  std::vector<BodyFrame> standing = still;
  for (std::size_t f = 0; f < 60; ++f) {
    standing[f].contacts = f < 30 ? Eigen::Vector4d::Ones() : Eigen::Vector4d::Zero();
  }
  EXPECT_NEAR(least_distance_m(standing), 4.0 * 0.05 / kick.rows.count(), 1e-6);
}

TEST(SeamSearch, SeamsWithinTheRatesComeBeforeAllOthers) {
  SewnSeam calm;
  calm.found.speed_ratio = 0.9;
  calm.found.acceleration_ratio = 0.3;
  calm.worth_m = 0.05;
  SewnSeam quick = calm;
  quick.found.acceleration_ratio = 1.3;
  quick.worth_m = 0.01;
  EXPECT_TRUE(better(calm, quick));
  EXPECT_FALSE(better(quick, calm));
  // Both are good: now what they are worth.
  quick.found.acceleration_ratio = 0.94;
  EXPECT_TRUE(better(quick, calm));
}

// The same frames, turned and elsewhere.
TEST(SeamSearch, OverlapsAreAlignedByTurnAndShift) {
  const Frames walk("walk_p01");
  const std::vector<BodyFrame> outgoing(walk.all.begin() + 10, walk.all.begin() + 40);
  std::vector<BodyFrame> incoming = outgoing;
  const PlanarMotion away{0.7, Eigen::Vector3d(1.0, 0.0, -3.0)};
  for (BodyFrame& frame : incoming) frame.move(away);
  const PlanarMotion back = align_overlap(walk.rows, outgoing, incoming);
  EXPECT_NEAR(back.yaw, -0.7, 1e-9);
  EXPECT_LT((back(away(outgoing[5].hips)) - outgoing[5].hips).norm(), 1e-9);
}

TEST(SeamSearch, FramesThatLeapIntoTheMotionAreNoneOfIt) {
  const motion::Capture walk = phrase("walk_p01");
  EXPECT_EQ(first_flowing_frame(walk.clip, walk.humanoid), 0);
  // Two frames of another pose before it.
  const int frames = walk.clip.frame_count();
  Eigen::Matrix3Xd roots(3, frames);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < frames; ++f) {
    roots.col(f) = walk.clip.root_positions().col(f);
    const auto local = walk.clip.rotations(f);
    rotations.insert(rotations.end(), local.begin(), local.end());
    if (f >= 2) continue;
    for (int j = 1; j < walk.clip.joint_count(); ++j) {
      auto& rotation = rotations[rotations.size() - static_cast<std::size_t>(j)];
      rotation = math::exp({0.0, 0.0, 0.8}) * rotation;
    }
  }
  const motion::Clip posed(walk.clip.shared_skeleton(), walk.clip.frame_rate_hz(), roots,
                           rotations);
  EXPECT_EQ(first_flowing_frame(posed, walk.humanoid), 2);
  EXPECT_EQ(flowing({posed, walk.humanoid}, 2).clip.frame_count(), frames - 2);
}

// Steps add up to the same way in however many frames.
TEST(SewnSeam, ASeamThatIsPlayedSlowerKeepsWhatWasAddedToItsSteps) {
  const Frames kick("kick_p01");
  SeamTask task = kick.task(kick.all);
  // Around its quickest frame.
  const std::vector<double>& speeds = task.usual.speeds_m_s;
  const auto begin =
      static_cast<int>(std::max_element(speeds.begin(), speeds.end()) - speeds.begin()) - 10;
  SewnSeam seam;
  seam.found = {begin, begin, 20, 20, 0.0, {}, 0.0, 0.0};
  seam.frames.assign(kick.all.begin() + begin, kick.all.begin() + begin + 20);
  for (std::size_t t = 1; t < seam.frames.size(); ++t) {
    seam.frames[t].added_steps.col(0) = Eigen::Vector3d(0.001 * static_cast<double>(t), 0.0, 0.0);
  }
  measure_rates(task, seam);
  // The seam is quicker than its capture.
  task.usual.speed_m_s = 0.7 * seam.found.speed_ratio * task.usual.speed_m_s;
  task.usual.acceleration_m_s2 *= 100.0;
  measure_rates(task, seam);
  const auto added = [](const SewnSeam& one) {
    double sum = 0.0;
    for (const BodyFrame& frame : one.frames) sum += frame.added_steps(0, 0);
    return sum;
  };
  const double before = added(seam);
  calm(task, seam);
  EXPECT_GT(seam.found.played_frames, 20);
  EXPECT_NEAR(added(seam), before, 1e-9);
}

}  // namespace
}  // namespace laban::loop
