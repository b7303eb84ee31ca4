#include "laban/math/rotation.h"

#include <cmath>
#include <numbers>

#include "laban/base/error.h"

namespace laban::math {

Eigen::Vector3d log(const Eigen::Quaterniond& q) {
  const double w = q.w() < 0.0 ? -q.w() : q.w();
  const Eigen::Vector3d v = q.w() < 0.0 ? Eigen::Vector3d(-q.vec()) : Eigen::Vector3d(q.vec());
  const double n = v.norm();
  // angle / sin(angle / 2) = 2 atan2(n, w) / n; below 1e-8 the series 2 / w is exact to round-off.
  return n < 1e-8 ? Eigen::Vector3d(v * (2.0 / w))
                  : Eigen::Vector3d(v * (2.0 * std::atan2(n, w) / n));
}

Eigen::Quaterniond exp(const Eigen::Vector3d& r) {
  const double angle = r.norm();
  // sin(x / 2) / x = 1/2 - x^2 / 48 + ..: below 1e-4 two terms are exact to round-off.
  const double cosine = std::cos(0.5 * angle);
  const double sine =
      std::sin(0.5 * angle);  // whatever the angle: the two cost hardly more than one
  const double s = angle < 1e-4 ? 0.5 - angle * angle / 48.0 : sine / angle;
  Eigen::Quaterniond q(cosine, s * r.x(), s * r.y(), s * r.z());
  q.coeffs() *= 1.5 - 0.5 * q.squaredNorm();  // to unit length: it is off by round-off only
  return q;
}

Eigen::Vector3d nearest_branch(const Eigen::Vector3d& r, const Eigen::Vector3d& previous) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  constexpr double kHalfTurnSquared = 9.86;  // a little less: no other branch can be nearer
  if ((r - previous).squaredNorm() < kHalfTurnSquared) return r;
  const double angle = r.norm();
  if (angle < 1e-9) {
    const double length = previous.norm();
    if (length < 1e-9) return r;
    const double turns = std::round(length / kTurn);
    return r + previous * (turns * kTurn / length);
  }
  const Eigen::Vector3d axis = r / angle;
  const double turns = std::round((axis.dot(previous) - angle) / kTurn);
  return r + axis * (turns * kTurn);
}

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond d = a.conjugate() * b;
  return 2.0 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

Eigen::Quaterniond same_hemisphere(const Eigen::Quaterniond& q,
                                   const Eigen::Quaterniond& reference) {
  return q.dot(reference) < 0.0 ? Eigen::Quaterniond(-q.coeffs()) : q;
}

double heading_of(const Eigen::Quaterniond& q) {
  if (std::hypot(q.y(), q.w()) < 1e-12) return 0.0;
  const double angle = 2.0 * std::atan2(q.y(), q.w());
  return nearest_angle(angle, 0.0);
}

Eigen::Quaterniond yaw_rotation(double angle) {
  return {std::cos(0.5 * angle), 0.0, std::sin(0.5 * angle), 0.0};
}

Eigen::Quaterniond rotation_between_frames(const Eigen::Vector3d& from_x,
                                           const Eigen::Vector3d& from_y,
                                           const Eigen::Vector3d& to_x,
                                           const Eigen::Vector3d& to_y) {
  const auto frame = [](const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
    const Eigen::Vector3d z = x.cross(y);
    if (z.norm() <= 1e-9 * x.norm() * y.norm()) {
      throw base::Error(base::ErrorKind::kNumeric,
                        "rotation_between_frames: the two axes of a frame are parallel or zero");
    }
    Eigen::Matrix3d m;
    m.col(0) = x.normalized();
    m.col(2) = z.normalized();
    m.col(1) = m.col(2).cross(m.col(0));
    return m;
  };
  const Eigen::Matrix3d from = frame(from_x, from_y);
  const Eigen::Matrix3d to = frame(to_x, to_y);
  return Eigen::Quaterniond(Eigen::Matrix3d(to * from.transpose())).normalized();
}

double nearest_angle(double angle, double previous) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  return angle - kTurn * std::round((angle - previous) / kTurn);
}

}  // namespace laban::math
