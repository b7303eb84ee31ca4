#include "laban/loop/turning_points.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

// n = 3, s = 1: C(6, 2), C(6, 1), C(6, 0) = 15, 6, 1 of 22; s = 2: C(6, 1), then n - r s < 0.
TEST(TurningPoints, WeightsAreBinomialAndSumToOne) {
  const Eigen::VectorXd one = symmetry_weights(3, 1);
  EXPECT_NEAR(one[0], 15.0 / 22.0, 1e-14);
  EXPECT_NEAR(one[1], 6.0 / 22.0, 1e-14);
  EXPECT_NEAR(one[2], 1.0 / 22.0, 1e-14);
  const Eigen::VectorXd two = symmetry_weights(3, 2);
  EXPECT_NEAR(two[0], 1.0, 1e-14);
  EXPECT_EQ(two[1], 0.0);
  EXPECT_NEAR(symmetry_weights(5000, 1).sum(), 1.0, 1e-12);
  EXPECT_TRUE(symmetry_weights(5000, 3).allFinite());
}

// By hand: x = 0 1 2 1 0, window 2, D = |x_i - x_j|. Frame 2: 0. Frames 1 and 3 fit r = 1: |0 - 2|.
TEST(TurningPoints, SymmetryIsOneWhereMotionTurnsAndNoneNearTheEnds) {
  const std::vector<double> x = {0.0, 1.0, 2.0, 1.0, 0.0};
  const Eigen::VectorXd found = symmetry(5, symmetry_weights(2, 1), [&](int i, int j) {
    return std::abs(x[static_cast<std::size_t>(i)] - x[static_cast<std::size_t>(j)]);
  });
  EXPECT_EQ(found[0], -1.0);
  EXPECT_NEAR(found[1], 0.0, 1e-15);  // the largest sum maps to 0
  EXPECT_NEAR(found[2], 1.0, 1e-15);
  EXPECT_NEAR(found[3], 0.0, 1e-15);
  EXPECT_EQ(found[4], -1.0);
}

/// Swings as cos(2 pi f / 60): it turns at frames 30, 60, 90 ..
Eigen::MatrixXd swing(int frames) {
  Eigen::MatrixXd angles = Eigen::MatrixXd::Zero(6, frames);
  for (int f = 0; f < frames; ++f) {
    angles(0, f) = std::cos(2.0 * std::numbers::pi * f / 60.0);
    angles(4, f) = -0.5 * angles(0, f);
  }
  return angles;
}

TEST(TurningPoints, ASwingTurnsWhereItStops) {
  for (const FrameDistance distance : {FrameDistance::kMahalanobis, FrameDistance::kL2}) {
    const Turning turning = find_turning_points(swing(151), 60.0, {.distance = distance});
    ASSERT_EQ(turning.points.size(), 4u);
    for (std::size_t n = 0; n < 4; ++n) {
      EXPECT_EQ(turning.points[n].frame, 30 * (static_cast<int>(n) + 1));
      EXPECT_NEAR(turning.points[n].symmetry, 1.0, 1e-9);
      EXPECT_EQ(turning.points[n].most_probability(), 0.5 * turning.points[n].symmetry);
    }
  }
}

TEST(TurningPoints, EndsAreStillWhereTheSwingStopsThere) {
  const Turning still = find_turning_points(swing(151), 60.0);
  // Mirrored through its own end a peak becomes an S: near 1, not 1.
  EXPECT_GT(still.first_symmetry, 0.8);
  EXPECT_GT(still.last_symmetry, 0.8);  // frame 150
  // Frame 135 passes the middle at full speed.
  EXPECT_LT(find_turning_points(swing(136), 60.0).last_symmetry, 0.1);
}

TEST(TurningPoints, AThresholdLeavesTheBestOnly) {
  Eigen::MatrixXd angles = swing(151);
  // Something moves on at frame 60 while the rest turns.
  for (int f = 0; f < 151; ++f) angles(2, f) = 0.2 * std::tanh((f - 60) / 5.0);
  const auto frames = [&](double threshold) {
    std::vector<int> found;
    for (const auto& point : find_turning_points(angles, 60.0, {.threshold = threshold}).points) {
      found.push_back(point.frame);
    }
    return found;
  };
  EXPECT_THAT(frames(0.98), ::testing::Not(::testing::Contains(60)));
  EXPECT_THAT(frames(0.98), ::testing::Contains(90));
}

TEST(TurningPoints, AStillMotionHasNone) {
  const Turning turning = find_turning_points(Eigen::MatrixXd::Constant(6, 90, 0.1), 60.0);
  EXPECT_TRUE(turning.points.empty());
  EXPECT_EQ(turning.symmetry.maxCoeff(), -1.0);
}

TEST(TurningPoints, RefusesOptionsOutOfRange) {
  EXPECT_THROW((void)find_turning_points(swing(60), 60.0, {.window_s = 0.0}), base::Error);
  EXPECT_THROW((void)find_turning_points(swing(60), 60.0, {.falloff = 0}), base::Error);
  EXPECT_THROW((void)find_turning_points(swing(60), 60.0, {.threshold = 1.5}), base::Error);
}

}  // namespace
}  // namespace laban::loop
