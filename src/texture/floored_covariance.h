#pragma once

#include <Eigen/Dense>

namespace laban::texture {

/// A symmetric matrix with its eigenvalues raised to at least `floor`.
[[nodiscard]] inline Eigen::MatrixXd floored_covariance(
    const Eigen::Ref<const Eigen::MatrixXd>& covariance, double floor) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  if (solver.eigenvalues().minCoeff() >= floor) return covariance;
  const Eigen::MatrixXd& v = solver.eigenvectors();
  const Eigen::MatrixXd raised =
      v * solver.eigenvalues().cwiseMax(floor).asDiagonal() * v.transpose();
  return 0.5 * (raised + raised.transpose());
}

}  // namespace laban::texture
