#include "laban/learn/linear_ridge.h"

#include "learn/checks.h"

namespace laban::learn {

std::vector<std::string> LinearRidgeOptions::problems() const {
  std::vector<std::string> problems;
  append_unless_positive("LinearRidgeOptions::loss_weight", loss_weight, problems);
  return problems;
}

Eigen::VectorXd LinearRidge::predict(const Eigen::Ref<const Eigen::MatrixXd>& x) const {
  require_rows("LinearRidge::predict", x.rows(), weights.size());
  return (x.transpose() * weights).array() + intercept;
}

LinearRidge fit_linear_ridge(const Eigen::Ref<const Eigen::MatrixXd>& x,
                             const Eigen::Ref<const Eigen::VectorXd>& y,
                             const LinearRidgeOptions& options,
                             const Eigen::Ref<const Eigen::VectorXd>& sample_weights) {
  require_valid(options.problems());
  require_samples("fit_linear_ridge", x);
  require_targets("fit_linear_ridge", y, x.cols());
  require_weights("fit_linear_ridge", sample_weights, x.cols());
  const Eigen::VectorXd c = weights_or_ones(sample_weights, x.cols());
  const Eigen::VectorXd mean_x = x * c / c.sum();
  const double mean_y = y.dot(c) / c.sum();
  const Eigen::MatrixXd X = x.colwise() - mean_x;
  const Eigen::MatrixXd XC = X * c.asDiagonal();
  // (X C X' + I / U) w = X C (y - mean_y)
  Eigen::MatrixXd A = XC * X.transpose();
  A.diagonal().array() += 1.0 / options.loss_weight;
  const Eigen::LLT<Eigen::MatrixXd> factor(A);
  if (factor.info() != Eigen::Success) {
    throw base::Error(base::ErrorKind::kNumeric,
                      "fit_linear_ridge: the normal equations are not positive definite to "
                      "round-off, lower the loss weight");
  }
  LinearRidge result;
  result.weights = factor.solve(XC * (y.array() - mean_y).matrix());
  result.intercept = mean_y - result.weights.dot(mean_x);
  return result;
}

}  // namespace laban::learn
