#pragma once

#include <string>

#include <Eigen/Dense>

namespace laban::align {

/// Squared Euclidean distances of a few frames of one sequence to all frames of another, by matrix
/// products: |x - y|^2 = |x|^2 + |y|^2 - 2 x'y.
class LocalDistance {
 public:
  /// @param x  D x N, @param y  D x M; both must outlive this.
  LocalDistance(const Eigen::Ref<const Eigen::MatrixXd>& x,
                const Eigen::Ref<const Eigen::MatrixXd>& y);

  /// Distances of frames [begin, begin + count) of x; column b of the M x count result belongs to
  /// frame begin + b. What lies below 1e-12 of |x|^2 + |y|^2 is round-off of the product and
  /// becomes 0: equal frames are exactly 0 apart. Valid until the next call.
  [[nodiscard]] const Eigen::MatrixXd& block(int begin, int count);

 private:
  Eigen::Ref<const Eigen::MatrixXd> x_;
  Eigen::Ref<const Eigen::MatrixXd> y_;
  Eigen::VectorXd x_norms_;  // N
  Eigen::VectorXd y_norms_;  // M
  Eigen::MatrixXd block_;
};

/// @throws Error{kData} "place: ..." unless the sequence has a frame, a row and finite values only.
void require_sequence(const Eigen::Ref<const Eigen::MatrixXd>& features, const std::string& place);

/// @throws Error{kData} "place: ..." unless the two have the same number of rows.
void require_same_rows(Eigen::Index rows, Eigen::Index expected, const std::string& place);

}  // namespace laban::align
