#pragma once

#include <span>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/math/constants.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/skeleton.h"

namespace laban::motion {

/// The joints of one leg of a rig, and its knee's hinge in the thigh's own space: a unit vector
/// about which a positive turn bends the knee.
struct LegJoints {
  int thigh = 0;
  int shin = 0;
  int foot = 0;
  Eigen::Vector3d hinge = Eigen::Vector3d::UnitX();
};

/// Where the knee's hinge lies, in the thigh's own space: across the plane in which the leg bends
/// in the poses, deep bends counting most. Where they hardly bend it, where the reference has it:
/// `thigh_reference`, the thigh's model-space rotation in the reference pose, whose hinge is +X;
/// turned about if most of the poses bend it the other way.
[[nodiscard]] Eigen::Vector3d find_hinge(std::span<const ModelPose> poses, const LegJoints& leg,
                                         const Eigen::Quaterniond& thigh_reference);

/// How far the hip has to go down, metres, >= 0, before the foot can be moved by `move` without
/// stretching the leg farther than it is or a knee bent by 10 degrees.
[[nodiscard]] double lowering_to_reach(const ModelPose& pose, const LegJoints& leg,
                                       const Eigen::Vector3d& move);

/// A knee is not straightened beyond this, radians (of bend: 0 is straight).
inline constexpr double kStraightestKnee = 4.0 * math::kDegree;

/// Bend of the knee about its axis, radians: 0 straight, negative if it bends the wrong way.
[[nodiscard]] double knee_bend(const ModelPose& pose, const LegJoints& leg);

/// Moves the foot joint by `move` (model space, metres) as seen from the hip and keeps the foot's
/// orientation: writes the local rotations of thigh, shin and foot. The knee bends about the normal
/// of the leg's plane, where the leg is straight about its hinge. It is straightened no farther
/// than it is or to kStraightestKnee; a foot that cannot reach stays short of its place. The knee
/// of the result does not bend the wrong way (see mend_knee).
void move_foot(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& leg,
               const Eigen::Vector3d& move, std::span<Eigen::Quaterniond> local);

/// Brings the end of a limb, an arm as well as a leg, to `target` (model space, metres), as near as
/// its bones let it: writes the local rotations of its three joints, the end keeping its
/// orientation. It bends about the normal of its plane, where it is straight about its hinge.
void reach_for(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& limb,
               const Eigen::Vector3d& target, std::span<Eigen::Quaterniond> local);

/// Turns a limb about the line from its first joint to its end until its middle joint is as near to
/// `target` (model space, metres) as that brings it: writes the local rotations of its three
/// joints, the end keeping its orientation. Nothing is written if the limb is straight or the
/// target lies on that line.
void swivel(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& limb,
            const Eigen::Vector3d& target, std::span<Eigen::Quaterniond> local);

/// Bends a knee that the wrong way is bent, as blends beyond their sources bend it, to straight,
/// and what is nearly straight a little: bend(-4 degrees) = 0, bend(4 degrees) = 4 degrees,
/// smoothly. The foot stays in its direction from the hip and keeps its orientation. Writes the
/// local rotations of thigh, shin and foot; false if nothing is to be done.
bool mend_knee(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& leg,
               std::span<Eigen::Quaterniond> local);

/// Bends the knee, if it is straighter, to `least_bend`, radians, and less the more it is bent,
/// nothing from kSettleWidth above it on; turns the foot to `foot_rotation` (model space): writes
/// the local rotations of shin and foot.
void settle_leg(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& leg,
                double least_bend, const Eigen::Quaterniond& foot_rotation,
                std::span<Eigen::Quaterniond> local);

/// What settle_leg changes reaches so far above its least bend, radians.
inline constexpr double kSettleWidth = 2.0 * math::kDegree;

}  // namespace laban::motion
