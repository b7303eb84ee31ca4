#pragma once

#include <numbers>
#include <span>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/motion/forward_kinematics.h"
#include "laban/motion/skeleton.h"

namespace laban::motion {

/// The joints of one leg of a rig, and the thigh's model-space rotation in the reference pose:
/// there its knee bends about +X.
struct LegJoints {
  int thigh = 0;
  int shin = 0;
  int foot = 0;
  Eigen::Quaterniond thigh_reference = Eigen::Quaterniond::Identity();
};

/// How far the hip has to go down, metres, >= 0, before the foot can be moved by `move` without
/// stretching the leg farther than it is or a knee bent by 10 degrees.
[[nodiscard]] double lowering_to_reach(const ModelPose& pose, const LegJoints& leg,
                                       const Eigen::Vector3d& move);

/// A knee is not straightened beyond this, radians (of bend: 0 is straight).
inline constexpr double kStraightestKnee = 4.0 * std::numbers::pi / 180.0;

/// Bend of the knee about its axis, radians: 0 straight, negative if it bends the wrong way.
[[nodiscard]] double knee_bend(const ModelPose& pose, const LegJoints& leg);

/// Moves the foot joint by `move` (model space, metres) as seen from the hip and keeps the foot's
/// orientation: writes the local rotations of thigh, shin and foot. The knee bends about the normal
/// of the leg's plane, where the leg is straight about the thigh's side. It is straightened no
/// farther than it is or to kStraightestKnee; a foot that cannot reach stays short of its place. A
/// knee that bends the wrong way bends the right way once the foot moves by 2 mm.
void move_foot(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& leg,
               const Eigen::Vector3d& move, std::span<Eigen::Quaterniond> local);

/// Bends the knee to `least_bend`, radians, if it is straighter, and turns the foot to
/// `foot_rotation` (model space): writes the local rotations of shin and foot.
void settle_leg(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& leg,
                double least_bend, const Eigen::Quaterniond& foot_rotation,
                std::span<Eigen::Quaterniond> local);

}  // namespace laban::motion
