#include "laban/texture/texton_walk.h"

#include <cmath>
#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "standard_rig.h"
#include "synthetic_texture.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kSegment = 120;

/// Takes of an arm that swings once in each segment of two seconds, so that the same pose and
/// velocity come again at the same place of every segment. At the end of each take the arm rests, a
/// radian from everything else, for `rest` seconds.
MotionTexture swinging_texture(const std::vector<std::vector<int>>& takes, double rest = 0.0) {
  MotionTexture texture = test::empty_texture();
  texture.min_frames = 60;
  texture.space.reference.fill(Eigen::Quaterniond::Identity());
  texture.space.scale = Eigen::VectorXd::Ones(kObservationRows);
  int textons = 0;
  int frames = 0;
  const int resting = static_cast<int>(60.0 * rest);
  for (const auto& labels : takes) {
    const int begin = frames;
    for (const int label : labels) {
      textons = std::max(textons, label + 1);
      texture.segments.push_back({frames, kSegment, label});
      frames += kSegment;
    }
    texture.segments.back().length += resting;
    frames += resting;
    texture.takes.push_back({"", begin, frames - begin, 0, 1.0});
  }
  texture.textons.resize(static_cast<std::size_t>(textons));
  texture.transition_counts = MatrixXd::Zero(textons, textons);
  texture.observations = MatrixXd::Zero(kObservationRows, frames);
  for (std::size_t n = 0; n < texture.segments.size(); ++n) {
    const Segment& one = texture.segments[n];
    for (int f = 0; f < one.length; ++f) {
      const double phase = 2.0 * std::numbers::pi * f / kSegment;
      texture.observations(30, one.begin + f) = f < kSegment ? 0.5 * std::sin(phase) : 1.0;
      texture.observations(31, one.begin + f) = f < kSegment ? 0.5 * std::cos(phase) : 1.5;
    }
    if (n > 0 && texture.segments[n - 1].begin + texture.segments[n - 1].length == one.begin) {
      const bool joined = std::none_of(texture.takes.begin(), texture.takes.end(),
                                       [&](const Take& take) { return take.begin == one.begin; });
      if (joined) texture.transition_counts(texture.segments[n - 1].texton, one.texton) += 1.0;
    }
  }
  return texture;
}

const Segment& segment_of(const MotionTexture& texture, int segment) {
  return texture.segments[static_cast<std::size_t>(segment)];
}

// After texton 0 come 1 (twice) and 2 (once), at poses that are all the same: M alone decides.
TEST(TextonWalk, FollowsTheTransitionMatrixWherePosesLetIt) {
  const MotionTexture texture =
      swinging_texture({{0, 1, 0, 2, 0, 1, 3, 0, 1, 0, 2, 0, 1, 3, 0, 1, 0, 2, 0, 1}});
  const MatrixXd m = transition_matrix(texture);
  TextonWalk walk(texture, 0, base::Rng(4));
  std::map<int, int> after_zero;
  int zeros = 0;
  for (int n = 0; n < 500; ++n) {
    const int from = walk.texton();
    static_cast<void>(walk.next());
    if (from != 0 || walk.texton() == 0) continue;
    ++zeros;
    ++after_zero[walk.texton()];
  }
  ASSERT_GT(zeros, 120);
  // A third; the deviation of a mean of 120 is 0.043.
  EXPECT_NEAR(static_cast<double>(after_zero[2]) / zeros, m(0, 2), 0.13);
}

TEST(TextonWalk, GoesFromFrameToFrameOfTheCorpus) {
  const MotionTexture texture = test::synthetic_texture();
  TextonWalk walk(texture, std::nullopt, base::Rng(2));
  for (int n = 0; n < 25; ++n) {
    const int segment = walk.segment();
    const int entered = walk.entered();
    const TextonChange change = walk.next();
    EXPECT_EQ(change.leaving, segment);
    EXPECT_EQ(change.entering, walk.segment());
    EXPECT_EQ(change.enter, walk.entered());
    EXPECT_GE(change.leave, entered + 3);
    // Both go on for a frame in the take that they are of.
    for (const int frame : {change.leave, change.enter}) {
      const bool inside =
          std::any_of(texture.takes.begin(), texture.takes.end(), [&](const Take& take) {
            return frame >= take.begin && frame + 1 < take.begin + take.length;
          });
      EXPECT_TRUE(inside) << frame;
    }
    if (change.is_captured()) EXPECT_EQ(change.entering, change.leaving + 1);
  }
}

