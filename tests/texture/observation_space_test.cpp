#include "laban/texture/observation_space.h"

#include <numbers>

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "laban/io/clip_file.h"
#include "laban/math/rotation.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"

namespace laban::texture {
namespace {

using Eigen::MatrixXd;

motion::PoseMatrix pose_of(const std::string& name) {
  const motion::Capture capture =
      motion::find_capture(io::read_clip(LABAN_SOURCE_DIR "/data/phrase/" + name + ".bvh").clip);
  return motion::to_pose_matrix(capture.clip, capture.humanoid);
}

/// The largest angle between two captures' joints.
double largest_angle(const motion::PoseMatrix& a, const motion::PoseMatrix& b) {
  double largest = 0.0;
  for (int f = 0; f < a.frame_count(); ++f) {
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      largest = std::max(largest, math::angle_between(math::exp(a.angles.block<3, 1>(3 * s, f)),
                                                      math::exp(b.angles.block<3, 1>(3 * s, f))));
    }
  }
  return largest;
}

TEST(ObservationSpace, PosesComeBack) {
  const std::vector<motion::PoseMatrix> takes = {pose_of("phrase_walk_p01"),
                                                 pose_of("phrase_bow_p02")};
  const ObservationSpace space = learn_observation_space(takes);
  for (const motion::PoseMatrix& take : takes) {
    const motion::PoseMatrix back =
        poses_of(space, observe(space, take), take.frame_rate_hz, take.leg_length_m);
    EXPECT_LT(largest_angle(take, back), 1e-9);
    EXPECT_TRUE(back.height.isApprox(take.height, 1e-12));
    EXPECT_TRUE(back.steps.isApprox(take.steps, 1e-12));
    EXPECT_EQ(back.frame_rate_hz, take.frame_rate_hz);
  }
}

TEST(ObservationSpace, AnglesAreAwayFromTheMeanPose) {
  const std::vector<motion::PoseMatrix> takes = {pose_of("phrase_walk_p01")};
  const ObservationSpace space = learn_observation_space(takes);
  const MatrixXd y = observe(space, takes.front());
  // The mean of the logarithms about the mean rotation vanishes but for the sphere's curvature.
  EXPECT_LT(y.topRows(motion::kAngleRowCount).rowwise().mean().cwiseAbs().maxCoeff(), 0.02);
  EXPECT_LT(y.topRows(motion::kAngleRowCount).cwiseAbs().maxCoeff(), 2.0);
  EXPECT_GT(takes.front().angles.rowwise().mean().cwiseAbs().maxCoeff(), 0.3);
}

// What steps weigh must not depend on the rate: half of it, steps twice as long.
TEST(ObservationSpace, StepsWeighTheSameAtEveryRate) {
  const motion::PoseMatrix fast = pose_of("phrase_walk_p01");
  const motion::PoseMatrix slow = motion::resample(fast, 0.5 * fast.frame_rate_hz);
  const double at_fast = learn_observation_space({&fast, 1}).scale[kObservationRows - 1];
  const double at_slow = learn_observation_space({&slow, 1}).scale[kObservationRows - 1];
  EXPECT_GT(at_fast, 3.0);
  EXPECT_NEAR(at_fast / at_slow, 2.0, 0.1);
}

ObservationSpace plain_space() {
  ObservationSpace space;
  space.reference.fill(Eigen::Quaterniond::Identity());
  space.scale = Eigen::VectorXd::Ones(kObservationRows);
  return space;
}

/// A forearm that turns about one axis from one angle to another, radians.
motion::PoseMatrix turning(double from, double to) {
  constexpr int kFrames = 60;
  motion::PoseMatrix pose{60.0, 0.9, MatrixXd::Zero(motion::kAngleRowCount, kFrames),
                          Eigen::RowVectorXd::Ones(kFrames), Eigen::Matrix3Xd::Zero(3, kFrames)};
  const int row = 3 * motion::index_of(motion::StandardJoint::kLeftForearm);
  pose.angles.row(row) = Eigen::RowVectorXd::LinSpaced(kFrames, from, to);
  return pose;
}

// Begun on the principal branch, the first would run from -0.8 pi to -2 pi.
TEST(ObservationSpace, ATakeMayBeginBeyondHalfATurn) {
  const ObservationSpace space = plain_space();
  const double most = 1.2 * std::numbers::pi;
  const MatrixXd falling = observe(space, turning(most, 0.0));
  const MatrixXd rising = observe(space, turning(0.0, most));
  EXPECT_LT((falling - rising.rowwise().reverse()).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(falling.cwiseAbs().topRows(motion::kAngleRowCount).maxCoeff(), most, 1e-9);
}

// Two tellings of one motion, a whole turn apart: what is near is the same pose, not the same
// numbers.
TEST(OnBranchesNear, MovesAnglesByWholeTurnsOnly) {
  const ObservationSpace space = plain_space();
  const MatrixXd low = observe(space, turning(0.2, 0.9 * std::numbers::pi));
  MatrixXd high = low;
  const int row = 3 * motion::index_of(motion::StandardJoint::kLeftForearm);
  high.row(row).array() -= 2.0 * std::numbers::pi;
  EXPECT_LT((on_branches_near(space, high, low.col(0)) - low).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((on_branches_near(space, low, low.col(0)) - low).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ObservationSpace, AStillBodyHasPlainSteps) {
  const motion::PoseMatrix walk = pose_of("phrase_walk_p01");
  const motion::PoseMatrix still = walk.slice(0, 1);
  const ObservationSpace space = learn_observation_space({&still, 1});
  EXPECT_EQ(space.scale, Eigen::VectorXd::Ones(kObservationRows));
  EXPECT_TRUE(observe(space, still).allFinite());
  EXPECT_THROW((void)learn_observation_space({}), base::Error);
  EXPECT_THROW((void)poses_of(space, MatrixXd::Zero(3, 2), 60.0, 0.9), base::Error);
}

// A thigh turned by 170 degrees one way and by 170 the other is 20 degrees apart, not 340.
TEST(ObservationSpace, OffsetsTurnOneObservationIntoAnotherTheShorterWay) {
  base::Rng rng(3);
  ObservationSpace space;
  space.reference.fill(Eigen::Quaterniond::Identity());
  space.scale = Eigen::VectorXd::Constant(kObservationRows, 1.5);
  MatrixXd y(kObservationRows, 2);
  for (double& value : y.reshaped()) value = 1.5 * rng.uniform(-1.5, 1.5);
  y.col(0).segment<3>(9) << 1.5 * 170.0 / 180.0 * std::numbers::pi, 0.0, 0.0;
  y.col(1).segment<3>(9) = -y.col(0).segment<3>(9);
  const Eigen::VectorXd offset = offset_between(space, y.col(0), y.col(1));
  EXPECT_NEAR(offset.segment<3>(9).norm(), 1.5 * 20.0 / 180.0 * std::numbers::pi, 1e-9);
  const MatrixXd turned = with_offsets(space, y.col(0), offset);
  const motion::PoseMatrix a = poses_of(space, turned, 60.0, 1.0);
  const motion::PoseMatrix b = poses_of(space, y.col(1), 60.0, 1.0);
  EXPECT_LE(largest_angle(a, b), 1e-7);
  EXPECT_LE((turned - y.col(1)).bottomRows(4).norm(), 1e-12);
  // The same turn told the longer way.
  const Eigen::VectorXd longer =
      offset_between(space, y.col(0), y.col(1), Eigen::VectorXd(y.col(1) - y.col(0)));
  EXPECT_NEAR(longer.segment<3>(9).norm(), 1.5 * 340.0 / 180.0 * std::numbers::pi, 1e-9);
  EXPECT_LE(largest_angle(poses_of(space, with_offsets(space, y.col(0), longer), 60.0, 1.0), b),
            1e-7);
}

}  // namespace
}  // namespace laban::texture
