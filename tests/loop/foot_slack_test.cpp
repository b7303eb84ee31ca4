#include "loop/foot_slack.h"

#include <cmath>
#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>

#include "laban/io/clip_file.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/humanoid.h"

namespace laban::loop {
namespace {

constexpr int kFrames = 60;
constexpr int kBlend = 30;
constexpr double kApartM = 0.06;

/// A walk over itself, a step to the side: feet swing and stand in the overlap.
class FeetOverASeam : public ::testing::Test {
 protected:
  FeetOverASeam()
      : capture(motion::find_capture(io::read_clip(std::filesystem::path(LABAN_SOURCE_DIR) /
                                                   "data/phrase/phrase_walk_p01.bvh")
                                         .clip)),
        rows(capture.clip.skeleton(), capture.humanoid) {
    const auto contacts = motion::find_foot_contacts(capture.clip, capture.humanoid).contacts;
    const std::vector<BodyFrame> all = to_body_frames(capture.clip, rows, contacts);
    const auto begin = all.begin() + 20;
    outgoing.assign(begin, begin + kFrames);
    incoming = outgoing;
    for (BodyFrame& frame : incoming) frame.move({0.0, Eigen::Vector3d(kApartM, 0.0, 0.0)});
    window = join_window(rows, outgoing, incoming, {.blend_frames = kBlend});
    over = feet_over_seam(rows, outgoing, incoming, window, kBlend, rate(), 0.0);
  }
  [[nodiscard]] double rate() const { return capture.clip.frame_rate_hz(); }
  [[nodiscard]] Eigen::Vector3d place(const BodyFrame& frame, int row) const {
    return positions(rows, frame).col(row);
  }

  motion::Capture capture;
  BodyRows rows;
  std::vector<BodyFrame> outgoing, incoming;
  JoinedWindow window;
  FeetOverSeam over;
};

TEST_F(FeetOverASeam, BeginWithTheOneMotionAndEndWithTheOther) {
  for (std::size_t side = 0; side < 2; ++side) {
    const int foot = rows.feet[2 * side];
    EXPECT_LT((over.goals[side].col(0) - place(outgoing.front(), foot)).norm(), 1e-12);
    EXPECT_LT((over.goals[side].col(kFrames - 1) - place(incoming.back(), foot)).norm(), 1e-12);
    // The last step is as captured but for a sliver of what is made up for.
    EXPECT_LT((over.goals[side].col(kFrames - 2) - place(incoming[kFrames - 2], foot)).norm(),
              0.01 * kApartM);
  }
}

// The motions are the same but for the shift: a foot's steps to the side beyond its own are what it
// makes up for.
TEST_F(FeetOverASeam, StandingFeetMakeUpForLessThanABlendWould) {
  double led = 0.0;
  double blended = 0.0;
  for (std::size_t side = 0; side < 2; ++side) {
    const int foot = rows.feet[2 * side];
    double all = 0.0;
    for (int t = 1; t < kFrames; ++t) {
      const auto at = static_cast<std::size_t>(t);
      const Eigen::Vector3d own = place(outgoing[at], foot) - place(outgoing[at - 1], foot);
      const double by = (over.goals[side].col(t) - over.goals[side].col(t - 1)).x() - own.x();
      all += by;
      if (own.norm() * rate() > 0.2) continue;
      led += std::abs(by);
      blended += std::abs(
          (place(window.frames[at], foot) - place(window.frames[at - 1], foot)).x() - own.x());
    }
    EXPECT_NEAR(all, kApartM, 1e-9);
  }
  EXPECT_GT(blended, 0.25 * kApartM);
  EXPECT_LT(led, 0.5 * blended);
  EXPECT_LT(over.slide_m, 2.0 * kApartM);
}

TEST_F(FeetOverASeam, WhereTheMotionsAgreeFeetGoTheirWay) {
  const JoinedWindow same = join_window(rows, outgoing, outgoing, {.blend_frames = kBlend});
  const FeetOverSeam feet = feet_over_seam(rows, outgoing, outgoing, same, kBlend, rate(), 0.0);
  EXPECT_NEAR(feet.slide_m, 0.0, 1e-9);
  for (int t = 0; t < kFrames; ++t) {
    EXPECT_LT(
        (feet.goals[0].col(t) - place(outgoing[static_cast<std::size_t>(t)], rows.feet[0])).norm(),
        1e-6);
  }
}

// From the path that slides least to the window's own.
TEST_F(FeetOverASeam, ThePullBringsFeetBackToWhereTheWindowHasThem) {
  double off_before = 1e9;
  double slide_before = 0.0;
  for (const double pull_per_s : {0.0, 5.0, 20.0, 1e5}) {
    const FeetOverSeam feet =
        feet_over_seam(rows, outgoing, incoming, window, kBlend, rate(), pull_per_s);
    double off = 0.0;
    for (int t = 0; t < kFrames; ++t) {
      off +=
          (feet.goals[0].col(t) - place(window.frames[static_cast<std::size_t>(t)], rows.feet[0]))
              .norm();
    }
    EXPECT_LT(off, off_before) << pull_per_s;
    EXPECT_GT(feet.slide_m, slide_before) << pull_per_s;
    off_before = off;
    slide_before = feet.slide_m;
  }
  EXPECT_LT(off_before, 1e-4);
}

// Both motions are one but for the shift, so that alone was added.
TEST_F(FeetOverASeam, AddedStepsAreThoseOfNeitherMotion) {
  std::vector<BodyFrame> frames = window.frames;
  note_added_steps(rows, outgoing, incoming,
                   step_shares(rows, window.switch_frames, kFrames, kBlend), frames);
  for (Eigen::Index side = 0; side < 2; ++side) {
    Eigen::Vector3d all = Eigen::Vector3d::Zero();
    for (const BodyFrame& frame : frames) all += frame.added_steps.col(side);
    EXPECT_NEAR(all.x(), kApartM, 1e-9);
    EXPECT_NEAR(all.z(), 0.0, 1e-9);
    EXPECT_EQ(frames.front().added_steps.col(side).norm(), 0.0);
  }
  // A step turns with the body.
  BodyFrame turned = frames[kFrames / 2];
  turned.move({0.5 * std::numbers::pi, Eigen::Vector3d::Zero()});
  EXPECT_NEAR(turned.added_steps(2, 0), -frames[kFrames / 2].added_steps(0, 0), 1e-12);
}

TEST_F(FeetOverASeam, AFrameBetweenTwoLiesOnACubic) {
  std::vector<BodyFrame> frames(outgoing.begin(), outgoing.begin() + 6);
  for (int t = 0; t < 6; ++t) {
    BodyFrame& frame = frames[static_cast<std::size_t>(t)];
    frame.hips = Eigen::Vector3d(0.02 * t * t, 1.0, 0.1 * t);
    frame.rotations[1] = Eigen::AngleAxisd(0.01 * t * t, Eigen::Vector3d::UnitX());
  }
  const BodyFrame between = sample(frames, 2.5);
  // Catmull-Rom curves of quadratics are exact.
  EXPECT_NEAR(between.hips.x(), 0.02 * 2.5 * 2.5, 1e-12);
  EXPECT_NEAR(between.rotations[1].angularDistance(Eigen::Quaterniond(
                  Eigen::AngleAxisd(0.01 * 2.5 * 2.5, Eigen::Vector3d::UnitX()))),
              0.0, 1e-7);
  EXPECT_EQ(sample(frames, 3.0).hips, frames[3].hips);
  EXPECT_EQ(sample(frames, 9.0).hips, frames[5].hips);
}

}  // namespace
}  // namespace laban::loop
