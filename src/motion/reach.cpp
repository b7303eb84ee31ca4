#include "laban/motion/reach.h"

#include <algorithm>
#include <array>

#include "laban/base/error.h"
#include "laban/motion/forward_kinematics.h"

#include "motion/two_bone_ik.h"

namespace laban::motion {
namespace {

using enum StandardJoint;

/// A limb, and where its middle joint's hinge lies in the reference pose: a positive turn about it
/// brings the forearm forwards, the shin backwards.
struct Limb {
  StandardJoint upper;
  StandardJoint lower;
  StandardJoint end;
  Eigen::Vector3d hinge;
};

const std::array<Limb, 4>& limbs() {
  static const std::array<Limb, 4> all{
      {{kLeftUpperArm, kLeftForearm, kLeftHand, -Eigen::Vector3d::UnitY()},
       {kRightUpperArm, kRightForearm, kRightHand, Eigen::Vector3d::UnitY()},
       {kLeftThigh, kLeftShin, kLeftFoot, Eigen::Vector3d::UnitX()},
       {kRightThigh, kRightShin, kRightFoot, Eigen::Vector3d::UnitX()}}};
  return all;
}

}  // namespace

bool is_limb_end(StandardJoint joint) noexcept {
  return std::any_of(limbs().begin(), limbs().end(),
                     [&](const Limb& limb) { return limb.end == joint; });
}

std::vector<Eigen::Quaterniond> reach(const Clip& clip, int frame, const Humanoid& humanoid,
                                      StandardJoint end, const Eigen::Vector3d& target) {
  using base::Error;
  using base::ErrorKind;
  if (clip.joint_count() != humanoid.rig_joint_count() || frame < 0 || frame >= clip.frame_count())
    throw Error(ErrorKind::kUsage, "reach: the humanoid or the frame is not of this clip");
  if (!is_limb_end(end))
    throw Error(ErrorKind::kUsage, "reach: only a hand or a foot reaches for a place");
  if (!target.allFinite()) throw Error(ErrorKind::kData, "reach: the place is not finite");
  const Limb& limb = *std::find_if(limbs().begin(), limbs().end(),
                                   [&](const Limb& one) { return one.end == end; });
  const auto mapped = [&](StandardJoint joint) { return *humanoid.mapped(joint); };
  const LegJoints joints{mapped(limb.upper).joint, mapped(limb.lower).joint, mapped(limb.end).joint,
                         mapped(limb.upper).reference.conjugate() * limb.hinge};
  const auto before = clip.rotations(frame);
  std::vector<Eigen::Quaterniond> local(before.begin(), before.end());
  reach_for(forward_kinematics(clip, frame), clip.skeleton(), joints, target, local);
  return local;
}

}  // namespace laban::motion