TEST(TextonWalk, MeetsHalfwayOrInAPoseThatWasSeen) {
  const MotionTexture texture = swinging_texture({{0, 1, 0, 2, 0, 1}, {2, 1, 0, 1}});
  TextonWalk walk(texture, std::nullopt, base::Rng(2));
  int crossings = 0;
  for (int n = 0; n < 60; ++n) {
    const TextonChange change = walk.next();
    ASSERT_EQ(change.meeting.cols(), 2);
    const auto& y = texture.observations;
    const double apart =
        offset_between(texture.space, y.col(change.leave), y.col(change.enter)).norm();
    const double left =
        offset_between(texture.space, y.col(change.leave), change.meeting.col(0)).norm();
    const double right =
        offset_between(texture.space, y.col(change.enter), change.meeting.col(0)).norm();
    EXPECT_NEAR(left, 0.5 * apart, 1e-9);
    EXPECT_NEAR(right, 0.5 * apart, 1e-9);
    crossings += !change.is_captured();
  }
  EXPECT_GT(crossings, 5);
}

// The rest is near nothing: who walks on to its end has to come back from a radian away.
TEST(TextonWalk, SeldomGoesOnToAnEndThatIsNearNothing) {
  const MotionTexture texture = swinging_texture({{0, 1, 0, 1, 0, 1}, {0, 1, 0, 1}}, 0.5);
  TextonWalk walk(texture, std::nullopt, base::Rng(3));
  int crossings = 0;
  int from_far = 0;
  for (int n = 0; n < 120; ++n) {
    const TextonChange change = walk.next();
    const auto& y = texture.observations;
    crossings += !change.is_captured();
    from_far +=
        offset_between(texture.space, y.col(change.leave), y.col(change.enter)).norm() > 0.2;
  }
  ASSERT_GT(crossings, 40);
  EXPECT_LE(4 * from_far, crossings);
}

TEST(TextonWalk, VisitsAllTakes) {
  const MotionTexture texture = swinging_texture({{0, 1, 0}, {1, 2, 1}, {3, 4, 0}, {4, 4, 2}});
  TextonWalk walk(texture, std::nullopt, base::Rng(9));
  std::map<int, int> visits;
  for (int n = 0; n < 60; ++n) {
    ++visits[walk.segment()];
    static_cast<void>(walk.next());
  }
  EXPECT_GE(visits.size(), 10U);
}

// Nothing can be entered in takes so short; the walk begins anew.
TEST(TextonWalk, GoesOnInTakesTooShortToChooseFrom) {
  MotionTexture texture = swinging_texture({{0}, {1}});
  texture.observations = texture.observations.leftCols(8).eval();
  texture.segments = {{0, 4, 0}, {4, 4, 1}};
  texture.takes = {{"", 0, 4, 0, 1.0}, {"", 4, 4, 0, 1.0}};
  TextonWalk walk(texture, 0, base::Rng(6));
  std::map<int, int> visits;
  for (int n = 0; n < 50; ++n) ++visits[segment_of(texture, walk.next().entering).texton];
  EXPECT_GT(visits[0], 0);
  EXPECT_GT(visits[1], 0);
}

TEST(TextonWalk, RefusesTextonsThatAreNotThere) {
  const MotionTexture texture = swinging_texture({{0, 1}});
  EXPECT_THROW(TextonWalk(texture, 5, base::Rng(7)), base::Error);
  EXPECT_THROW(TextonWalk(test::empty_texture(), std::nullopt, base::Rng(7)), base::Error);
}

}  // namespace
}  // namespace laban::texture
