#include "laban/loop/endless_loop.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>

#include <gmock/gmock.h>

#include "laban/base/error.h"
#include "laban/io/clip_file.h"
#include "laban/math/rotation.h"
#include "laban/math/statistics.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/motion_quality.h"
#include "support/clips.h"
#include "support/listener.h"

#include "captures.h"

namespace laban::loop {
namespace {

using test::captures_root;
using test::load_capture;

motion::Capture phrase(const std::string& name) {
  return motion::find_capture(io::read_clip(std::filesystem::path(LABAN_SOURCE_DIR) /
                                            "data/phrase" / ("phrase_" + name + ".bvh"))
                                  .clip);
}

/// rms speed and acceleration of the standard joints a frame, ends left out.
struct Rates {
  std::vector<double> speed;
  std::vector<double> acceleration;
};

Rates rates_of(const motion::Clip& clip, const motion::Humanoid& humanoid) {
  const Eigen::Matrix3Xd all = motion::joint_positions(clip);
  std::vector<int> joints;
  for (int j = 0; j < clip.joint_count(); ++j) {
    if (humanoid.played_by(j)) joints.push_back(j);
  }
  const auto at = [&](int f, int j) -> Eigen::Vector3d {
    return all.col(static_cast<Eigen::Index>(f) * clip.joint_count() + j);
  };
  Rates rates;
  const double hz = clip.frame_rate_hz();
  for (int f = 0; f < clip.frame_count(); ++f) {
    const int g = std::clamp(f, 1, clip.frame_count() - 2);
    double v = 0.0;
    double a = 0.0;
    for (const int j : joints) {
      v += (0.5 * hz * (at(g + 1, j) - at(g - 1, j))).squaredNorm();
      a += (hz * hz * (at(g + 1, j) - 2.0 * at(g, j) + at(g - 1, j))).squaredNorm();
    }
    rates.speed.push_back(std::sqrt(v / static_cast<double>(joints.size())));
    rates.acceleration.push_back(std::sqrt(a / static_cast<double>(joints.size())));
  }
  return rates;
}

struct Usage {
  double share = 0.0;
  int most = 0;
};

Usage usage_of(const LoopedClip& looped, int frame_count) {
  std::map<int, int> shown;
  Usage usage;
  for (const double frame : looped.source_frames) {
    usage.most = std::max(usage.most, ++shown[static_cast<int>(std::lround(frame))]);
  }
  usage.share = static_cast<double>(shown.size()) / frame_count;
  return usage;
}

/// Greatest difference of two clips of one shape: degrees of a joint, metres of the root.
struct Difference {
  double degrees = 0.0;
  double metres = 0.0;
};

Difference difference(const motion::Clip& a, const motion::Clip& b) {
  Difference found;
  for (int f = 0; f < std::min(a.frame_count(), b.frame_count()); ++f) {
    for (int j = 0; j < a.joint_count(); ++j) {
      found.degrees =
          std::max(found.degrees, math::angle_between(a.rotation(f, j), b.rotation(f, j)) * 180.0 /
                                      std::numbers::pi);
    }
    found.metres =
        std::max(found.metres, (a.root_positions().col(f) - b.root_positions().col(f)).norm());
  }
  return found;
}

TEST(EndlessLoop, BeginsAsTheClipDoes) {
  const motion::Capture bow = phrase("bow_p01");
  LoopOptions options;
  options.hold_feet = false;
  EndlessLoop endless(bow, options);
  const LoopedClip looped = endless.next(20);
  const Difference found = difference(looped.clip, bow.clip.slice(0, 20));
  EXPECT_LT(found.degrees, 1e-9);
  EXPECT_LT(found.metres, 1e-12);
  EXPECT_EQ(looped.source_frames[7], 7.0);
}

TEST(EndlessLoop, TellsProgressAndCanBeStopped) {
  const motion::Capture kick = phrase("kick_p01");
  test::expect_told_and_stopped(
      10, [&](base::Progress* progress) { (void)EndlessLoop(kick, {}).next(3000, progress); });
}

TEST(EndlessLoop, PiecesOfAnySizeGiveTheSameFrames) {
  const motion::Capture kick = phrase("kick_p01");
  EndlessLoop whole(kick, {});
  const LoopedClip all = whole.next(1500);
  EndlessLoop pieces(kick, {});
  int done = 0;
  for (const int count : {1, 2, 497, 1000}) {
    const LoopedClip piece = pieces.next(count);
    const Difference found = difference(piece.clip, all.clip.slice(done, done + count));
    EXPECT_LT(found.degrees, 1e-6);
    EXPECT_EQ(found.metres, 0.0);
    done += count;
  }
}

TEST(EndlessLoop, TheSeedDecides) {
  const motion::Capture kick = phrase("kick_p02");
  LoopOptions options;
  options.seed = 5;
  const LoopedClip one = EndlessLoop(kick, options).next(900);
  const LoopedClip again = EndlessLoop(kick, options).next(900);
  EXPECT_EQ(one.source_frames, again.source_frames);
  options.seed = 6;
  EXPECT_NE(one.source_frames, EndlessLoop(kick, options).next(900).source_frames);
}

TEST(EndlessLoop, PartsCoverEveryFrame) {
  EndlessLoop endless(phrase("wave_p03"), {});
  const LoopedClip looped = endless.next(1200);
  std::int64_t at = 1;  // frame 0 is the clip's first
  for (const LoopPart& part : looped.parts) {
    EXPECT_EQ(part.begin, at);
    EXPECT_GT(part.end, part.begin);
    EXPECT_EQ(part.seam >= 0, part.step == LoopStep::kSeam);
    at = part.end;
  }
  EXPECT_GE(at, 1200);
}

TEST(EndlessLoop, InPlaceKeepsTheBodyAboveTheOrigin) {
  LoopOptions options;
  options.in_place = true;
  const motion::Capture walk = phrase("walk_p01");
  const LoopedClip looped = EndlessLoop(walk, options).next(800);
  const Eigen::Matrix3Xd& roots = looped.clip.root_positions();
  EXPECT_LT(roots.row(0).cwiseAbs().maxCoeff(), 0.3);
  EXPECT_LT(roots.row(2).cwiseAbs().maxCoeff(), 0.3);
}

TEST(EndlessLoop, AWalkTravelsOnThroughItsSeams) {
  LoopOptions options;
  options.turns = false;
  const motion::Capture walk = phrase("walk_p01");
  const int frames = 1200;
  const LoopedClip looped = EndlessLoop(walk, options).next(frames);
  const double captured_speed =
      (walk.clip.root_positions().rightCols(1) - walk.clip.root_positions().leftCols(1)).norm() /
      walk.clip.duration_s();
  const Eigen::Matrix3Xd& path = looped.clip.root_positions();
  double length = 0.0;
  for (int f = 10; f < frames; f += 10) length += (path.col(f) - path.col(f - 10)).norm();
  EXPECT_GT(length / looped.clip.duration_s(), 0.7 * captured_speed);
}

// The step from the last frame to the first is as smooth as those within the clip.
TEST(SeamlessLoop, TheLastFrameFlowsIntoTheFirst) {
  for (const char* name : {"walk_p01", "kick_p04", "wave_p02", "bow_p05"}) {
    SCOPED_TRACE(name);
    const motion::Capture capture = phrase(name);
    LoopOptions options;
    options.in_place = true;
    const SeamlessLoop loop = seamless_loop(capture, options);
    EXPECT_TRUE(loop.closed);
    const int last = loop.clip.frame_count() - 1;
    for (int j = 0; j < loop.clip.joint_count(); ++j) {
      const auto q = [&](int f) { return loop.clip.rotation((f + last + 1) % (last + 1), j); };
      // Second difference of rotations over the seam: predicted by the frames before it.
      const Eigen::Quaterniond predicted = q(last) * (q(last - 1).conjugate() * q(last));
      EXPECT_LT(math::angle_between(predicted, q(0)), 0.02) << loop.clip.skeleton().joint(j).name;
    }
  }
}

TEST(SeamlessLoop, ARoundTakesTheFirstFrameToWhereTheLastOneGoes) {
  const SeamlessLoop walk = seamless_loop(phrase("walk_p02"));
  const Eigen::Matrix3Xd& root = walk.clip.root_positions();
  const Eigen::Index last = root.cols() - 1;
  const Eigen::Vector3d next =
      math::yaw_rotation(walk.round_yaw_rad) * root.col(0) + walk.round_shift_m;
  EXPECT_NEAR(walk.round_shift_m.y(), 0.0, 1e-12);
  EXPECT_GT((next - root.col(0)).norm(), 0.5);
  // As far as from frame to frame before.
  EXPECT_LT((next - 2.0 * root.col(last) + root.col(last - 1)).norm(), 0.005);
}

TEST(SeamlessLoop, AWalkIsLeftToTravelAndABowIsClosed) {
  const SeamlessLoop walk = seamless_loop(phrase("walk_p02"));
  EXPECT_FALSE(walk.closed);
  EXPECT_GT(walk.travel_m, 0.3);
  const SeamlessLoop bow = seamless_loop(phrase("bow_p02"));
  EXPECT_EQ(bow.round_shift_m.norm(), 0.0);
  EXPECT_TRUE(bow.closed);
  EXPECT_EQ(bow.travel_m, 0.0);
}

// They stand while it travels; then the travel is taken out.
TEST(SeamlessLoop, AWalkInPlaceHasItsFeetHeldToo) {
  LoopOptions options;
  options.in_place = true;
  const motion::Capture walk = phrase("walk_p02");
  const SeamlessLoop loop = seamless_loop(walk, options);
  EXPECT_TRUE(loop.closed);
  EXPECT_GT(loop.foot_stances, 0);
  options.in_place = false;
  EXPECT_EQ(loop.foot_stances, seamless_loop(walk, options).foot_stances);
}

/// The capture on a path that bends by so much a frame.
motion::Capture bent(const motion::Capture& capture, double yaw_per_frame) {
  const motion::Clip& clip = capture.clip;
  Eigen::Matrix3Xd roots(3, clip.frame_count());
  std::vector<Eigen::Quaterniond> rotations;
  Eigen::Vector3d place = clip.root_positions().col(0);
  for (int f = 0; f < clip.frame_count(); ++f) {
    const Eigen::Quaterniond turn = math::yaw_rotation(yaw_per_frame * f);
    if (f > 0) {
      place += turn * (clip.root_positions().col(f) - clip.root_positions().col(f - 1)).eval();
    }
    roots.col(f) = place;
    const auto local = clip.rotations(f);
    rotations.insert(rotations.end(), local.begin(), local.end());
    Eigen::Quaterniond& root = rotations[rotations.size() - local.size()];
    root = (turn * root).normalized();
  }
  return {motion::Clip(clip.shared_skeleton(), clip.frame_rate_hz(), roots, rotations),
          capture.humanoid};
}

TEST(SeamlessLoop, AWalkOnABentPathFacesTheSameWayAgainInPlace) {
  LoopOptions options;
  options.in_place = true;
  const SeamlessLoop loop = seamless_loop(bent(phrase("walk_p01"), 0.01), options);
  const int last = loop.clip.frame_count() - 1;
  EXPECT_LT(math::angle_between(loop.clip.rotation(last, 0), loop.clip.rotation(0, 0)), 0.05);
}

TEST(JoinClips, BeginsAsTheFirstAndEndsAsTheSecond) {
  const motion::Capture bow = phrase("bow_p01");
  const motion::Capture kick = phrase("kick_p01");
  LoopOptions options;
  options.hold_feet = false;
  const JoinedClips joined = join_clips(bow, kick, options);
  const int rest = kick.clip.frame_count() - joined.seam.in_begin - joined.seam.frames;
  ASSERT_EQ(joined.clip.frame_count(), joined.seam_end + rest);
  const Difference head =
      difference(joined.clip.slice(0, joined.seam_begin), bow.clip.slice(0, joined.seam_begin));
  EXPECT_LT(head.degrees, 1e-6);
  // Beyond the seam joints other than the root are the second clip's own.
  const int f = joined.seam_end + rest / 2;
  const int g = joined.seam.in_begin + joined.seam.frames + rest / 2;
  for (int j = 1; j < kick.clip.joint_count(); ++j) {
    EXPECT_LT(math::angle_between(joined.clip.rotation(f, j), kick.clip.rotation(g, j)), 1e-6);
  }
}

/// The same motion on a floor so much higher, metres.
motion::Capture lifted(const motion::Capture& capture, double by_m) {
  const motion::Clip& clip = capture.clip;
  Eigen::Matrix3Xd places = clip.root_positions();
  places.row(1).array() += by_m;
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < clip.frame_count(); ++f) {
    rotations.insert(rotations.end(), clip.rotations(f).begin(), clip.rotations(f).end());
  }
  return {motion::Clip(clip.shared_skeleton(), clip.frame_rate_hz(), places, rotations),
          capture.humanoid};
}

// Captures put their floor off by centimetres: the second clip is to stand where the first does.
TEST(JoinClips, StandOnOneFloor) {
  const motion::Capture bow = phrase("bow_p01");
  const motion::Capture kick = phrase("kick_p01");
  const JoinedClips even = join_clips(bow, kick);
  const JoinedClips uneven = join_clips(bow, lifted(kick, 0.08));
  ASSERT_EQ(even.clip.frame_count(), uneven.clip.frame_count());
  const auto heights = [](const JoinedClips& joined) -> Eigen::RowVectorXd {
    return joined.clip.root_positions().row(1);
  };
  EXPECT_LT((heights(even) - heights(uneven)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(EndlessLoop, RefusesClipsThatAreTooShortAndOptionsOutOfRange) {
  const motion::Capture bow = phrase("bow_p01");
  const motion::Capture tiny{bow.clip.slice(0, 7), bow.humanoid};
  EXPECT_THROW(EndlessLoop(tiny, {}), base::Error);
  EXPECT_THROW((void)seamless_loop(tiny), base::Error);
  EXPECT_THROW((void)join_clips(bow, tiny), base::Error);
  try {
    (void)join_clips(bow, tiny);
  } catch (const base::Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("second clip of at least 8 frames, not 7"));
  }
  LoopOptions options;
  options.seam.overlap_frames = 200;
  EXPECT_THROW(EndlessLoop(bow, options), base::Error);
  options = {};
  options.seam_count = 0;
  EXPECT_THROW(EndlessLoop(bow, options), base::Error);
  EXPECT_THROW((void)EndlessLoop(bow, {}).next(0), base::Error);
}

TEST(EndlessLoop, ShortestClipsPlayOn) {
  const motion::Capture bow = phrase("bow_p01");
  const motion::Capture eight{bow.clip.slice(20, 28), bow.humanoid};
  EXPECT_EQ(EndlessLoop(eight, {}).next(300).clip.frame_count(), 300);
  EXPECT_GE(seamless_loop(eight).clip.frame_count(), 4);
}

class Captured : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!captures_root()) GTEST_SKIP() << test::kNoCaptures;
  }
  [[nodiscard]] static motion::Capture capture(const std::string& path, int most_frames = 0) {
    return motion::find_capture(load_capture(*captures_root() / path, most_frames));
  }
};

