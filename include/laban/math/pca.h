#pragma once

#include <Eigen/Dense>

namespace laban::math {

/// Principal components of D x N samples (a column is a sample): x ~ mean + basis * coordinates.
struct Pca {
  Eigen::VectorXd mean;         ///< D
  Eigen::MatrixXd basis;        ///< D x K, orthonormal columns, by falling variance
  Eigen::VectorXd variance;     ///< K variances along the basis, divisor N - 1 (N = 1: zero)
  double total_variance = 0.0;  ///< of the samples, all directions

  [[nodiscard]] int component_count() const noexcept { return static_cast<int>(basis.cols()); }
  /// Share of the samples' variance that the components hold, in [0, 1]; 1 if there is none.
  [[nodiscard]] double explained_share() const noexcept;
  /// K x M coordinates basis' (x - mean). @throws Error{kData} unless x is D x M.
  [[nodiscard]] Eigen::MatrixXd transform(const Eigen::Ref<const Eigen::MatrixXd>& x) const;
  /// D x M points mean + basis * coordinates. @throws Error{kData} unless coordinates are K x M.
  [[nodiscard]] Eigen::MatrixXd reconstruct(
      const Eigen::Ref<const Eigen::MatrixXd>& coordinates) const;
};

/// Principal components by the singular value decomposition of the centred samples.
///
/// Signs are fixed so that the largest entry of each basis vector (the first of equals) is
/// positive: the same samples give the same basis. At most min(D, N - 1) directions can carry
/// variance; if `component_count` asks for more, all min(D, N) are kept, the surplus with variance
/// 0.
///
/// @param x                D x N, D >= 1, N >= 1.
/// @param component_count  >= 1.
/// @throws Error{kUsage} for component_count < 1; Error{kData} if x is empty or not finite.
[[nodiscard]] Pca fit_pca(const Eigen::Ref<const Eigen::MatrixXd>& x, int component_count);

}  // namespace laban::math
