#pragma once

#include <Eigen/Dense>
#include <Eigen/Geometry>

namespace laban::math {

/// Exponential map of a rotation: axis * angle, radians, |r| <= pi for a principal value.
///
/// log of a unit quaternion (q and -q are the same rotation, so the result is the short one).
/// Exact to round-off for small angles too: there it is 2 v / w by series.
[[nodiscard]] Eigen::Vector3d log(const Eigen::Quaterniond& q);

/// The unit quaternion of an exponential map; any length of r is accepted. exp(log(q)) = +-q.
[[nodiscard]] Eigen::Quaterniond exp(const Eigen::Vector3d& r);

/// The exponential map equivalent to `r` (r + 2 pi k r / |r|) that lies nearest to `previous`
/// (METHODS 0). For |r| below 1e-9 the axis of `previous` is used, so that a joint passing through
/// a full turn stays continuous.
[[nodiscard]] Eigen::Vector3d nearest_branch(const Eigen::Vector3d& r,
                                             const Eigen::Vector3d& previous);

/// Angle between two rotations, radians in [0, pi]; accurate for small angles.
[[nodiscard]] double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

/// `q` or `-q`, whichever is in the hemisphere of `reference`.
[[nodiscard]] Eigen::Quaterniond same_hemisphere(const Eigen::Quaterniond& q,
                                                 const Eigen::Quaterniond& reference);

/// The heading (yaw) of a rotation: the angle about +Y, radians in (-pi, pi], of the swing-twist
/// split q = yaw * tilt, where tilt has no twist about +Y. Continuous except where the character
/// hangs upside down; there 0.
[[nodiscard]] double heading_of(const Eigen::Quaterniond& q);

/// Rotation about +Y by `angle` radians.
[[nodiscard]] Eigen::Quaterniond yaw_rotation(double angle);

/// The rotation that turns the frame (x along `from_x`, y in the half plane of `from_y`) into the
/// frame (x along `to_x`, y in the half plane of `to_y`). Vectors need not be unit or orthogonal;
/// each pair must not be parallel. @throws Error{kNumeric} if one is.
[[nodiscard]] Eigen::Quaterniond rotation_between_frames(const Eigen::Vector3d& from_x,
                                                         const Eigen::Vector3d& from_y,
                                                         const Eigen::Vector3d& to_x,
                                                         const Eigen::Vector3d& to_y);

/// `angle` plus the multiple of 2 pi that brings it nearest to `previous`, radians.
[[nodiscard]] double nearest_angle(double angle, double previous);

}  // namespace laban::math
