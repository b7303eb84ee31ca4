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
/// The pelvis is lowered before a knee comes to this bend.
constexpr double kComfortable = 10.0 * kDegree;
/// A knee is not bent farther than this.
constexpr double kMostBent = 150.0 * kDegree;
/// Half of the range of 1 - cos(bend) over which straightening meets its limit: from 4 to about 10
/// degrees, for which the foot stays a millimetre short on an adult's leg.
constexpr double kSoftBend = 0.014;
/// Moves of a foot over which the limits above set in, and over which a knee that is bent the wrong
/// way (blends of straight legs, extrapolated) comes to bend the right way, metres.
constexpr double kLimitsFullAt = 0.01;
constexpr double kRightWayAt = 0.002;
/// Sines of the knee between which the plane of the leg takes over from the thigh's side.
constexpr double kStraightSine = 0.03;
constexpr double kBentSine = 0.15;
/// A low-pass straightens a knee too far by less than the first; what seems more than the second is
/// no such thing (the side of the knee is in doubt).
constexpr double kMostRebent = 4.0 * kDegree;
constexpr double kInDoubt = 12.0 * kDegree;
/// Sine of the knee below which it may be bent the wrong way.
constexpr double kBackwardsSine = 0.35;

double smoothstep(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

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

/// The thigh's side in model space, square to the thigh; about it a positive turn bends the knee.
/// Zero if the side lies along the thigh.
Vector3d side_of(const Leg& leg, const ModelPose& pose, const LegJoints& joints) {
  const Vector3d side = pose.rotations[static_cast<std::size_t>(joints.thigh)] *
                        (joints.thigh_reference.conjugate() * Vector3d::UnitX());
  const Vector3d across = side - side.dot(leg.thigh) / leg.thigh.squaredNorm() * leg.thigh;
  return across.norm() < 1e-6 ? Vector3d(Vector3d::Zero()) : Vector3d(across.normalized());
}

Vector3d sine_of(const Leg& leg) {
  return leg.thigh.cross(leg.shin) / (leg.thigh.norm() * leg.shin.norm());
}

/// The knee's axis in model space, about which a positive turn bends it: the normal of the leg's
/// plane, and the thigh's side where the leg is straight.
Vector3d knee_axis(const Leg& leg, const ModelPose& pose, const LegJoints& joints) {
  const Vector3d across = side_of(leg, pose, joints);
  const Vector3d normal = sine_of(leg);
  const double sine = normal.norm();
  if (across.isZero(0.0)) return sine > 1e-9 ? Vector3d(normal / sine) : Vector3d::UnitX();
  if (sine <= kStraightSine) return across;
  const double share = smoothstep((sine - kStraightSine) / (kBentSine - kStraightSine));
  // A knee that is bent a little the wrong way turns about the same axis; one that is bent more
  // shows where its axis is.
  const bool backwards = sine < kBackwardsSine && normal.dot(across) < 0.0;
  const Vector3d plane = normal / (backwards ? -sine : sine);
  const Vector3d mixed = share * plane + (1.0 - share) * across;
  return mixed.norm() < 1e-6 ? across : Vector3d(mixed.normalized());
}

/// The larger of `x` and `least`, rounded off within `width` of where they meet.
double soft_max(double x, double least, double width) {
  const double above = x - least;
  if (above >= width) return x;
  if (above <= -width) return least;
  return least + (above + width) * (above + width) / (4.0 * width);
}

/// How the length of a leg depends on the bend of its knee about an axis:
/// |thigh + R shin|^2 = thigh^2 + shin^2 + 2 (along + size cos(bend)).
struct Knee {
  double bend;  // as it is; negative if bent the wrong way
  double along;
  double size;
  double squares;

  Knee(const Leg& leg, const Vector3d& axis)
      : bend(0.0),
        along(0.0),
        size(0.0),
        squares(leg.thigh.squaredNorm() + leg.shin.squaredNorm()) {
    const Vector3d parallel = leg.shin.dot(axis) * axis;
    along = leg.thigh.dot(parallel);
    const double cosine = leg.thigh.dot(leg.shin - parallel);
    const double sine = leg.thigh.dot(axis.cross(leg.shin));
    size = std::hypot(cosine, sine);
    bend = std::atan2(-sine, cosine);
  }
  /// 1 - cos(bend) at a length from hip to ankle; negative if it cannot be as long.
  [[nodiscard]] double flexion_at(double length) const {
    return 1.0 - (0.5 * (length * length - squares) - along) / size;
  }
};

/// The bend at which a leg comes as near as it may to `length`, its foot being moved by `way`.
double bend_for(const Knee& knee, double length, double way) {
  const double now = 1.0 - std::cos(knee.bend);
  const double least = 1.0 - std::cos(kStraightestKnee);
  const double most = std::max(now, 1.0 - std::cos(kMostBent));
  const double wanted = knee.flexion_at(length);
  const double limited = soft_max(wanted, least, kSoftBend);
  const double flexion = std::clamp(wanted + smoothstep(way / kLimitsFullAt) * (limited - wanted),
                                    std::min(now, least), most);
  const double bend = std::acos(1.0 - flexion);
  if (knee.bend >= 0.0) return bend;
  return (2.0 * smoothstep(way / kRightWayAt) - 1.0) * bend;
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
  const Vector3d axis = knee_axis(leg, pose, joints);
  const Knee bending(leg, axis);
  if (bending.size < 1e-12) return;
  const Quaterniond knee(
      AngleAxisd(bend_for(bending, target.norm(), move.norm()) - bending.bend, axis));
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

double knee_bend(const ModelPose& pose, const LegJoints& joints) {
  const Leg leg = leg_of(pose, joints);
  if (leg.thigh.norm() < 1e-9 || leg.shin.norm() < 1e-9) return 0.0;
  return Knee(leg, knee_axis(leg, pose, joints)).bend;
}

void settle_leg(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& joints,
                double least_bend, const Quaterniond& foot_rotation, std::span<Quaterniond> local) {
  const auto model = [&](int joint) { return pose.rotations[static_cast<std::size_t>(joint)]; };
  const auto parent = [&](int joint) { return skeleton.joint(joint).parent; };
  Quaterniond knee = Quaterniond::Identity();
  const double short_of = least_bend - knee_bend(pose, joints);
  if (short_of > 0.0 && short_of < kInDoubt) {
    const double share = smoothstep((kInDoubt - short_of) / (kInDoubt - kMostRebent));
    knee = AngleAxisd(share * short_of, knee_axis(leg_of(pose, joints), pose, joints));
    local[static_cast<std::size_t>(joints.shin)] =
        (model(parent(joints.shin)).conjugate() * knee * model(joints.shin)).normalized();
  }
  local[static_cast<std::size_t>(joints.foot)] =
      ((knee * model(parent(joints.foot))).conjugate() * foot_rotation).normalized();
}

}  // namespace laban::motion
