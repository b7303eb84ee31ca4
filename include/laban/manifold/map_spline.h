#pragma once

#include <Eigen/Dense>

#include "laban/manifold/grbf.h"

namespace laban::manifold {

/// A curve through points of the map: the natural cubic spline, twice continuously differentiable,
/// over the square root of the distance between points (centripetal [Lee89]), which keeps it from
/// looping where points lie close together. Points that repeat are passed once.
class MapSpline {
 public:
  /// @param points  2 x N, N >= 1, finite.
  /// @throws Error{kData} if there is no point or one is not finite.
  explicit MapSpline(const Eigen::Ref<const Eigen::Matrix2Xd>& points);

  /// Parameters run from 0 to this; 0 if all points are one.
  [[nodiscard]] double length() const noexcept { return knots_[knots_.size() - 1]; }
  /// The parameters at which the curve passes the points that differ from the one before.
  [[nodiscard]] const Eigen::VectorXd& knots() const noexcept { return knots_; }
  /// The point at a parameter, clamped to [0, length()].
  [[nodiscard]] Eigen::Vector2d at(double u) const;

 private:
  Eigen::Matrix2Xd points_;
  Eigen::VectorXd knots_;
  Eigen::Matrix2Xd curvatures_;  // second derivatives at the knots
};

/// `point`, moved to the nearest place inside the region.
[[nodiscard]] Eigen::Vector2d inside(const Region& region, const Eigen::Vector2d& point);

}  // namespace laban::manifold
