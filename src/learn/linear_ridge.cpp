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
                             const LinearRidgeOptions& options) {
  require_valid(options.problems());
  require_samples("fit_linear_ridge", x);
  require_targets("fit_linear_ridge", y, x.cols());
  const Eigen::VectorXd mean_x = x.rowwise().mean();
  const double mean_y = y.mean();
  const Eigen::MatrixXd X = x.colwise() - mean_x;
  // (X X' + I / U) w = X (y - mean_y)
  Eigen::MatrixXd A = X * X.transpose();
  A.diagonal().array() += 1.0 / options.loss_weight;
  const Eigen::LLT<Eigen::MatrixXd> factor(A);
  if (factor.info() != Eigen::Success) {
    throw base::Error(base::ErrorKind::kNumeric,
                      "fit_linear_ridge: the normal equations are not positive definite to "
                      "round-off, lower the loss weight");
  }
  LinearRidge result;
  result.weights = factor.solve(X * (y.array() - mean_y).matrix());
  result.intercept = mean_y - result.weights.dot(mean_x);
  return result;
}

}  // namespace laban::learn
