#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/learn/gaussian_kernel.h"

namespace laban::learn {

struct KernelRidgeOptions {
  /// Width of the Gaussian, in the samples' unit; > 0.
  double width = 1.0;
  /// U, the weight of the loss: the ridge is 1 / U [Torresani06, eq. 7]; > 0.
  double loss_weight = 1.0;

  /// Broken rules, each naming field, value and rule; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Prediction and how far to trust it.
struct KernelRidgePrediction {
  Eigen::VectorXd mean;                ///< M
  Eigen::VectorXd standard_deviation;  ///< M, in the unit of the targets, of the function value
};

/// Kernel ridge regression with a Gaussian kernel, fitted in closed form. Immutable.
class KernelRidge {
 public:
  /// @param x  D x N training samples, @param y  N targets, @param sample_weights  N or none.
  /// @throws as fit_kernel_ridge.
  KernelRidge(const Eigen::Ref<const Eigen::MatrixXd>& x,
              const Eigen::Ref<const Eigen::VectorXd>& y, const KernelRidgeOptions& options,
              const Eigen::Ref<const Eigen::VectorXd>& sample_weights = Eigen::VectorXd());

  [[nodiscard]] const KernelExpansion& expansion() const noexcept { return expansion_; }
  /// M predictions for D x M samples. @throws Error{kData} unless x has D rows.
  [[nodiscard]] Eigen::VectorXd predict(const Eigen::Ref<const Eigen::MatrixXd>& x) const {
    return expansion_.predict(x);
  }
  /// The same machine read as a Gaussian process with prior covariance s^2 k and noise variance
  /// s^2 / (U w_n), where s^2 = y' (K + W^-1/U)^-1 y / N, the value of greatest likelihood:
  /// variance s^2 (1 - k_x' (K + W^-1/U)^-1 k_x) of the function value (without the noise).
  [[nodiscard]] KernelRidgePrediction predict_with_variance(
      const Eigen::Ref<const Eigen::MatrixXd>& x) const;

 private:
  KernelExpansion expansion_;
  Eigen::LLT<Eigen::MatrixXd> factor_;  // of K + ridge
  double signal_variance_ = 0.0;        // s^2
};

/// Coefficients a and offset b of f = b + K a minimising U sum w_n (f_n - y_n)^2 + a' K a with b
/// the weighted mean of the targets: a = (K + W^-1/U)^-1 (y - b).
struct KernelRidgeSolution {
  Eigen::VectorXd coefficients;
  double offset = 0.0;
};

/// Kernel ridge on any symmetric positive semi-definite kernel matrix.
///
/// @param kernel  N x N, @param y  N targets, @param loss_weight  U > 0.
/// @param sample_weights  w, N weights of the samples' losses, > 0; empty: all 1. A weight of 2 is
///           the sample given twice.
/// @throws Error{kUsage} unless U > 0; Error{kData} if sizes differ, there is no sample or a weight
///         is not > 0; Error{kNumeric} if kernel + ridge is not positive definite to round-off.
[[nodiscard]] KernelRidgeSolution solve_kernel_ridge(
    const Eigen::Ref<const Eigen::MatrixXd>& kernel, const Eigen::Ref<const Eigen::VectorXd>& y,
    double loss_weight,
    const Eigen::Ref<const Eigen::VectorXd>& sample_weights = Eigen::VectorXd());

/// Kernel ridge regression: targets centred by the training mean, ridge 1 / U, Gaussian kernel
/// [Torresani06, eq. 6-7].
///
/// @param x  D x N samples, N >= 1, @param y  N targets.
/// @param sample_weights  as solve_kernel_ridge.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if sizes differ, there is no
///         sample, a value is not finite or a weight not > 0; Error{kNumeric} if the system does
///         not solve.
/// Time O(N^2 D + N^3), memory O(N^2).
[[nodiscard]] KernelRidge fit_kernel_ridge(
    const Eigen::Ref<const Eigen::MatrixXd>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
    const KernelRidgeOptions& options = {},
    const Eigen::Ref<const Eigen::VectorXd>& sample_weights = Eigen::VectorXd());

}  // namespace laban::learn
