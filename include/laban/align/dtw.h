#pragma once

#include <vector>

#include <Eigen/Dense>

namespace laban::align {

/// One sample of a warping path: frame p of the first sequence lies beside frame q of the second.
struct FramePair {
  int p = 0;
  int q = 0;
  friend bool operator==(const FramePair&, const FramePair&) = default;
};

/// What an alignment costs, without its path.
struct DtwCost {
  double cost = 0.0;    ///< sum of local distances along the path: the paper's SSD
  int path_length = 0;  ///< L, cells of the path

  /// SSD / L: mean local distance of a path cell; comparable between long and short pairs.
  [[nodiscard]] double mean_cost() const noexcept { return cost / path_length; }
};

/// An alignment and its path.
struct DtwResult {
  double cost = 0.0;            ///< sum of local distances along `path`: the paper's SSD
  std::vector<FramePair> path;  ///< (0, 0) to (N - 1, M - 1); steps (1, 0), (0, 1) or (1, 1)

  /// SSD / L: mean local distance of a path cell.
  [[nodiscard]] double mean_cost() const noexcept {
    return cost / static_cast<double>(path.size());
  }
};

/// Cheapest monotone alignment of two feature sequences under the squared Euclidean local distance
/// d(p, q) = |x_p - y_q|^2  [Torresani06, eq. 3-5; METHODS 1.1].
///
/// Nothing limits the slope: takes of one content differ in length up to six times.
/// @param x  D x N, a column is a frame, N >= 1, D >= 1.
/// @param y  D x M, the same D, M >= 1.
/// @throws Error{kData} if a sequence is empty, D differs or a value is not finite.
/// Time O(D N M), memory N M bytes. Of equally cheap predecessors of (p, q) the diagonal
/// (p-1, q-1) is taken, then (p-1, q), then (p, q-1). A distance below 1e-12 of |x_p|^2 + |y_q|^2
/// is round-off and counts as 0, so a sequence against itself costs exactly 0.
[[nodiscard]] DtwResult dtw(const Eigen::Ref<const Eigen::MatrixXd>& x,
                            const Eigen::Ref<const Eigen::MatrixXd>& y);

/// The cost and path length of `dtw(x, y)` alone, in memory O(D min(N, M)); same inputs, errors
/// and ties.
[[nodiscard]] DtwCost dtw_cost(const Eigen::Ref<const Eigen::MatrixXd>& x,
                               const Eigen::Ref<const Eigen::MatrixXd>& y);

}  // namespace laban::align
