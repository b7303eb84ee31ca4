#include "laban/loop/distance_map.h"

#include <gmock/gmock.h>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

/// Two joints, three frames: joint 0 moves by (3, 4, 0) and back, joint 1 by (0, 0, 12) and stays.
Eigen::MatrixXd by_hand() {
  Eigen::MatrixXd angles = Eigen::MatrixXd::Zero(6, 3);
  angles.col(1) << 3.0, 4.0, 0.0, 0.0, 0.0, 12.0;
  angles.col(2) << 0.0, 0.0, 0.0, 0.0, 0.0, 12.0;
  return angles;
}

// [Graphcut, eq. 1]: sums of joints' distances 5 + 12, 12 and 5.
TEST(DistanceMap, L2IsTheSimilarityOfThePaper) {
  const Eigen::MatrixXd map = l2_similarity(by_hand(), 10.0);
  EXPECT_NEAR(map(0, 1), std::exp(-1.7), 1e-15);
  EXPECT_NEAR(map(0, 2), std::exp(-1.2), 1e-15);
  EXPECT_NEAR(map(1, 2), std::exp(-0.5), 1e-15);
  EXPECT_EQ(map(1, 0), map(0, 1));
  EXPECT_EQ(map(2, 2), 1.0);
  EXPECT_NEAR(mean_l2_distance(by_hand()), (17.0 + 12.0 + 5.0) / 3.0, 1e-14);
  EXPECT_EQ(l2_similarity(by_hand())(0, 1),
            l2_similarity(by_hand(), mean_l2_distance(by_hand()))(0, 1));
}

// Velocities at 2 Hz: row 0 has 6, -6 (variance 36), row 1 8, -8 (64), row 5 24, 0 (144).
TEST(DistanceMap, MahalanobisDividesByTheVarianceOfVelocities) {
  const Eigen::VectorXd variance = velocity_variance(by_hand(), 2.0);
  EXPECT_NEAR(variance[0], 36.0, 1e-12);
  EXPECT_NEAR(variance[1], 64.0, 1e-12);
  EXPECT_NEAR(variance[5], 144.0, 1e-12);
  // Still rows: a hundredth of the mean of all.
  EXPECT_NEAR(variance[2], 0.01 * (36.0 + 64.0 + 144.0) / 6.0, 1e-12);
  const Eigen::MatrixXd map = mahalanobis_distance(by_hand(), variance);
  EXPECT_NEAR(map(0, 1), 9.0 / 36.0 + 16.0 / 64.0 + 144.0 / 144.0, 1e-14);
  EXPECT_NEAR(map(0, 2), 1.0, 1e-14);
  EXPECT_EQ(map(2, 0), map(0, 2));
  EXPECT_EQ(map(1, 1), 0.0);
}

TEST(DistanceMap, StillMotionHasNoScaleAndNoDistance) {
  const Eigen::MatrixXd still = Eigen::MatrixXd::Constant(6, 4, 0.3);
  EXPECT_EQ(l2_similarity(still).minCoeff(), 1.0);
  EXPECT_EQ(velocity_variance(still, 60.0), Eigen::VectorXd::Ones(6));
  EXPECT_EQ(mahalanobis_distance(still, velocity_variance(still, 60.0)).maxCoeff(), 0.0);
  EXPECT_EQ(velocity_variance(still.leftCols(1), 60.0), Eigen::VectorXd::Ones(6));
}

TEST(DistanceMap, RefusesWhatHasNoFramesOrScale) {
  EXPECT_THROW((void)l2_similarity(Eigen::MatrixXd(6, 0)), base::Error);
  EXPECT_THROW((void)l2_similarity(Eigen::MatrixXd::Zero(4, 2)), base::Error);
  EXPECT_THROW((void)l2_similarity(by_hand(), 0.0), base::Error);
  EXPECT_THROW((void)mahalanobis_distance(by_hand(), Eigen::VectorXd::Zero(6)), base::Error);
  EXPECT_THROW((void)mahalanobis_distance(by_hand(), Eigen::VectorXd::Ones(3)), base::Error);
}

}  // namespace
}  // namespace laban::loop
