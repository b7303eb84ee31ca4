#include "body.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "laban/motion/standard_body.h"
#include "laban/motion/standard_joint.h"

namespace laban::phrase {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using motion::StandardJoint;

constexpr double kRadians = std::numbers::pi / 180.0;
/// A leg never gets straighter than this share of its length: knees keep a little give.
constexpr double kLongestReach = 0.996;
/// Width over which the pelvis eases into that limit, leg lengths.
constexpr double kReachEase = 0.010;

enum class Side { kLeft, kRight };

Quaterniond turn_x(double degrees) {
  return Quaterniond(Eigen::AngleAxisd(degrees * kRadians, Vector3d::UnitX()));
}
Quaterniond turn_y(double degrees) {
  return Quaterniond(Eigen::AngleAxisd(degrees * kRadians, Vector3d::UnitY()));
}
Quaterniond turn_z(double degrees) {
  return Quaterniond(Eigen::AngleAxisd(degrees * kRadians, Vector3d::UnitZ()));
}

/// The image in the plane x = 0: what the left side does, done by the right.
Quaterniond mirrored(const Quaterniond& q) {
  return {q.w(), q.x(), -q.y(), -q.z()};
}

std::size_t joint_index(StandardJoint left, Side side) {
  constexpr int kArmShift =
      index_of(StandardJoint::kRightClavicle) - index_of(StandardJoint::kLeftClavicle);
  constexpr int kLegShift =
      index_of(StandardJoint::kRightThigh) - index_of(StandardJoint::kLeftThigh);
  const int shift = left < StandardJoint::kLeftThigh ? kArmShift : kLegShift;
  return static_cast<std::size_t>(index_of(left) + (side == Side::kRight ? shift : 0));
}

double value_of(const ControlPose& controls, Control left, Side side) {
  return controls[side == Side::kLeft ? left : right_of(left)];
}

const Vector3d& rest_offset(const motion::Skeleton& skeleton, StandardJoint left, Side side) {
  return skeleton.joint(static_cast<int>(joint_index(left, side))).rest_offset;
}

/// Lengths of a built skeleton that its legs and heights are measured by.
struct LegLengths {
  double thigh = 0.0;
  double shin = 0.0;
  double ankle_height = 0.0;
  double ball_forward = 0.0;  ///< from the ankle to the ball
  double heel_back = 0.0;     ///< from the ankle to the heel
  [[nodiscard]] double leg() const { return thigh + shin; }
};

LegLengths leg_lengths(const motion::Skeleton& skeleton) {
  LegLengths lengths;
  lengths.thigh = rest_offset(skeleton, StandardJoint::kLeftShin, Side::kLeft).norm();
  lengths.shin = rest_offset(skeleton, StandardJoint::kLeftFoot, Side::kLeft).norm();
  const int toe = index_of(StandardJoint::kLeftToe);
  const Vector3d ball = skeleton.joint(toe).rest_offset;
  lengths.ankle_height = -(ball.y() + skeleton.joint(toe).end_site->y());
  lengths.ball_forward = ball.z();
  lengths.heel_back = 0.4 * ball.z();
  return lengths;
}

double hips_height(const motion::Skeleton& skeleton) {
  const LegLengths lengths = leg_lengths(skeleton);
  return lengths.ankle_height + lengths.leg() -
         rest_offset(skeleton, StandardJoint::kLeftThigh, Side::kLeft).y();
}

/// The part of a foot's pitch above 0, rounded off near 0 so that the ankle's path has no kink.
double positive_part(double degrees) {
  constexpr double kEaseDegrees = 2.0;
  return degrees <= 0.0
             ? 0.0
             : degrees * degrees * degrees / (degrees * degrees + kEaseDegrees * kEaseDegrees);
}

struct Foot {
  Vector3d ankle;            ///< metres, model space
  Quaterniond rotation;      ///< model-from-foot
  Vector3d knee_hinge;       ///< to the left of the direction in which the knee bends
  double sole_height = 0.0;  ///< metres
  double toe_bend = 0.0;     ///< degrees, toes up against the foot
};

/// Where the ankle must be: the foot stands flat at its place, then rolls over the ball or the
/// heel.
Foot place_foot(const LegLengths& lengths, const ControlPose& controls, Side side) {
  const double sign = side == Side::kLeft ? 1.0 : -1.0;
  const double pitch = value_of(controls, Control::kLeftFootPitch, side);
  const double yaw = sign * value_of(controls, Control::kLeftFootYaw, side);
  const double over_ball = positive_part(pitch);
  const double over_heel = -positive_part(-pitch);
  const Quaterniond heading = turn_y(yaw);
  const Vector3d ball(0.0, -lengths.ankle_height, lengths.ball_forward);
  const Vector3d heel(0.0, -lengths.ankle_height, -lengths.heel_back);
  const Vector3d roll = (ball - turn_x(over_ball) * ball) + (heel - turn_x(over_heel) * heel);
  Foot foot;
  const double sole_height = value_of(controls, Control::kLeftFootY, side);
  foot.ankle = lengths.leg() * Vector3d(value_of(controls, Control::kLeftFootX, side), sole_height,
                                        value_of(controls, Control::kLeftFootZ, side)) +
               Vector3d(0.0, lengths.ankle_height, 0.0) + heading * roll;
  foot.rotation = heading * turn_x(pitch);
  foot.sole_height = sole_height * lengths.leg();
  foot.knee_hinge =
      turn_y(yaw + sign * value_of(controls, Control::kLeftKneeOut, side)) * Vector3d::UnitX();
  // Toes stay flat while the heel lifts off the ground, and relax in the air.
  constexpr double kRelaxHeight = 0.05;
  foot.toe_bend = over_ball / (1.0 + std::pow(sole_height / kRelaxHeight, 2));
  return foot;
}

/// min(value, limit) with a rounded corner of the given width.
double soft_min(double value, double limit, double width) {
  const double gap = value - limit;
  return value - 0.5 * (gap + std::hypot(gap, width));
}

/// The greatest height of the hip joint from which an ankle can be reached, metres.
double reachable_height(const Vector3d& hip, const Vector3d& ankle, double reach) {
  const double across = std::hypot(hip.x() - ankle.x(), hip.z() - ankle.z());
  return ankle.y() + std::sqrt(std::max(reach * reach - across * across, 0.0));
}

/// Rotation that takes a hanging leg bone (-Y, hinge +X) to the direction `along` with its hinge
/// along `hinge`.
Quaterniond bone_rotation(const Vector3d& along, const Vector3d& hinge) {
  Eigen::Matrix3d axes;
  axes.col(1) = -along.normalized();
  axes.col(0) = (hinge - hinge.dot(axes.col(1)) * axes.col(1)).normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return Quaterniond(axes);
}

struct LegRotations {
  Quaterniond thigh;  ///< model-from-thigh
  Quaterniond shin;   ///< model-from-shin
};

/// Two-bone IK by the cosine rule; the knee bends about `hinge`, forward.
LegRotations reach_for(const Vector3d& hip, const Foot& foot, const LegLengths& lengths) {
  const double wanted = (foot.ankle - hip).norm();
  const double distance = soft_min(wanted, kLongestReach * lengths.leg() + 0.003, 0.005);
  const Vector3d along = (foot.ankle - hip) / wanted;
  const Vector3d hinge = (foot.knee_hinge - foot.knee_hinge.dot(along) * along).normalized();
  const double cosine =
      (lengths.thigh * lengths.thigh + distance * distance - lengths.shin * lengths.shin) /
      (2.0 * lengths.thigh * distance);
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
  const Vector3d thigh = std::cos(angle) * along + std::sin(angle) * along.cross(hinge);
  const Vector3d shin = distance * along - lengths.thigh * thigh;
  return {bone_rotation(thigh, hinge), bone_rotation(shin, hinge)};
}

void pose_trunk(const ControlPose& c, std::vector<Quaterniond>& rotations) {
  const auto bend = [](double yaw, double pitch, double roll) {
    return turn_y(yaw) * turn_x(pitch) * turn_z(roll);
  };
  const auto at = [&rotations](StandardJoint joint) -> Quaterniond& {
    return rotations[static_cast<std::size_t>(index_of(joint))];
  };
  at(StandardJoint::kHips) =
      bend(c[Control::kPelvisYaw], c[Control::kPelvisPitch], c[Control::kPelvisRoll]);
  at(StandardJoint::kSpine) =
      bend(c[Control::kSpineYaw], c[Control::kSpinePitch], c[Control::kSpineRoll]);
  at(StandardJoint::kChest) =
      bend(c[Control::kChestYaw], c[Control::kChestPitch], c[Control::kChestRoll]);
  // The neck carries a third of the head's turn and tilt.
  at(StandardJoint::kNeck) =
      bend(c[Control::kHeadYaw] / 3.0, c[Control::kNeckPitch], c[Control::kHeadRoll] / 3.0);
  at(StandardJoint::kHead) = bend(2.0 * c[Control::kHeadYaw] / 3.0, c[Control::kHeadPitch],
                                  2.0 * c[Control::kHeadRoll] / 3.0);
}

void pose_arm(const ControlPose& c, Side side, std::vector<Quaterniond>& rotations) {
  const auto value = [&](Control left) { return value_of(c, left, side); };
  const auto set = [&](StandardJoint left, const Quaterniond& q) {
    rotations[joint_index(left, side)] = side == Side::kLeft ? q : mirrored(q);
  };
  set(StandardJoint::kLeftClavicle,
      turn_y(-value(Control::kLeftShoulderForward)) * turn_z(value(Control::kLeftShoulderRaise)));
  // From the T-pose down to the side (-90 about Z), then out, then forward; twist comes first.
  set(StandardJoint::kLeftUpperArm, turn_x(-value(Control::kLeftArmFlex)) *
                                        turn_z(value(Control::kLeftArmAbduct) - 90.0) *
                                        turn_x(value(Control::kLeftArmTwist)));
  set(StandardJoint::kLeftForearm,
      turn_y(-value(Control::kLeftElbow)) * turn_x(value(Control::kLeftPronation)));
  set(StandardJoint::kLeftHand, turn_z(-value(Control::kLeftWrist)));
}

void pose_leg(const motion::Skeleton& skeleton, const LegLengths& lengths, const Foot& foot,
              const Vector3d& hips, Side side, std::vector<Quaterniond>& rotations) {
  const Quaterniond& model_from_hips = rotations[0];
  const Vector3d hip =
      hips + model_from_hips * rest_offset(skeleton, StandardJoint::kLeftThigh, side);
  const LegRotations leg = reach_for(hip, foot, lengths);
  rotations[joint_index(StandardJoint::kLeftThigh, side)] = model_from_hips.conjugate() * leg.thigh;
  rotations[joint_index(StandardJoint::kLeftShin, side)] = leg.thigh.conjugate() * leg.shin;
  rotations[joint_index(StandardJoint::kLeftFoot, side)] = leg.shin.conjugate() * foot.rotation;
  rotations[joint_index(StandardJoint::kLeftToe, side)] = turn_x(-foot.toe_bend);
}

Vector3d scaled_offset(StandardJoint joint, const Vector3d& offset, const Proportions& build) {
  using enum StandardJoint;
  switch (joint) {
    case kLeftShin:
    case kRightShin:
    case kLeftFoot:
    case kRightFoot:
      return build.height * build.legs * offset;
    case kSpine:
    case kChest:
    case kNeck:
      return build.height * build.trunk * offset;
    case kLeftForearm:
    case kRightForearm:
    case kLeftHand:
    case kRightHand:
      return build.height * build.arms * offset;
    case kLeftClavicle:
    case kRightClavicle:
    case kLeftUpperArm:
    case kRightUpperArm:
      return build.height * Vector3d(build.shoulders * offset.x(), build.trunk * offset.y(), 0.0);
    case kLeftThigh:
    case kRightThigh:
      return build.height * Vector3d(build.hips * offset.x(), offset.y(), 0.0);
    default:
      return build.height * offset;
  }
}

}  // namespace

