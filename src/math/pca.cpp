#include "laban/math/pca.h"

#include <algorithm>
#include <string>

#include "laban/base/error.h"

namespace laban::math {

double Pca::explained_share() const noexcept {
  return total_variance > 0.0 ? std::min(1.0, variance.sum() / total_variance) : 1.0;
}

Eigen::MatrixXd Pca::transform(const Eigen::Ref<const Eigen::MatrixXd>& x) const {
  if (x.rows() != mean.size()) {
    throw base::Error(base::ErrorKind::kData, "Pca::transform: samples of " +
                                                  std::to_string(x.rows()) + " rows, must be " +
                                                  std::to_string(mean.size()));
  }
  return basis.transpose() * (x.colwise() - mean);
}

Eigen::MatrixXd Pca::reconstruct(const Eigen::Ref<const Eigen::MatrixXd>& coordinates) const {
  if (coordinates.rows() != basis.cols()) {
    throw base::Error(base::ErrorKind::kData,
                      "Pca::reconstruct: " + std::to_string(coordinates.rows()) +
                          " coordinates, must be " + std::to_string(basis.cols()));
  }
  return (basis * coordinates).colwise() + mean;
}

Pca fit_pca(const Eigen::Ref<const Eigen::MatrixXd>& x, int component_count) {
  if (component_count < 1) {
    throw base::Error(
        base::ErrorKind::kUsage,
        "fit_pca: component_count = " + std::to_string(component_count) + " (must be >= 1)");
  }
  if (x.rows() < 1 || x.cols() < 1 || !x.allFinite()) {
    throw base::Error(base::ErrorKind::kData, "fit_pca: " + std::to_string(x.rows()) + " x " +
                                                  std::to_string(x.cols()) +
                                                  " samples, at least 1 x 1 and all finite");
  }
  Pca result;
  result.mean = x.rowwise().mean();
  const Eigen::MatrixXd centered = x.colwise() - result.mean;
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(centered, Eigen::ComputeThinU);
  const Eigen::Index kept = std::min<Eigen::Index>(component_count, svd.singularValues().size());
  const double divisor = static_cast<double>(std::max<Eigen::Index>(1, x.cols() - 1));
  result.basis = svd.matrixU().leftCols(kept);
  result.variance = svd.singularValues().head(kept).array().square() / divisor;
  result.total_variance = centered.squaredNorm() / divisor;
  for (Eigen::Index k = 0; k < kept; ++k) {
    Eigen::Index largest = 0;
    result.basis.col(k).cwiseAbs().maxCoeff(&largest);
    if (result.basis(largest, k) < 0.0) result.basis.col(k) *= -1.0;
  }
  return result;
}

}  // namespace laban::math
