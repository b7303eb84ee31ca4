#include "laban/learn/kernel_ridge.h"

#include "learn/checks.h"

namespace laban::learn {
namespace {

/// Cholesky factor of kernel + I / U.
Eigen::LLT<Eigen::MatrixXd> factorize(const Eigen::Ref<const Eigen::MatrixXd>& kernel,
                                      double loss_weight) {
  Eigen::MatrixXd A = kernel;
  A.diagonal().array() += 1.0 / loss_weight;
  Eigen::LLT<Eigen::MatrixXd> factor(A);
  if (factor.info() != Eigen::Success) {
    throw base::Error(base::ErrorKind::kNumeric,
                      "kernel ridge: kernel + ridge " + std::to_string(1.0 / loss_weight) +
                          " is not positive definite to round-off, lower the loss weight");
  }
  return factor;
}

}  // namespace

std::vector<std::string> KernelRidgeOptions::problems() const {
  std::vector<std::string> problems;
  append_unless_positive("KernelRidgeOptions::width", width, problems);
  append_unless_positive("KernelRidgeOptions::loss_weight", loss_weight, problems);
  return problems;
}

KernelRidgeSolution solve_kernel_ridge(const Eigen::Ref<const Eigen::MatrixXd>& kernel,
                                       const Eigen::Ref<const Eigen::VectorXd>& y,
                                       double loss_weight) {
  require_valid(KernelRidgeOptions{.width = 1.0, .loss_weight = loss_weight}.problems());
  require_samples("solve_kernel_ridge", kernel);
  require_rows("solve_kernel_ridge", kernel.rows(), kernel.cols());
  require_targets("solve_kernel_ridge", y, kernel.rows());
  KernelRidgeSolution result;
  result.offset = y.mean();
  result.coefficients = factorize(kernel, loss_weight).solve((y.array() - result.offset).matrix());
  return result;
}

KernelRidge::KernelRidge(const Eigen::Ref<const Eigen::MatrixXd>& x,
                         const Eigen::Ref<const Eigen::VectorXd>& y,
                         const KernelRidgeOptions& options) {
  require_valid(options.problems());
  require_samples("fit_kernel_ridge", x);
  require_targets("fit_kernel_ridge", y, x.cols());
  const double mean = y.mean();
  const Eigen::VectorXd centered = y.array() - mean;
  factor_ = factorize(gaussian_kernel(squared_distances(x, x), options.width), options.loss_weight);
  expansion_ = {x, factor_.solve(centered), options.width, mean};
  signal_variance_ = centered.dot(expansion_.coefficients) / static_cast<double>(x.cols());
}

KernelRidgePrediction KernelRidge::predict_with_variance(
    const Eigen::Ref<const Eigen::MatrixXd>& x) const {
  require_rows("KernelRidge::predict_with_variance", x.rows(), expansion_.centers.rows());
  const Eigen::MatrixXd k =
      gaussian_kernel(squared_distances(expansion_.centers, x), expansion_.width);
  // k' (L L')^-1 k = |L^-1 k|^2; round-off may bring the variance below 0 at a training sample.
  const Eigen::VectorXd explained = factor_.matrixL().solve(k).colwise().squaredNorm().transpose();
  KernelRidgePrediction result;
  result.mean = (k.transpose() * expansion_.coefficients).array() + expansion_.offset;
  result.standard_deviation =
      (signal_variance_ * (1.0 - explained.array()).max(0.0)).sqrt().matrix();
  return result;
}

KernelRidge fit_kernel_ridge(const Eigen::Ref<const Eigen::MatrixXd>& x,
                             const Eigen::Ref<const Eigen::VectorXd>& y,
                             const KernelRidgeOptions& options) {
  return KernelRidge(x, y, options);
}

}  // namespace laban::learn
