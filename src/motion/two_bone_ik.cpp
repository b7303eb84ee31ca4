#include "motion/two_bone_ik.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace laban::motion {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;
/// A knee is not straightened beyond this, and the pelvis is lowered before it comes to the other.
constexpr double kStraightest = 4.0 * kDegree;
constexpr double kComfortable = 10.0 * kDegree;
/// Sines of the knee between which the plane of the leg takes over from the thigh's side.
constexpr double kStraightSine = 0.03;
constexpr double kBentSine = 0.15;
/// How sharply extension meets its limit; 6 keeps half of the room to within half a per cent.
constexpr double kSharpness = 6.0;

/// A leg as it stands: thigh and shin as vectors, the foot as seen from the hip.
struct Leg {
  Vector3d thigh;  // hip to knee
  Vector3d shin;   // knee to ankle
  [[nodiscard]] Vector3d foot() const { return thigh + shin; }
  /// Hip to ankle with the knee bent by `angle` from straight.
  [[nodiscard]] double length_at(double angle) const {
    const double a = thigh.norm();
    const double b = shin.norm();
    return std::sqrt(std::max(0.0, a * a + b * b + 2.0 * a * b * std::cos(angle)));
  }
};

Leg leg_of(const ModelPose& pose, const LegJoints& joints) {
  return {pose.positions.col(joints.shin) - pose.positions.col(joints.thigh),
          pose.positions.col(joints.foot) - pose.positions.col(joints.shin)};
}

/// The knee's axis in model space, about which a positive turn bends it.
Vector3d knee_axis(const Leg& leg, const ModelPose& pose, const LegJoints& joints) {
  const Vector3d side = pose.rotations[static_cast<std::size_t>(joints.thigh)] *
                        (joints.thigh_reference.conjugate() * Vector3d::UnitX());
  const Vector3d normal = leg.thigh.cross(leg.shin) / (leg.thigh.norm() * leg.shin.norm());
  const double sine = normal.norm();
  // Square to the thigh, so that it is an axis of the plane even where the leg is straight.
  Vector3d across = side - side.dot(leg.thigh) / leg.thigh.squaredNorm() * leg.thigh;
  if (across.norm() < 1e-6) return sine > 1e-9 ? Vector3d(normal / sine) : side;
  across.normalize();
  if (sine <= kStraightSine) return across;
  const double x = std::clamp((sine - kStraightSine) / (kBentSine - kStraightSine), 0.0, 1.0);
  const double share = x * x * (3.0 - 2.0 * x);
  // A knee bent the wrong way turns about the same axis, the other way.
  const Vector3d plane = normal / (normal.dot(across) < 0.0 && sine < kBentSine ? -sine : sine);
  const Vector3d mixed = share * plane + (1.0 - share) * across;
  return mixed.norm() < 1e-6 ? across : Vector3d(mixed.normalized());
}

/// `wanted` length from hip to ankle, or what the knee allows: shortening is free, extension ends
/// smoothly at the limit.
double allowed_length(const Leg& leg, double wanted) {
  const double now = leg.foot().norm();
  const double shortest = std::abs(leg.thigh.norm() - leg.shin.norm()) + 0.05 * now;
  if (wanted <= now) return std::max(wanted, std::min(now, shortest));
  const double room = std::max(leg.length_at(kStraightest) - now, 0.0);
  if (room <= 0.0) return now;
  const double x = (wanted - now) / room;
  return now + room * x / std::pow(1.0 + std::pow(x, kSharpness), 1.0 / kSharpness);
}

/// Turn of the shin about `axis` that makes the leg as long as `length`.
double knee_turn(const Leg& leg, const Vector3d& axis, double length) {
  // |thigh + R shin|^2 = thigh^2 + shin^2 + 2 (a + b cos + s sin), R the turn about the axis.
  const Vector3d along = leg.shin.dot(axis) * axis;
  const double a = leg.thigh.dot(along);
  const double b = leg.thigh.dot(leg.shin - along);
  const double s = leg.thigh.dot(axis.cross(leg.shin));
  const double size = std::hypot(b, s);
  if (size < 1e-12) return 0.0;
  const double product = 0.5 * (length * length - leg.thigh.squaredNorm() - leg.shin.squaredNorm());
  const double straight = std::atan2(s, b);  // the turn that straightens the knee
  const double bend = std::acos(std::clamp((product - a) / size, -1.0, 1.0));
  // A capture's overstretched knee may straighten, never overstretch farther.
  return straight > 0.0 && bend <= straight ? straight - bend : straight + bend;
}

}  // namespace

double lowering_to_reach(const ModelPose& pose, const LegJoints& joints, const Vector3d& move) {
  const Leg leg = leg_of(pose, joints);
  const double reach = std::max(leg.foot().norm(), leg.length_at(kComfortable));
  const Vector3d target = leg.foot() + move;
  const double across = target.x() * target.x() + target.z() * target.z();
  const double below = std::sqrt(std::max(0.0, reach * reach - across));
  return std::max(0.0, -target.y() - below);
}

void move_foot(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& joints,
               const Vector3d& move, std::span<Quaterniond> local) {
  const Leg leg = leg_of(pose, joints);
  if (leg.thigh.norm() < 1e-9 || leg.shin.norm() < 1e-9) return;  // no leg to bend
  const Vector3d target = leg.foot() + move;
  if (target.norm() < 1e-9) return;
  const double turn =
      knee_turn(leg, knee_axis(leg, pose, joints), allowed_length(leg, target.norm()));
  const Quaterniond knee(AngleAxisd(turn, knee_axis(leg, pose, joints)));
  const Quaterniond hip = Quaterniond::FromTwoVectors(leg.thigh + knee * leg.shin, target);
  const auto model = [&](int joint) { return pose.rotations[static_cast<std::size_t>(joint)]; };
  const auto parent = [&](int joint) { return skeleton.joint(joint).parent; };
  const auto write = [&](int joint, const Quaterniond& rotation) {
    local[static_cast<std::size_t>(joint)] = rotation.normalized();
  };
  // The hip turns all below the thigh, the knee all below the shin; the foot is turned back.
  const Quaterniond above_thigh =
      parent(joints.thigh) < 0 ? Quaterniond::Identity() : model(parent(joints.thigh));
  write(joints.thigh, above_thigh.conjugate() * hip * model(joints.thigh));
  write(joints.shin, model(parent(joints.shin)).conjugate() * knee * model(joints.shin));
  write(joints.foot, (hip * knee * model(parent(joints.foot))).conjugate() * model(joints.foot));
}

}  // namespace laban::motion
