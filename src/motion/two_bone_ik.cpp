#include "motion/two_bone_ik.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "laban/math/constants.h"

namespace laban::motion {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// The pelvis is lowered before a knee comes to this bend.
constexpr double kComfortable = 10.0 * math::kDegree;
/// What is bent the wrong way by more than this is bent the right way beyond 180 degrees: so do
/// blends beyond deep squats.
constexpr double kFarthestBack = -60.0 * math::kDegree;
/// A knee is not bent farther than this.
constexpr double kMostBent = 150.0 * math::kDegree;
/// Half of the range of 1 - cos(bend) over which straightening meets its limit: from 4 to about 10
/// degrees, for which the foot stays a millimetre short on an adult's leg.
constexpr double kSoftBend = 0.014;
/// Moves of a foot over which the limits above set in, metres.
constexpr double kLimitsFullAt = 0.01;
/// Sines of the knee between which the plane of the leg takes over from the hinge, and cosines of
/// the angle between the two over which it does: what is across to the hinge shows none.
constexpr double kStraightSine = 0.03;
constexpr double kBentSine = 0.15;
constexpr double kOffHinge = 0.3;
constexpr double kOnHinge = 0.7;
/// A foot so near to the hip, in leg lengths, as only blends fold a leg, is not moved, and farther
/// away than the second wholly: there its direction from the hip means little.
constexpr double kFolded = 0.1;
constexpr double kUnfolded = 0.25;
/// Knees are mended where they bend less than this.
constexpr double kMendedBelow = 4.0 * math::kDegree;
/// Mean sine of the knee from which poses show where its hinge is.
constexpr double kShownSine = 0.1;

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

/// The hinge in model space, square to the thigh. Zero if it lies along the thigh.
Vector3d side_of(const Leg& leg, const ModelPose& pose, const LegJoints& joints) {
  const Vector3d side = pose.rotations[static_cast<std::size_t>(joints.thigh)] * joints.hinge;
  const Vector3d across = side - side.dot(leg.thigh) / leg.thigh.squaredNorm() * leg.thigh;
  return across.norm() < 1e-6 ? Vector3d(Vector3d::Zero()) : Vector3d(across.normalized());
}

Vector3d sine_of(const Leg& leg) {
  return leg.thigh.cross(leg.shin) / (leg.thigh.norm() * leg.shin.norm());
}

/// The knee's axis in model space, about which a positive turn bends it: the normal of the leg's
/// plane, on the hinge's side, and the hinge where the leg is straight or bends across it. It goes
/// over from one to the other without a jump, so that a knee that passes through straight, either
/// way, turns about one axis.
Vector3d knee_axis(const Leg& leg, const ModelPose& pose, const LegJoints& joints) {
  const Vector3d across = side_of(leg, pose, joints);
  const Vector3d normal = sine_of(leg);
  const double sine = normal.norm();
  if (across.isZero(0.0)) return sine > 1e-9 ? Vector3d(normal / sine) : Vector3d::UnitX();
  if (sine <= kStraightSine) return across;
  const double cosine = normal.dot(across) / sine;
  const double share = smoothstep((sine - kStraightSine) / (kBentSine - kStraightSine)) *
                       smoothstep((std::abs(cosine) - kOffHinge) / (kOnHinge - kOffHinge));
  const Vector3d plane = normal / (cosine < 0.0 ? -sine : sine);
  return (share * plane + (1.0 - share) * across).normalized();
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
  double bend;  // as it is, from kFarthestBack on; negative if bent the wrong way
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
    if (bend < kFarthestBack) bend += 2.0 * std::numbers::pi;
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
  return knee.bend > std::numbers::pi ? 2.0 * std::numbers::pi - bend : bend;
}

/// Turns of a leg's joints, in model space: the knee turns all below it, the hip all of that; the
/// foot ends up as `foot_rotation` says.
struct LegTurn {
  Quaterniond hip;
  Quaterniond knee;
  Quaterniond foot_rotation;
};

void write(const LegTurn& turn, const ModelPose& pose, const Skeleton& skeleton,
           const LegJoints& joints, std::span<Quaterniond> local) {
  const auto model = [&](int joint) { return pose.rotations[static_cast<std::size_t>(joint)]; };
  const auto parent = [&](int joint) { return skeleton.joint(joint).parent; };
  const auto set = [&](int joint, const Quaterniond& rotation) {
    local[static_cast<std::size_t>(joint)] = rotation.normalized();
  };
  const Quaterniond above_thigh =
      parent(joints.thigh) < 0 ? Quaterniond::Identity() : model(parent(joints.thigh));
  set(joints.thigh, above_thigh.conjugate() * turn.hip * model(joints.thigh));
  set(joints.shin, model(parent(joints.shin)).conjugate() * turn.knee * model(joints.shin));
  set(joints.foot,
      (turn.hip * turn.knee * model(parent(joints.foot))).conjugate() * turn.foot_rotation);
}

}  // namespace

