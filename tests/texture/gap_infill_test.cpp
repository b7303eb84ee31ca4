#include "laban/texture/gap_infill.h"

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/motion/pose_matrix.h"

#include "synthetic_texture.h"

namespace laban::texture {
namespace {

using Eigen::MatrixXd;

Eigen::Vector3d way_of(const MotionTexture& texture, const MatrixXd& y, int begin, int end) {
  const motion::PoseMatrix pose = poses_of(texture.space, y, 60.0, 1.0);
  return motion::planar_path(pose.slice(begin - 1, end + 1)).rightCols<1>();
}

TEST(GapInfill, FillsWhatWasLearntBetterThanAStraightLineAndClosesTheRootPath) {
  const MotionTexture texture = test::synthetic_texture();
  const GapInfill infill(texture);
  const MatrixXd y = texture.observations.middleCols(40, 80);
  const int begin = 25;
  const int end = 55;
  const Eigen::Vector3d way = way_of(texture, y, begin, end);
  MatrixXd hidden = y;
  hidden.middleCols(begin, end - begin).setConstant(1e3);  // not looked at
  hidden.col(end).tail<3>().setConstant(1e3);
  const MatrixXd filled = infill.fill(hidden, begin, end, way);
  EXPECT_EQ(filled.leftCols(begin), y.leftCols(begin));
  EXPECT_LE((way_of(texture, filled, begin, end) - way).norm(), 1e-9);
  MatrixXd straight = y;
  for (int f = begin; f < end; ++f) {
    const double share = (f - begin + 1.0) / (end - begin + 1.0);
    straight.col(f) = (1.0 - share) * y.col(begin - 1) + share * y.col(end);
  }
  const auto angles = [&](const MatrixXd& z) { return (z - y).topRows<63>().norm(); };
  EXPECT_LT(angles(filled), 0.5 * angles(straight));
}

// A joint told a whole turn away after the gap stands as it stood: nothing turns in the gap.
TEST(GapInfill, DoesNotTurnAJointForBeingToldOnAnotherBranch) {
  const MotionTexture texture = test::synthetic_texture();
  const GapInfill infill(texture);
  const MatrixXd y = texture.observations.middleCols(40, 60);
  MatrixXd other = y;
  for (int f = 40; f < 60; ++f) {
    const Eigen::Vector3d r = y.block<3, 1>(9, f);
    other.block<3, 1>(9, f) = r - 2.0 * M_PI * r.normalized();
  }
  const Eigen::Vector3d way = way_of(texture, y, 20, 40);
  const MatrixXd a = infill.fill(y, 20, 40, way);
  const MatrixXd b = infill.fill(other, 20, 40, way);
  EXPECT_LE((a - b).middleCols(20, 20).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(GapInfill, PredictsTheNextFrameBetterThanConstantVelocityDoes) {
  const MotionTexture texture = test::synthetic_texture();
  const GapInfill infill(texture);
  double ours = 0.0;
  double steady = 0.0;
  for (int f = 30; f < 200; f += 10) {
    const MatrixXd y = texture.observations.middleCols(f - 20, 21);
    ours += (infill.next(y.leftCols(20)) - y.col(20)).squaredNorm();
    steady += (2.0 * y.col(19) - y.col(18) - y.col(20)).squaredNorm();
  }
  EXPECT_LT(ours, 0.5 * steady);
  EXPECT_THROW(static_cast<void>(infill.next(texture.observations.leftCols(2))), base::Error);
}

TEST(GapInfill, NeedsTwoFramesOnEitherSide) {
  const MotionTexture texture = test::synthetic_texture();
  const GapInfill infill(texture, {.texton_of_all = false});
  const MatrixXd y = texture.observations.leftCols(30);
  for (const auto& [begin, end] : {std::pair{1, 10}, {10, 10}, {10, 29}}) {
    EXPECT_THROW(static_cast<void>(infill.fill(y, begin, end, Eigen::Vector3d::Zero())),
                 base::Error);
  }
}

}  // namespace
}  // namespace laban::texture
