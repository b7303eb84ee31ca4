#pragma once

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

/// Moves the foot joint by `move` (model space, metres) as seen from the hip and keeps the foot's
/// orientation: writes the local rotations of thigh, shin and foot. The leg is stretched no farther
/// than it is or a knee bent by 4 degrees; a foot that cannot reach stays short of its place.
void move_foot(const ModelPose& pose, const Skeleton& skeleton, const LegJoints& leg,
               const Eigen::Vector3d& move, std::span<Eigen::Quaterniond> local);

}  // namespace laban::motion