Vector3d find_hinge(std::span<const ModelPose> poses, const LegJoints& joints,
                    const Quaterniond& thigh_reference) {
  const Vector3d reference = thigh_reference.conjugate() * Vector3d::UnitX();
  Vector3d shown = Vector3d::Zero();
  for (const ModelPose& pose : poses) {
    const Leg leg = leg_of(pose, joints);
    if (leg.thigh.norm() < 1e-9 || leg.shin.norm() < 1e-9) return reference;
    shown += pose.rotations[static_cast<std::size_t>(joints.thigh)].conjugate() * sine_of(leg) /
             static_cast<double>(poses.size());
  }
  // Knees that all stand a little overstretched do not show that the hinge is the other way.
  const bool turned = shown.dot(reference) < -0.5 * kShownSine;
  const double unsure = std::max(0.0, kShownSine - shown.norm());
  const Vector3d hinge = shown + (turned ? -unsure : unsure) * reference;
  return hinge.norm() < 0.1 * kShownSine ? reference : Vector3d(hinge.normalized());
}

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
  const double distance = leg.foot().norm() / (leg.thigh.norm() + leg.shin.norm());
  const double share = smoothstep((distance - kFolded) / (kUnfolded - kFolded));
  const Vector3d target = leg.foot() + share * move;
  if (share == 0.0 || target.norm() < 1e-9) return;
  const Vector3d axis = knee_axis(leg, pose, joints);
  const Knee bending(leg, axis);
  if (bending.size < 1e-12) return;
  const Quaterniond knee(
      AngleAxisd(bend_for(bending, target.norm(), share * move.norm()) - bending.bend, axis));
  const Quaterniond hip = Quaterniond::FromTwoVectors(leg.thigh + knee * leg.shin, target);
  write({hip, knee, pose.rotations[static_cast<std::size_t>(joints.foot)]}, pose, skeleton, joints,
        local);
}

void reach_for(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& joints,
               const Vector3d& target, std::span<Quaterniond> local) {
  const Leg limb = leg_of(pose, joints);
  const double upper = limb.thigh.norm();
  const double lower = limb.shin.norm();
  const Vector3d way = target - pose.positions.col(joints.thigh);
  if (upper < 1e-9 || lower < 1e-9 || way.norm() < 1e-9) return;
  const Vector3d normal = limb.thigh.cross(limb.shin);
  const double sine = normal.norm() / (upper * lower);
  const Vector3d side = side_of(limb, pose, joints);
  const Vector3d axis = sine > kStraightSine || side.isZero(0.0)
                            ? Vector3d(normal / std::max(normal.norm(), 1e-300))
                            : side;
  const double bend = std::atan2(axis.dot(normal), limb.thigh.dot(limb.shin));
  const double length = std::clamp(way.norm(), limb.length_at(kMostBent), upper + lower);
  const double cosine = (length * length - upper * upper - lower * lower) / (2.0 * upper * lower);
  const Quaterniond elbow(AngleAxisd(std::acos(std::clamp(cosine, -1.0, 1.0)) - bend, axis));
  const Quaterniond shoulder = Quaterniond::FromTwoVectors(limb.thigh + elbow * limb.shin, way);
  write({shoulder, elbow, pose.rotations[static_cast<std::size_t>(joints.foot)]}, pose, skeleton,
        joints, local);
}

void swivel(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& joints,
            const Vector3d& target, std::span<Quaterniond> local) {
  const Leg limb = leg_of(pose, joints);
  if (limb.foot().norm() < 1e-9) return;
  const Vector3d axis = limb.foot().normalized();
  const auto across = [&](const Vector3d& way) { return Vector3d(way - way.dot(axis) * axis); };
  const Vector3d now = across(limb.thigh);
  const Vector3d wanted = across(target - pose.positions.col(joints.thigh));
  if (now.norm() < 1e-6 || wanted.norm() < 1e-6) return;
  const double angle = std::atan2(axis.dot(now.cross(wanted)), now.dot(wanted));
  write({Quaterniond(AngleAxisd(angle, axis)), Quaterniond::Identity(),
         pose.rotations[static_cast<std::size_t>(joints.foot)]},
        pose, skeleton, joints, local);
}

double knee_bend(const ModelPose& pose, const LegJoints& joints) {
  const Leg leg = leg_of(pose, joints);
  if (leg.thigh.norm() < 1e-9 || leg.shin.norm() < 1e-9) return 0.0;
  return Knee(leg, knee_axis(leg, pose, joints)).bend;
}

bool mend_knee(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& joints,
               std::span<Quaterniond> local) {
  const double bend = knee_bend(pose, joints);
  if (bend >= kMendedBelow) return false;
  const Leg leg = leg_of(pose, joints);
  if (leg.thigh.norm() < 1e-9 || leg.shin.norm() < 1e-9) return false;
  const Quaterniond knee(
      AngleAxisd(soft_max(bend, 0.0, kMendedBelow) - bend, knee_axis(leg, pose, joints)));
  const Quaterniond hip = Quaterniond::FromTwoVectors(leg.thigh + knee * leg.shin, leg.foot());
  write({hip, knee, pose.rotations[static_cast<std::size_t>(joints.foot)]}, pose, skeleton, joints,
        local);
  return true;
}

void settle_leg(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& joints,
                double least_bend, const Quaterniond& foot_rotation, std::span<Quaterniond> local) {
  const double bend = knee_bend(pose, joints);
  const double by = soft_max(bend, least_bend, kSettleWidth) - bend;
  Quaterniond knee = Quaterniond::Identity();
  if (by > 0.0) knee = AngleAxisd(by, knee_axis(leg_of(pose, joints), pose, joints));
  write({Quaterniond::Identity(), knee, foot_rotation}, pose, skeleton, joints, local);
}

}  // namespace laban::motion
