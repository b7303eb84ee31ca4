#pragma once

#include <span>

#include <Eigen/Dense>

namespace laban::texture {

/// A second-order linear dynamic system over m states [Li02, eq. 10]:
/// x_{t+1} = A1 x_t + A2 x_{t-1} + D + B v_t, v ~ N(0, I).
struct LinearDynamics {
  Eigen::MatrixXd a1;          ///< m x m
  Eigen::MatrixXd a2;          ///< m x m
  Eigen::VectorXd offset;      ///< m, the paper's D
  Eigen::MatrixXd covariance;  ///< m x m, B B', its eigenvalues floored: positive definite

  [[nodiscard]] int dimension() const noexcept { return static_cast<int>(offset.size()); }
};

struct DynamicsFit {
  double ridge = 0.0;           ///< >= 0, relative to the mean variance of the regressors
  double variance_floor = 0.0;  ///< >= 0, smallest eigenvalue of the covariance
};

/// Least-squares fit over all segments together, none joined to the next (METHODS 2.2, M-step 2).
/// @param segments  each m x T, T >= 3.
/// @throws Error{kData} if there are none, or they differ in m, or one is shorter than three.
[[nodiscard]] LinearDynamics fit_dynamics(std::span<const Eigen::MatrixXd> segments,
                                          const DynamicsFit& options = {});

}  // namespace laban::texture