/// Greatest speed and acceleration of the overlaps of all seams that are played, in the capture's
/// own 99th percentiles.
struct SeamRates {
  double speed = 0.0;
  double acceleration = 0.0;
  int seams = 0;
};

SeamRates seam_rates(const motion::Capture& capture) {
  LoopOptions options;
  options.turns = false;
  const LoopedClip looped =
      EndlessLoop(capture, options).next(2 * capture.clip.frame_count() + 400);
  const Rates made = rates_of(looped.clip, capture.humanoid);
  // Without what is left of a T-pose.
  const Rates own = rates_of(capture.clip.slice(3, capture.clip.frame_count()), capture.humanoid);
  SeamRates found;
  for (const LoopPart& part : looped.parts) {
    if (part.step != LoopStep::kSeam) continue;
    ++found.seams;
    for (auto f = part.begin; f < std::min<std::int64_t>(part.end, std::ssize(made.speed)); ++f) {
      const auto n = static_cast<std::size_t>(f);
      found.speed = std::max(found.speed, made.speed[n] / math::percentile(own.speed, 99.0));
      found.acceleration = std::max(
          found.acceleration, made.acceleration[n] / math::percentile(own.acceleration, 99.0));
    }
  }
  return found;
}

TEST_F(Captured, SeamsAreNoQuickerThanTheirCapture) {
  for (const char* name :
       {"cmu_clips/walk_07_01.bvh", "cmu_clips/walk_08_01.bvh", "cmu_dance/salsa_01.bvh",
        "cmu_clips/ballet_05_02_expressive_arms_pirouette.bvh",
        "cmu_clips/kungfu_135_07_one_kick_209f_60fps.bvh",
        "cmu_clips/kungfu_135_07_mawashigeri_209f_30fps.bvh",
        "bandai1/dataset-1_bow_normal_001.bvh", "bandai1/dataset-1_byebye_normal_001.bvh",
        "hdm05/HDM_bd_squat1Reps_001_120.amc"}) {
    SCOPED_TRACE(name);
    const SeamRates rates = seam_rates(capture(name));
    EXPECT_GE(rates.seams, 1);
    EXPECT_LE(rates.acceleration, 1.0);
    EXPECT_LE(rates.speed, 1.0);
  }
}

