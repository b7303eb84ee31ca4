#pragma once

#include <Eigen/Dense>

namespace laban::learn {

/// N x M squared Euclidean distances between the columns of x (D x N) and y (D x M), never below 0.
/// @throws Error{kData} if the row counts differ.
[[nodiscard]] Eigen::MatrixXd squared_distances(const Eigen::Ref<const Eigen::MatrixXd>& x,
                                                const Eigen::Ref<const Eigen::MatrixXd>& y);

/// k = exp(-d^2 / (2 width^2)) of each squared distance; `width` > 0 in the samples' unit.
[[nodiscard]] Eigen::MatrixXd gaussian_kernel(const Eigen::Ref<const Eigen::MatrixXd>& squared,
                                              double width);

/// Median distance between two different columns of x: the scale that a grid of kernel widths is
/// told in. 1 if there is one sample, or if at least half of the pairs coincide and so give 0.
[[nodiscard]] double median_distance(const Eigen::Ref<const Eigen::MatrixXd>& x);

/// f(x) = offset + sum_n coefficients_n k(centers_n, x): what every kernel machine here predicts
/// with.
struct KernelExpansion {
  Eigen::MatrixXd centers;       ///< D x N
  Eigen::VectorXd coefficients;  ///< N
  double width = 1.0;            ///< of the Gaussian, > 0
  double offset = 0.0;

  /// M predictions for D x M samples. @throws Error{kData} unless x has D rows.
  [[nodiscard]] Eigen::VectorXd predict(const Eigen::Ref<const Eigen::MatrixXd>& x) const;
};

}  // namespace laban::learn
