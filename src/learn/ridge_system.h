#pragma once

#include <string>

#include <Eigen/Dense>

#include "laban/base/error.h"

namespace laban::learn {

/// Cholesky factor of kernel + diag(1 / (U w)), the system of weighted kernel ridge.
/// @throws Error{kNumeric}, begun with `place`, if it is not positive definite to round-off.
inline Eigen::LLT<Eigen::MatrixXd> factorize_ridge_system(
    const char* place, const Eigen::Ref<const Eigen::MatrixXd>& kernel, double loss_weight,
    const Eigen::Ref<const Eigen::VectorXd>& weights) {
  Eigen::MatrixXd A = kernel;
  A.diagonal().array() += (loss_weight * weights.array()).inverse();
  Eigen::LLT<Eigen::MatrixXd> factor(A);
  if (factor.info() != Eigen::Success) {
    throw base::Error(base::ErrorKind::kNumeric,
                      std::string(place) + ": kernel + ridge " + std::to_string(1.0 / loss_weight) +
                          " is not positive definite to round-off, lower the loss weight");
  }
  return factor;
}

}  // namespace laban::learn
