#pragma once

#include <memory>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/motion/skeleton.h"

#include "control.h"

namespace laban::phrase {

/// A performer's build, as factors of the standard body (motion/standard_body.h).
struct Proportions {
  double height = 1.0;     ///< every length
  double legs = 1.0;       ///< thigh and shin
  double trunk = 1.0;      ///< spine, chest and neck
  double arms = 1.0;       ///< upper arm, forearm and hand
  double shoulders = 1.0;  ///< width of the shoulders
  double hips = 1.0;       ///< width of the hips
};

/// The standard skeleton in these proportions, at rest in the T-pose with its soles on the ground.
[[nodiscard]] std::shared_ptr<const motion::Skeleton> build_skeleton(const Proportions& build);

/// One frame of a clip on a built skeleton.
struct BodyPose {
  Eigen::Vector3d root_position;              ///< metres
  std::vector<Eigen::Quaterniond> rotations;  ///< parent-from-joint, in joint order
};

/// Joint rotations that show `controls` on a skeleton of build_skeleton. Trunk and arms follow
/// their angles; the legs reach for the feet by two-bone IK. The pelvis comes down where a leg
/// would have to stretch beyond 99.6 % of its length.
[[nodiscard]] BodyPose pose_body(const motion::Skeleton& skeleton, const ControlPose& controls);

}  // namespace laban::phrase
