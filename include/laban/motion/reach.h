#pragma once

#include <vector>

#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {

/// True for the joints that can be brought to a place: hips, head, hands, feet, elbows and knees
/// (the forearm and shin joints).
[[nodiscard]] bool can_reach(StandardJoint joint) noexcept;

/// True for elbows and knees, which go where hand and foot leave them room.
[[nodiscard]] bool is_limb_middle(StandardJoint joint) noexcept;

/// The joints whose local rotations reach may change for `joint`, in order; all others keep theirs.
/// @throws Error{kUsage} unless can_reach(joint).
[[nodiscard]] std::vector<StandardJoint> turned_for(StandardJoint joint);

/// A frame's pose with one joint brought to a place, bones keeping their lengths:
///  - a hand or foot by two-bone IK: elbow or knee bends about the axis that it bends about
///    already, about its hinge where it is straight; the hand or foot keeps its orientation. What
///    is out of reach is reached for;
///  - the head likewise, the trunk bending at spine and chest, forwards where it is straight: neck
///    and arms go along, the head keeps its orientation;
///  - an elbow or knee by a swivel: the limb turns about the line from shoulder (hip) to hand
///    (foot), which stays, until the joint is as near as it comes. A straight limb stays;
///  - the hips by moving the root; hands and feet stay where they are, as far as they reach.
///
/// @param target  of the joint, metres, model space.
/// @returns a clip of one frame.
/// @throws Error{kUsage} if the humanoid was made for a skeleton of another size, there is no such
///         frame, or the joint cannot be brought anywhere; Error{kData} if the target is not
///         finite.
[[nodiscard]] Clip reach(const Clip& clip, int frame, const Humanoid& humanoid, StandardJoint joint,
                         const Eigen::Vector3d& target);

}  // namespace laban::motion
