#include "laban/loop/distance_map.h"

#include <algorithm>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

using base::Error;
using base::ErrorKind;

constexpr Eigen::Index kMostFramesForScale = 500;
constexpr double kLeastVarianceShare = 0.01;

double l2_distance(const Eigen::Ref<const Eigen::MatrixXd>& angles, Eigen::Index i,
                   Eigen::Index j) {
  double sum = 0.0;
  for (Eigen::Index row = 0; row < angles.rows(); row += 3) {
    sum += (angles.col(i).segment<3>(row) - angles.col(j).segment<3>(row)).norm();
  }
  return sum;
}

void check_triples(const Eigen::Ref<const Eigen::MatrixXd>& angles) {
  if (angles.cols() < 1) throw Error(ErrorKind::kData, "a distance map needs at least one frame");
  if (angles.rows() % 3 != 0) {
    throw Error(ErrorKind::kData, "exponential maps have three rows a joint, not " +
                                      std::to_string(angles.rows()) + " in all");
  }
}

}  // namespace

double mean_l2_distance(const Eigen::Ref<const Eigen::MatrixXd>& angles) {
  check_triples(angles);
  const Eigen::Index stride =
      std::max<Eigen::Index>(1, (angles.cols() + kMostFramesForScale - 1) / kMostFramesForScale);
  double sum = 0.0;
  double count = 0.0;
  for (Eigen::Index i = 0; i < angles.cols(); i += stride) {
    for (Eigen::Index j = i + stride; j < angles.cols(); j += stride) {
      sum += l2_distance(angles, i, j);
      count += 1.0;
    }
  }
  return count > 0.0 ? sum / count : 0.0;
}

Eigen::MatrixXd l2_similarity(const Eigen::Ref<const Eigen::MatrixXd>& angles,
                              std::optional<double> sigma) {
  check_triples(angles);
  if (sigma && !(*sigma > 0.0)) {
    throw Error(ErrorKind::kUsage,
                "sigma = " + std::to_string(*sigma) + " of the L2 map (must be > 0)");
  }
  const double mean = sigma ? 0.0 : mean_l2_distance(angles);
  const double scale = sigma ? *sigma : mean > 0.0 ? mean : 1.0;
  Eigen::MatrixXd map(angles.cols(), angles.cols());
  for (Eigen::Index i = 0; i < angles.cols(); ++i) {
    map(i, i) = 1.0;
    for (Eigen::Index j = 0; j < i; ++j) {
      map(i, j) = map(j, i) = std::exp(-l2_distance(angles, i, j) / scale);
    }
  }
  return map;
}

Eigen::VectorXd velocity_variance(const Eigen::Ref<const Eigen::MatrixXd>& angles,
                                  double frame_rate_hz) {
  const Eigen::Index frames = angles.cols();
  if (frames < 1) throw Error(ErrorKind::kData, "a distance map needs at least one frame");
  if (frames < 2) return Eigen::VectorXd::Ones(angles.rows());
  const Eigen::MatrixXd velocity =
      (angles.rightCols(frames - 1) - angles.leftCols(frames - 1)) * frame_rate_hz;
  const Eigen::VectorXd mean = velocity.rowwise().mean();
  const Eigen::VectorXd variance =
      (velocity.colwise() - mean).rowwise().squaredNorm() / static_cast<double>(velocity.cols());
  const double least = kLeastVarianceShare * variance.mean();
  if (!(least > 0.0)) return Eigen::VectorXd::Ones(angles.rows());
  return variance.cwiseMax(least);
}

Eigen::MatrixXd mahalanobis_distance(const Eigen::Ref<const Eigen::MatrixXd>& angles,
                                     const Eigen::VectorXd& variance) {
  if (angles.cols() < 1 || variance.size() != angles.rows() || !(variance.minCoeff() > 0.0)) {
    throw Error(ErrorKind::kData,
                "the Mahalanobis map needs a frame and a positive variance for each of its " +
                    std::to_string(angles.rows()) + " rows");
  }
  const Eigen::MatrixXd scaled = variance.cwiseSqrt().cwiseInverse().asDiagonal() * angles;
  Eigen::MatrixXd map(angles.cols(), angles.cols());
  for (Eigen::Index i = 0; i < angles.cols(); ++i) {
    map(i, i) = 0.0;
    for (Eigen::Index j = 0; j < i; ++j) {
      map(i, j) = map(j, i) = (scaled.col(i) - scaled.col(j)).squaredNorm();
    }
  }
  return map;
}

}  // namespace laban::loop
