#pragma once

#include <array>
#include <span>

#include <Eigen/Dense>

#include "laban/motion/clip.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/humanoid.h"

#include "motion/two_bone_ik.h"

namespace laban::motion {

/// Both legs of a rig, their hinges found from the poses.
[[nodiscard]] std::array<LegJoints, 2> legs_of(const Humanoid& humanoid,
                                               std::span<const ModelPose> poses);

/// The clip with knees that do not bend the wrong way (mend_knee); legs that bend by more than 4
/// degrees keep their rotations bit for bit.
[[nodiscard]] Clip mend_knees(const Clip& clip, const std::array<LegJoints, 2>& legs);

/// Brings the left and the right foot joint to `goals` (3 x F, model space) by two-bone IK; the
/// feet keep their orientation in model space.
///
/// What is added to the joints, a displacement map [LeeShin99], has nothing above 8 Hz: solved
/// frame by frame, legs that are nearly straight would snap, and a foot would be held stiller than
/// the body above it moves. What a round of low-passed solutions leaves is solved in the next.
/// Limits are those of move_foot; a leg that needs no displacement keeps its rotations bit for bit.
[[nodiscard]] Clip place_feet(const Clip& clip, const std::array<LegJoints, 2>& legs,
                              const std::array<Eigen::Matrix3Xd, 2>& goals);

}  // namespace laban::motion
