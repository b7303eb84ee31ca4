#include "loop/led_feet.h"

#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "laban/io/clip_file.h"
#include "laban/motion/foot_contacts.h"

#include "captures.h"
#include "loop/seam_search.h"

namespace laban::loop {
namespace {

/// A capture as seams are looked for in it.
struct Sewable {
  explicit Sewable(const motion::Capture& given)
      : capture(flowing(given, first_flowing_frame(given.clip, given.humanoid))),
        rows(capture.clip.skeleton(), capture.humanoid),
        contacts(motion::find_foot_contacts(capture.clip, capture.humanoid)),
        frames(to_body_frames(capture.clip, rows, contacts.contacts)) {}
  [[nodiscard]] SeamTask task() const {
    const double rate_hz = capture.clip.frame_rate_hz();
    return {rows,    frames,         frames, rate_hz, usual_motion(rows, frames, rate_hz),
            capture, contacts.floor, true};
  }

  motion::Capture capture;
  BodyRows rows;
  motion::FoundContacts contacts;
  std::vector<BodyFrame> frames;
};

Sewable phrase_walk() {
  return Sewable(motion::find_capture(
      io::read_clip(std::filesystem::path(LABAN_SOURCE_DIR) / "data/phrase/phrase_walk_p01.bvh")
          .clip));
}

/// A seam as it was found, and the plain cross-fade of its overlap.
SewnSeam faded(const Sewable& sewable, const SewnSeam& seam) {
  const auto overlap = [&](int begin) {
    const auto first = sewable.frames.begin() + begin;
    return std::vector<BodyFrame>(first, first + seam.found.frames);
  };
  std::vector<BodyFrame> incoming = overlap(seam.found.in_begin);
  for (BodyFrame& frame : incoming) frame.move(seam.outgoing_from_incoming);
  SewnSeam fade = seam;
  fade.frames = cross_fade(overlap(seam.found.out_begin), incoming);
  fade.found.played_frames = seam.found.frames;
  return fade;
}

TEST(SeamJudge, CapturedFramesAreAtNoDistanceWhereverTheyArePlayed) {
  const Sewable walk = phrase_walk();
  const SeamTask task = walk.task();
  SewnSeam seam;
  seam.found = {30, 30, 20, 20, 0.0, {}, 0.0, 0.0};
  seam.frames.assign(walk.frames.begin() + 30, walk.frames.begin() + 50);
  const SeamJudge judge(task);
  EXPECT_LT(judge.figures(seam, false).nearest_cm, 1e-3);
  // Elsewhere and turned it is the same pose; a raised one is not.
  for (BodyFrame& frame : seam.frames) frame.move({1.0, Eigen::Vector3d(3.0, 0.0, -2.0)});
  EXPECT_LT(judge.figures(seam, false).nearest_cm, 1e-3);
  for (BodyFrame& frame : seam.frames) frame.hips.y() += 0.2;
  EXPECT_GT(judge.figures(seam, false).nearest_cm, 5.0);
}

TEST(SeamJudge, FeetThatSlideAreSeen) {
  const Sewable walk = phrase_walk();
  const SeamTask task = walk.task();
  SewnSeam seam;
  seam.found = {30, 30, 20, 20, 0.0, {}, 0.0, 0.0};
  seam.frames.assign(walk.frames.begin() + 30, walk.frames.begin() + 50);
  const SeamJudge judge(task);
  const double captured = judge.figures(seam, false).skate_cm;
  // Half a centimetre a frame to the side.
  for (std::size_t t = 0; t < seam.frames.size(); ++t) {
    seam.frames[t].hips.x() += 0.005 * static_cast<double>(t);
  }
  EXPECT_GT(judge.figures(seam, false).skate_cm, captured + 0.1);
}

// The bar of the method: against plain cross-fading of the same frames feet slide less and frames
// stay nearer to the captured ones, on clips of different kinds.
TEST(LedFeet, SeamsSlideLessAndStayNearerToTheirCaptureThanCrossFades) {
  const auto root = test::captures_root();
  if (!root) GTEST_SKIP() << test::kNoCaptures;
  double nearest = 0.0;
  double nearest_faded = 0.0;
  for (const char* name :
       {"cmu_clips/walk_07_01.bvh", "cmu_clips/walk_08_01.bvh", "cmu_dance/salsa_01.bvh",
        "cmu_clips/ballet_05_02_expressive_arms_pirouette.bvh",
        "cmu_clips/kungfu_135_07_one_kick_209f_60fps.bvh", "bandai1/dataset-1_bow_normal_001.bvh",
        "bandai1/dataset-1_byebye_normal_001.bvh", "hdm05/HDM_bd_squat1Reps_001_120.amc"}) {
    SCOPED_TRACE(name);
    const Sewable sewable(motion::find_capture(test::load_capture(*root / name, 0)));
    const SeamTask task = sewable.task();
    const SeamJudge judge(task);
    SeamFigures own;
    SeamFigures plain;
    for (const SewnSeam& seam : find_seams(task, {}, 3)) {
      const SeamFigures sewn = judge.figures(seam, true);
      const SeamFigures fade = judge.figures(faded(sewable, seam), false);
      own.skate_cm += sewn.skate_cm;
      own.nearest_cm += sewn.nearest_cm;
      plain.skate_cm += fade.skate_cm;
      plain.nearest_cm += fade.nearest_cm;
    }
    EXPECT_LT(own.skate_cm, plain.skate_cm);
    EXPECT_LT(own.nearest_cm, plain.nearest_cm);
    nearest += own.nearest_cm;
    nearest_faded += plain.nearest_cm;
  }
  EXPECT_LT(nearest, 0.8 * nearest_faded);
}

}  // namespace
}  // namespace laban::loop
