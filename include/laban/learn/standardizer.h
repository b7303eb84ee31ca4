#pragma once

#include <Eigen/Dense>

namespace laban::learn {

/// Centre and scale of each feature of the *training* samples; part of every model that uses it.
struct Standardizer {
  Eigen::VectorXd mean;  ///< D
  /// D reciprocals of the standard deviations (divisor N). A feature that is constant in training
  /// (deviation <= 1e-12 * max(1, |mean|)) gets 0: training says nothing about it, so it is
  /// ignored, instead of letting round-off or an unseen value decide a prediction.
  Eigen::VectorXd inverse_scale;

  /// D x M standardized samples. @throws Error{kData} unless x has D rows.
  [[nodiscard]] Eigen::MatrixXd apply(const Eigen::Ref<const Eigen::MatrixXd>& x) const;
};

/// Statistics of D x N training samples (a column is a sample).
/// @throws Error{kData} if x is empty or not finite.
[[nodiscard]] Standardizer fit_standardizer(const Eigen::Ref<const Eigen::MatrixXd>& x);

}  // namespace laban::learn
