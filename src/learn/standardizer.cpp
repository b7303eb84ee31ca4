#include "laban/learn/standardizer.h"

#include <algorithm>
#include <cmath>

#include "learn/checks.h"

namespace laban::learn {

Eigen::MatrixXd Standardizer::apply(const Eigen::Ref<const Eigen::MatrixXd>& x) const {
  require_rows("Standardizer::apply", x.rows(), mean.size());
  return inverse_scale.asDiagonal() * (x.colwise() - mean);
}

Standardizer fit_standardizer(const Eigen::Ref<const Eigen::MatrixXd>& x) {
  require_samples("fit_standardizer", x);
  Standardizer result;
  result.mean = x.rowwise().mean();
  const Eigen::VectorXd deviation =
      ((x.colwise() - result.mean).rowwise().squaredNorm() / static_cast<double>(x.cols()))
          .cwiseSqrt();
  result.inverse_scale.resize(x.rows());
  for (Eigen::Index row = 0; row < x.rows(); ++row) {
    // A constant feature comes out of the mean with a few units of round-off, not with 0.
    const double floor = 1e-12 * std::max(1.0, std::abs(result.mean[row]));
    result.inverse_scale[row] = deviation[row] > floor ? 1.0 / deviation[row] : 0.0;
  }
  return result;
}

}  // namespace laban::learn
