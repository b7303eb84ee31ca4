#include "laban/learn/gaussian_kernel.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "learn/checks.h"

namespace laban::learn {

Eigen::MatrixXd squared_distances(const Eigen::Ref<const Eigen::MatrixXd>& x,
                                  const Eigen::Ref<const Eigen::MatrixXd>& y) {
  require_rows("squared_distances", y.rows(), x.rows());
  // |x - y|^2 = |x|^2 + |y|^2 - 2 x'y: one matrix product. Cancellation may leave a tiny negative.
  Eigen::MatrixXd d = -2.0 * (x.transpose() * y);
  d.colwise() += x.colwise().squaredNorm().transpose();
  d.rowwise() += y.colwise().squaredNorm();
  return d.cwiseMax(0.0);
}

Eigen::MatrixXd gaussian_kernel(const Eigen::Ref<const Eigen::MatrixXd>& squared, double width) {
  return (squared.array() * (-0.5 / (width * width))).exp();
}

double median_distance(const Eigen::Ref<const Eigen::MatrixXd>& x) {
  const Eigen::Index count = x.cols();
  if (count < 2) return 1.0;
  std::vector<double> squared;
  squared.reserve(static_cast<std::size_t>(count * (count - 1) / 2));
  for (Eigen::Index j = 1; j < count; ++j) {
    for (Eigen::Index i = 0; i < j; ++i) squared.push_back((x.col(i) - x.col(j)).squaredNorm());
  }
  const auto middle = squared.begin() + static_cast<std::ptrdiff_t>(squared.size() / 2);
  std::nth_element(squared.begin(), middle, squared.end());
  return *middle > 0.0 ? std::sqrt(*middle) : 1.0;
}

Eigen::VectorXd KernelExpansion::predict(const Eigen::Ref<const Eigen::MatrixXd>& x) const {
  require_rows("KernelExpansion::predict", x.rows(), centers.rows());
  const Eigen::MatrixXd k = gaussian_kernel(squared_distances(centers, x), width);
  return (k.transpose() * coefficients).array() + offset;
}

}  // namespace laban::learn
