#include "laban/learn/kernel_ridge.h"

#include "learn/checks.h"
#include "learn/ridge_system.h"

namespace laban::learn {

std::vector<std::string> KernelRidgeOptions::problems() const {
  std::vector<std::string> problems;
  append_unless_positive("KernelRidgeOptions::width", width, problems);
  append_unless_positive("KernelRidgeOptions::loss_weight", loss_weight, problems);
  return problems;
}

KernelRidgeSolution solve_kernel_ridge(const Eigen::Ref<const Eigen::MatrixXd>& kernel,
                                       const Eigen::Ref<const Eigen::VectorXd>& y,
                                       double loss_weight,
                                       const Eigen::Ref<const Eigen::VectorXd>& sample_weights) {
  require_valid(KernelRidgeOptions{.width = 1.0, .loss_weight = loss_weight}.problems());
  require_samples("solve_kernel_ridge", kernel);
  require_rows("solve_kernel_ridge", kernel.rows(), kernel.cols());
  require_targets("solve_kernel_ridge", y, kernel.rows());
  require_weights("solve_kernel_ridge", sample_weights, kernel.rows());
  const Eigen::VectorXd w = weights_or_ones(sample_weights, kernel.rows());
  KernelRidgeSolution result;
  result.offset = y.dot(w) / w.sum();
  result.coefficients = factorize_ridge_system("kernel ridge", kernel, loss_weight, w)
                            .solve((y.array() - result.offset).matrix());
  return result;
}

KernelRidge::KernelRidge(const Eigen::Ref<const Eigen::MatrixXd>& x,
                         const Eigen::Ref<const Eigen::VectorXd>& y,
                         const KernelRidgeOptions& options,
                         const Eigen::Ref<const Eigen::VectorXd>& sample_weights) {
  require_valid(options.problems());
  require_samples("fit_kernel_ridge", x);
  require_targets("fit_kernel_ridge", y, x.cols());
  require_weights("fit_kernel_ridge", sample_weights, x.cols());
  const Eigen::VectorXd w = weights_or_ones(sample_weights, x.cols());
  const double mean = y.dot(w) / w.sum();
  const Eigen::VectorXd centered = y.array() - mean;
  factor_ = factorize_ridge_system("kernel ridge",
                                   gaussian_kernel(squared_distances(x, x), options.width),
                                   options.loss_weight, w);
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
                             const KernelRidgeOptions& options,
                             const Eigen::Ref<const Eigen::VectorXd>& sample_weights) {
  return KernelRidge(x, y, options, sample_weights);
}

}  // namespace laban::learn
