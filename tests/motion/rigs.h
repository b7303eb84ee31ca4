#pragma once

#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "laban/motion/clip.h"
#include "laban/motion/skeleton.h"
#include "laban/motion/standard_joint.h"

namespace laban::test {

inline constexpr double kDegree = std::numbers::pi / 180.0;

/// A Mixamo character of 1.8 m in its bind pose (T-pose, identity rotations), with one finger a
/// hand; names begin with "mixamorig:".
[[nodiscard]] motion::Skeleton mixamo_skeleton();

/// A rig with the joint names of a program or a studio, on one upright body.
struct NamedRig {
  std::string rig_name;       ///< that find_humanoid must give
  motion::Skeleton skeleton;  ///< with fingers, twist joints and ends, where the rig has them
  double arms_down_degrees;   ///< at rest, from the T-pose: 0 or an A-pose
  std::map<motion::StandardJoint, std::string> expected;  ///< names by standard joint
};

/// Every rig whose rest skeleton stands upright.
[[nodiscard]] std::vector<NamedRig> upright_rigs();

/// LAFAN1: each bone lies along its joint's x axis.
[[nodiscard]] motion::Skeleton lafan_skeleton();
/// The first frame of a LAFAN1 file, nearly a T-pose.
[[nodiscard]] motion::Clip lafan_first_frame();

/// One frame of a skeleton at rest, at 30 Hz.
[[nodiscard]] motion::Clip at_rest(const motion::Skeleton& skeleton);

/// Smooth random motion of every joint of a skeleton at 60 Hz, turning past a full circle.
[[nodiscard]] motion::Clip random_motion(const motion::Skeleton& skeleton, int frames,
                                         unsigned seed);

}  // namespace laban::test
