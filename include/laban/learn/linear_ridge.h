#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

namespace laban::learn {

struct LinearRidgeOptions {
  /// U of E(theta) = U sum_n (f(x_n) - y_n)^2 + |theta|^2 [Torresani06, eq. 7]: it multiplies the
  /// *loss*, so the ridge is 1 / U; > 0.
  double loss_weight = 1.0;

  /// Broken rules, each naming field, value and rule; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// f(x) = intercept + weights' x.
struct LinearRidge {
  Eigen::VectorXd weights;  ///< D
  double intercept = 0.0;

  /// M predictions for D x M samples. @throws Error{kData} unless x has D rows.
  [[nodiscard]] Eigen::VectorXd predict(const Eigen::Ref<const Eigen::MatrixXd>& x) const;
};

/// Minimises U sum_n c_n (w' (x_n - mean_x) + mean_y - y_n)^2 + |w|^2: samples and targets are
/// centred by their (weighted) training means (the print has no intercept; without one a shifted
/// scale changes the fit), which is the same as an unpenalised intercept.
///
/// @param x  D x N samples, N >= 1; standardize them first if their units differ.
/// @param y  N targets.
/// @param sample_weights  c, N weights of the samples' losses, > 0; empty: all 1. A weight of 2 is
///           the sample given twice.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if sizes differ, there is no
///         sample, a value is not finite or a weight not > 0; Error{kNumeric} if the normal
///         equations do not solve.
/// Time O(D^2 N + D^3).
[[nodiscard]] LinearRidge fit_linear_ridge(
    const Eigen::Ref<const Eigen::MatrixXd>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
    const LinearRidgeOptions& options = {},
    const Eigen::Ref<const Eigen::VectorXd>& sample_weights = Eigen::VectorXd());

}  // namespace laban::learn
