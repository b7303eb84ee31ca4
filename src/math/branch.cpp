#include "laban/math/branch.h"

#include <cmath>
#include <numbers>

#include "laban/base/error.h"
#include "laban/math/rotation.h"

namespace laban::math {

Eigen::Matrix3Xd carry_branch(const Eigen::Ref<const Eigen::Matrix3Xd>& curve, int anchor,
                              const Eigen::Vector3d& value) {
  LABAN_CHECK(anchor >= 0 && anchor < curve.cols());
  Eigen::Matrix3Xd moved(3, curve.cols());
  moved.col(anchor) = value;
  for (Eigen::Index f = anchor + 1; f < curve.cols(); ++f) {
    moved.col(f) = nearest_branch(curve.col(f), moved.col(f - 1));
  }
  for (Eigen::Index f = anchor - 1; f >= 0; --f) {
    moved.col(f) = nearest_branch(curve.col(f), moved.col(f + 1));
  }
  return moved;
}

Eigen::Matrix3Xd shift_branch(const Eigen::Ref<const Eigen::Matrix3Xd>& curve, int turns) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  LABAN_CHECK(curve.cols() > 0);
  int anchor = 0;
  double farthest = -1.0;
  for (Eigen::Index f = 0; f < curve.cols(); ++f) {
    const double length = curve.col(f).norm();
    const double distance =
        length <= 0.5 * kTurn ? length : std::abs(std::remainder(length, kTurn));
    if (distance > farthest) {
      farthest = distance;
      anchor = static_cast<int>(f);
    }
  }
  const Eigen::Vector3d r = curve.col(anchor);
  const double angle = r.norm();
  if (turns == 0 || angle < 1e-9) return curve;  // no axis anywhere: nothing to turn about
  return carry_branch(curve, anchor, r * (1.0 + turns * kTurn / angle));
}

}  // namespace laban::math
