#pragma once

#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"

#include "motion/rig_tables.h"

namespace laban::motion {

/// A rig in the standard reference T-pose.
struct ReferencePose {
  Humanoid::Mapping joints;
  double leg_length_m = 0.0;
  Eigen::Vector3d root_point = Eigen::Vector3d::Zero();  ///< Humanoid::root_point()
};

/// True if frame 0 is a T-pose (arms sideways, legs down, within 25 degrees) that the next frame
/// jumps away from (some mapped joint turns by more than 10 degrees), or the only frame.
[[nodiscard]] bool begins_with_t_pose(const Clip& clip, const StandardJointIndices& joints);

/// The reference pose of a rig, from the clip's frame 0 if that is its T-pose, else from the rest
/// skeleton and the table.
///
/// @throws Error{kData} if a leg or an arm has no length, or the hip line stands upright.
[[nodiscard]] ReferencePose reference_pose(const Clip& clip, const StandardJointIndices& joints,
                                           const RigTable& table, bool from_first_frame);

}  // namespace laban::motion