std::shared_ptr<const motion::Skeleton> build_skeleton(const Proportions& build) {
  std::vector<motion::Joint> joints = motion::standard_skeleton()->joints();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const auto which = static_cast<StandardJoint>(j);
    joints[j].rest_offset = scaled_offset(which, joints[j].rest_offset, build);
    if (!joints[j].end_site) continue;
    const bool hand = which == StandardJoint::kLeftHand || which == StandardJoint::kRightHand;
    *joints[j].end_site *= build.height * (hand ? build.arms : 1.0);
  }
  motion::Skeleton skeleton(joints);
  joints.front().rest_offset.y() = hips_height(skeleton);
  return std::make_shared<const motion::Skeleton>(std::move(joints));
}

BodyPose pose_body(const motion::Skeleton& skeleton, const ControlPose& controls) {
  const LegLengths lengths = leg_lengths(skeleton);
  BodyPose pose;
  pose.rotations.assign(static_cast<std::size_t>(skeleton.joint_count()), Quaterniond::Identity());
  pose_trunk(controls, pose.rotations);
  pose_arm(controls, Side::kLeft, pose.rotations);
  pose_arm(controls, Side::kRight, pose.rotations);

  Vector3d hips(lengths.leg() * controls[Control::kPelvisX],
                hips_height(skeleton) + lengths.leg() * controls[Control::kPelvisY],
                lengths.leg() * controls[Control::kPelvisZ]);
  const std::array<Side, 2> sides = {Side::kLeft, Side::kRight};
  std::array<Foot, 2> feet;
  for (std::size_t i = 0; i < 2; ++i) {
    feet[i] = place_foot(lengths, controls, sides[i]);
    const Vector3d hip =
        hips + pose.rotations[0] * rest_offset(skeleton, StandardJoint::kLeftThigh, sides[i]);
    // A foot in the air may be out of reach: only one near the ground holds the pelvis down.
    const double limit = reachable_height(hip, feet[i].ankle, kLongestReach * lengths.leg()) +
                         2.0 * feet[i].sole_height;
    hips.y() += soft_min(hip.y(), limit, kReachEase * lengths.leg()) - hip.y();
  }
  for (std::size_t i = 0; i < 2; ++i) {
    pose_leg(skeleton, lengths, feet[i], hips, sides[i], pose.rotations);
  }
  pose.root_position = hips;
  return pose;
}

}  // namespace laban::phrase
