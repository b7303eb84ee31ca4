#include "laban/manifold/map_spline.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "laban/base/error.h"

namespace laban::manifold {
namespace {

using Eigen::Index;
using Eigen::Matrix2Xd;
using Eigen::VectorXd;

// Points nearer than this are one, map units: the square root of less would make a knot interval
// that divides by nothing.
constexpr double kSamePoint = 1e-9;

Matrix2Xd without_repeats(const Eigen::Ref<const Matrix2Xd>& points) {
  Matrix2Xd kept(2, points.cols());
  Index count = 0;
  for (Index n = 0; n < points.cols(); ++n) {
    if (count > 0 && (points.col(n) - kept.col(count - 1)).norm() < kSamePoint) continue;
    kept.col(count++) = points.col(n);
  }
  return kept.leftCols(count);
}

/// Second derivatives of the natural spline by Thomas' algorithm: h_{k-1} m_{k-1} + 2 (h_{k-1} +
/// h_k) m_k + h_k m_{k+1} = 6 (slope_k - slope_{k-1}), m = 0 at both ends.
Matrix2Xd natural_curvatures(const Matrix2Xd& points, const VectorXd& knots) {
  const Index count = points.cols();
  Matrix2Xd m = Matrix2Xd::Zero(2, count);
  if (count < 3) return m;
  VectorXd upper = VectorXd::Zero(count);
  const auto step = [&knots](Index k) { return knots[k + 1] - knots[k]; };
  const auto slope = [&](Index k) -> Eigen::Vector2d {
    return (points.col(k + 1) - points.col(k)) / step(k);
  };
  for (Index k = 1; k + 1 < count; ++k) {
    const double pivot = 2.0 * (step(k - 1) + step(k)) - step(k - 1) * upper[k - 1];
    upper[k] = step(k) / pivot;
    m.col(k) = (6.0 * (slope(k) - slope(k - 1)) - step(k - 1) * m.col(k - 1)) / pivot;
  }
  m.col(count - 1).setZero();
  for (Index k = count - 2; k > 0; --k) m.col(k) -= upper[k] * m.col(k + 1);
  return m;
}

}  // namespace

MapSpline::MapSpline(const Eigen::Ref<const Matrix2Xd>& points) {
  if (points.cols() < 1 || !points.allFinite()) {
    throw base::Error(base::ErrorKind::kData, "MapSpline: " + std::to_string(points.cols()) +
                                                  " points (must be at least one, and finite)");
  }
  points_ = without_repeats(points);
  knots_ = VectorXd::Zero(points_.cols());
  for (Index k = 1; k < points_.cols(); ++k) {
    knots_[k] = knots_[k - 1] + std::sqrt((points_.col(k) - points_.col(k - 1)).norm());
  }
  curvatures_ = natural_curvatures(points_, knots_);
}

Eigen::Vector2d MapSpline::at(double u) const {
  if (knots_.size() == 1 || u <= 0.0) return points_.col(0);
  if (u >= length()) return points_.col(points_.cols() - 1);
  const auto* after = std::upper_bound(knots_.data(), knots_.data() + knots_.size(), u);
  const Index k = after - knots_.data() - 1;
  const double h = knots_[k + 1] - knots_[k];
  const double b = (u - knots_[k]) / h;
  const double a = 1.0 - b;
  return a * points_.col(k) + b * points_.col(k + 1) +
         (h * h / 6.0) *
             ((a * a * a - a) * curvatures_.col(k) + (b * b * b - b) * curvatures_.col(k + 1));
}

Eigen::Vector2d inside(const Region& region, const Eigen::Vector2d& point) {
  return point.cwiseMax(region.low).cwiseMin(region.high);
}

}  // namespace laban::manifold
