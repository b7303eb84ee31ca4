#include "laban/math/pca.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

namespace laban::math {
namespace {

Eigen::MatrixXd random_samples(int rows, int cols, base::Rng& rng) {
  Eigen::MatrixXd x(rows, cols);
  for (double& value : x.reshaped()) value = rng.normal();
  for (int row = 0; row < rows; ++row) x.row(row) *= 1.0 + row;
  return x;
}

TEST(Pca, FindsTheAxesOfAHandMadeCloud) {
  Eigen::MatrixXd x(2, 4);  // spread 2 along (1, 1), 1 along (1, -1), about (5, 7)
  x << 7, 3, 6, 4, 9, 5, 6, 8;
  const Pca pca = fit_pca(x, 2);
  const double h = std::sqrt(0.5);
  EXPECT_NEAR((pca.mean - Eigen::Vector2d(5, 7)).norm(), 0.0, 1e-14);
  EXPECT_NEAR((pca.basis.col(0) - Eigen::Vector2d(h, h)).norm(), 0.0, 1e-14);
  EXPECT_NEAR(pca.variance[0], 16.0 / 3.0, 1e-13);
  EXPECT_NEAR(pca.variance[1], 4.0 / 3.0, 1e-13);
  EXPECT_NEAR(fit_pca(x, 1).explained_share(), 0.8, 1e-14);
}

TEST(Pca, MatchesScikitLearn) {
  // The samples and values of tests/learn/reference_values.py.
  Eigen::MatrixXd x(3, 24);
  for (int n = 0; n < 24; ++n) {
    for (int d = 0; d < 3; ++d) x(d, n) = std::sin(0.7 * (d + 1) * (n + 1)) + 0.1 * d;
  }
  const Pca pca = fit_pca(x, 2);
  EXPECT_NEAR(pca.variance[0], 0.585427865467338, 1e-12);
  EXPECT_NEAR(pca.variance[1], 0.516588115232928, 1e-12);
  const Eigen::Vector3d first(-0.600250853836227, 0.715558414434977, -0.357316481568065);
  const Eigen::Vector3d second(-0.394703687144385, 0.123543805584802, 0.910464676665851);
  EXPECT_NEAR((pca.basis.col(0) - first).norm(), 0.0, 1e-12);
  EXPECT_NEAR((pca.basis.col(1) - second).norm(), 0.0, 1e-12);
}

TEST(Pca, BasisIsOrthonormalCoordinatesUncorrelatedAndSignsFixed) {
  base::Rng rng(1);
  for (const auto& [rows, cols] : {std::pair{5, 40}, std::pair{200, 12}, std::pair{3, 3}}) {
    const Eigen::MatrixXd x = random_samples(rows, cols, rng);
    const Pca pca = fit_pca(x, 3);
    EXPECT_LT((pca.basis.transpose() * pca.basis - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    const Eigen::MatrixXd c = pca.transform(x);
    const Eigen::Matrix3d covariance = c * c.transpose() / (cols - 1.0);
    EXPECT_LT((covariance - Eigen::Matrix3d(pca.variance.asDiagonal())).norm(),
              1e-10 * pca.total_variance);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(pca.basis.col(k).maxCoeff(), pca.basis.col(k).cwiseAbs().maxCoeff());
    }
  }
}

TEST(Pca, ReconstructsSamplesFromAllComponents) {
  base::Rng rng(2);
  const Eigen::MatrixXd x = random_samples(30, 8, rng);
  const Pca pca = fit_pca(x, 100);
  EXPECT_EQ(pca.component_count(), 8);
  EXPECT_LT((pca.reconstruct(pca.transform(x)) - x).norm(), 1e-10);
  EXPECT_NEAR(pca.explained_share(), 1.0, 1e-12);
}

TEST(Pca, OneSampleHasNoVariance) {
  const Pca pca = fit_pca(Eigen::Vector3d(1, 2, 3), 2);
  EXPECT_EQ(pca.component_count(), 1);
  EXPECT_EQ(pca.variance[0], 0.0);
  EXPECT_EQ(pca.explained_share(), 1.0);
  EXPECT_TRUE(pca.basis.allFinite());
}

TEST(Pca, RefusesBadInput) {
  Eigen::MatrixXd x = Eigen::MatrixXd::Ones(2, 3);
  EXPECT_THROW((void)fit_pca(x, 0), base::Error);
  EXPECT_THROW((void)fit_pca(Eigen::MatrixXd(2, 0), 1), base::Error);
  const Pca pca = fit_pca(x, 1);
  EXPECT_THROW((void)pca.transform(Eigen::MatrixXd::Ones(3, 1)), base::Error);
  EXPECT_THROW((void)pca.reconstruct(Eigen::MatrixXd::Ones(2, 1)), base::Error);
  x(0, 0) = std::numeric_limits<double>::infinity();
  EXPECT_THROW((void)fit_pca(x, 1), base::Error);
}

}  // namespace
}  // namespace laban::math