// A squat whose ends are apart and which is nowhere as quick as a plain seam between them.
TEST_F(Captured, ASeamThatWouldBeTooQuickIsPlayedSlower) {
  const motion::Capture squat = capture("hdm05/HDM_bd_squat1Reps_001_120.amc");
  const SeamlessLoop loop = seamless_loop(squat);
  EXPECT_GT(loop.seam.played_frames, loop.seam.frames);
  EXPECT_LE(loop.seam.played_frames, 2 * loop.seam.frames);
  EXPECT_LE(loop.seam.speed_ratio, 1.0);
  EXPECT_LE(loop.seam.acceleration_ratio, 1.0);
  EXPECT_EQ(loop.seam_end - loop.seam_begin, loop.seam.played_frames);
  EXPECT_EQ(loop.seam_end, loop.clip.frame_count());
}

TEST_F(Captured, AWalkLoopsWithFeetNoWorseThanItsCapture) {
  for (const char* name : {"cmu_clips/walk_07_01.bvh", "cmu_clips/walk_08_01.bvh"}) {
    SCOPED_TRACE(name);
    const motion::Capture walk = capture(name);
    const motion::FootFloor floor =
        motion::find_foot_contacts(walk.clip, walk.humanoid).floor.value();
    const auto skate = [&](const motion::Clip& clip) {
      return motion::measure_quality(clip, walk.humanoid, floor).foot_skate_cm;
    };
    EXPECT_LE(skate(seamless_loop(walk).clip), skate(walk.clip));
    LoopOptions options;
    options.turns = false;
    EXPECT_LE(skate(EndlessLoop(walk, options).next(1700).clip), skate(walk.clip));
  }
}

// The paper's case: 1700 frames from a kick of 209.
TEST_F(Captured, AKickOf209FramesGives1700ThatUseNearlyAllOfThem) {
  const motion::Capture kick = capture("cmu_clips/kungfu_135_07_one_kick_209f_60fps.bvh");
  const int frames = kick.clip.frame_count();
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    LoopOptions options;
    options.seed = seed;
    options.hold_feet = false;  // which has no say in it
    const Usage usage = usage_of(EndlessLoop(kick, options).next(1700), frames);
    EXPECT_GE(usage.share, 0.9);
    EXPECT_LE(usage.most, 3.0 * 1700.0 / 209.0);
  }
}

}  // namespace
}  // namespace laban::loop
