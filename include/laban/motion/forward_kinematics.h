#pragma once

#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/motion/clip.h"

namespace laban::motion {

/// Model-space transforms of all J joints at one frame.
struct ModelPose {
  Eigen::Matrix3Xd positions;                 ///< 3 x J, metres
  std::vector<Eigen::Quaterniond> rotations;  ///< J, model-from-joint
};

/// Model-space transforms at `frame`: model_from_child = model_from_parent * parent_from_child.
[[nodiscard]] ModelPose forward_kinematics(const Clip& clip, int frame);

/// Model-space joint positions of a whole clip, 3 x F*J, frame-major, metres.
[[nodiscard]] Eigen::Matrix3Xd joint_positions(const Clip& clip);

/// Model-space transforms of the rest skeleton: every rotation the identity, rest offsets.
[[nodiscard]] ModelPose rest_pose(const Skeleton& skeleton);

}  // namespace laban::motion
