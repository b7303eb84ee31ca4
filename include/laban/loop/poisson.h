#pragma once

#include <vector>

#include <Eigen/Dense>

namespace laban::loop {

/// The joints x time grid on which a motion is rebuilt from its gradients [Graphcut, eq. 14].
///
/// Rows are joints, columns the frames between two that are held (Dirichlet in time). A joint's
/// neighbours are itself one frame on and, at the same frame, its parent; a joint's tip has no
/// neighbour (free there). An edge between joints counts `joint_weight` times an edge of time. With
/// `screening` (ours) values are also drawn to 0, so that a correction fades within about
/// 1 / sqrt(screening) frames of what causes it instead of reaching to the held frames.
class PoissonGrid {
 public:
  /// @param parents       of each row, -1 for a root; parents come first.
  /// @param frame_count   of the unknowns, >= 1.
  /// @param joint_weight  >= 0; 0 smooths each joint by itself.
  /// @param screening     >= 0; 0 is the paper's equation.
  /// @throws Error{kData} if a parent does not come first; Error{kUsage} for other values.
  PoissonGrid(std::vector<int> parents, int frame_count, double joint_weight,
              double screening = 0.0);

  /// Laplacian (negative, plus screening) of values that are 0 at the held frames: the operator
  /// that solve() inverts.
  /// @param values  (C R) x N: C channels one below the other, each of R rows.
  [[nodiscard]] Eigen::MatrixXd laplacian(const Eigen::MatrixXd& values) const;

  /// Divergence, the adjoint (negative) of the forward differences: -div of the gradients given.
  /// @param along_time  (C R) x (N + 1): column t from frame t - 1 to t, with the held ones.
  /// @param to_parent   (C R) x N: from the parent to the row; ignored for roots.
  [[nodiscard]] Eigen::MatrixXd divergence(const Eigen::MatrixXd& along_time,
                                           const Eigen::MatrixXd& to_parent) const;

  /// The values, 0 at the held frames, whose laplacian() is `right`: sine transform along time,
  /// then elimination from the tips to the root of the tree, one frequency beside the other.
  /// Direct; the residual is at round-off. O(C R N^2) with a small constant (matrix products).
  /// @throws Error{kData} for a wrong size.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

  [[nodiscard]] int row_count() const noexcept { return static_cast<int>(parents_.size()); }
  [[nodiscard]] int frame_count() const noexcept { return static_cast<int>(sines_.cols()); }

 private:
  void check_size(const Eigen::MatrixXd& values, Eigen::Index columns) const;

  std::vector<int> parents_;
  double joint_weight_;
  double screening_;
  Eigen::MatrixXd sines_;   // N x N, symmetric and orthogonal: DST-I
  Eigen::MatrixXd pivots_;  // N x R: diagonal of each row at its elimination, a frequency a row
};

}  // namespace laban::loop
