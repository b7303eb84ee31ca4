#include "align/local_distance.h"

#include "laban/base/error.h"

namespace laban::align {

LocalDistance::LocalDistance(const Eigen::Ref<const Eigen::MatrixXd>& x,
                             const Eigen::Ref<const Eigen::MatrixXd>& y)
    : x_(x),
      y_(y),
      x_norms_(x.colwise().squaredNorm().transpose()),
      y_norms_(y.colwise().squaredNorm().transpose()) {}

const Eigen::MatrixXd& LocalDistance::block(int begin, int count) {
  // The product's error is at most about D * 1e-16 of |x| |y|: far below this share.
  constexpr double kRoundOff = 1e-12;
  block_.resize(y_.cols(), count);
  block_.noalias() = y_.transpose() * x_.middleCols(begin, count);
  for (int b = 0; b < count; ++b) {
    const double x_norm = x_norms_(begin + b);
    double* column = block_.col(b).data();
    for (Eigen::Index q = 0; q < block_.rows(); ++q) {
      const double norms = x_norm + y_norms_(q);
      const double distance = norms - 2.0 * column[q];
      column[q] = distance > kRoundOff * norms ? distance : 0.0;
    }
  }
  return block_;
}

void require_sequence(const Eigen::Ref<const Eigen::MatrixXd>& features, const std::string& place) {
  if (features.rows() < 1 || features.cols() < 1) {
    throw base::Error(base::ErrorKind::kData,
                      place + ": " + std::to_string(features.rows()) + " dimensions x " +
                          std::to_string(features.cols()) + " frames, at least 1 x 1 is needed");
  }
  if (!features.allFinite()) {
    throw base::Error(base::ErrorKind::kData, place + ": a value is not finite");
  }
}

void require_same_rows(Eigen::Index rows, Eigen::Index expected, const std::string& place) {
  if (rows != expected) {
    throw base::Error(base::ErrorKind::kData, place + ": " + std::to_string(rows) +
                                                  " dimensions, must be the other's " +
                                                  std::to_string(expected));
  }
}

}  // namespace laban::align
