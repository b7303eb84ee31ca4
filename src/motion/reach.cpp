#include "laban/motion/reach.h"

#include <algorithm>
#include <array>
#include <span>

#include "laban/base/error.h"
#include "laban/motion/forward_kinematics.h"

#include "motion/two_bone_ik.h"

namespace laban::motion {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using enum StandardJoint;

/// Two bones, and where the hinge between them lies in the reference pose: a positive turn about it
/// brings the forearm forwards, the shin backwards, the chest forwards.
struct Limb {
  StandardJoint upper;
  StandardJoint lower;
  StandardJoint end;
  Vector3d hinge;
};

constexpr std::size_t kArmsAndLegs = 4;

/// Arms and legs, then the trunk.
const std::array<Limb, kArmsAndLegs + 1>& limbs() {
  static const std::array<Limb, kArmsAndLegs + 1> all{
      {{kLeftUpperArm, kLeftForearm, kLeftHand, -Vector3d::UnitY()},
       {kRightUpperArm, kRightForearm, kRightHand, Vector3d::UnitY()},
       {kLeftThigh, kLeftShin, kLeftFoot, Vector3d::UnitX()},
       {kRightThigh, kRightShin, kRightFoot, Vector3d::UnitX()},
       {kSpine, kChest, kHead, Vector3d::UnitX()}}};
  return all;
}

std::span<const Limb> arms_and_legs() {
  return std::span(limbs()).first(kArmsAndLegs);
}

const Limb* limb_ending_with(StandardJoint joint) {
  const auto found = std::ranges::find(limbs(), joint, &Limb::end);
  return found == limbs().end() ? nullptr : &*found;
}

const Limb* limb_bending_at(StandardJoint joint) {
  const auto found = std::ranges::find(arms_and_legs(), joint, &Limb::lower);
  return found == arms_and_legs().end() ? nullptr : &*found;
}

LegJoints joints_of(const Limb& limb, const Humanoid& humanoid) {
  const auto mapped = [&](StandardJoint joint) { return *humanoid.mapped(joint); };
  return {mapped(limb.upper).joint, mapped(limb.lower).joint, mapped(limb.end).joint,
          mapped(limb.upper).reference.conjugate() * limb.hinge};
}

std::vector<Quaterniond> rotations_of(const Clip& pose) {
  const auto rotations = pose.rotations(0);
  return {rotations.begin(), rotations.end()};
}

/// A pose with other rotations.
Clip turned(const Clip& pose, std::vector<Quaterniond> rotations) {
  Eigen::Matrix3Xd translations;
  if (pose.has_translations()) {
    translations.resize(3, pose.joint_count());
    for (int j = 0; j < pose.joint_count(); ++j) translations.col(j) = pose.translation(0, j);
  }
  return {pose.shared_skeleton(), pose.frame_rate_hz(), pose.root_positions(), std::move(rotations),
          std::move(translations)};
}

/// A pose that is elsewhere.
Clip moved(const Clip& pose, const Vector3d& by) {
  Eigen::Matrix3Xd translations;
  if (pose.has_translations()) {
    translations.resize(3, pose.joint_count());
    for (int j = 0; j < pose.joint_count(); ++j) {
      translations.col(j) = pose.translation(0, j);
      if (pose.skeleton().joint(j).parent < 0) translations.col(j) += by;
    }
  }
  return {pose.shared_skeleton(), pose.frame_rate_hz(), pose.root_positions().colwise() + by,
          rotations_of(pose), std::move(translations)};
}

Clip with_end_at(const Clip& pose, const LegJoints& limb, const Vector3d& target) {
  std::vector<Quaterniond> local = rotations_of(pose);
  reach_for(forward_kinematics(pose, 0), pose.skeleton(), limb, target, local);
  return turned(pose, std::move(local));
}

Clip with_middle_near(const Clip& pose, const LegJoints& limb, const Vector3d& target) {
  std::vector<Quaterniond> local = rotations_of(pose);
  swivel(forward_kinematics(pose, 0), pose.skeleton(), limb, target, local);
  return turned(pose, std::move(local));
}

Clip with_hips_at(const Clip& pose, const Humanoid& humanoid, const Vector3d& target) {
  const ModelPose before = forward_kinematics(pose, 0);
  Clip result = moved(pose, target - before.positions.col(humanoid.mapped(kHips)->joint));
  for (const Limb& limb : arms_and_legs()) {
    const LegJoints joints = joints_of(limb, humanoid);
    result = with_end_at(result, joints, before.positions.col(joints.foot));
  }
  return result;
}

}  // namespace

bool is_limb_middle(StandardJoint joint) noexcept {
  return limb_bending_at(joint) != nullptr;
}

bool can_reach(StandardJoint joint) noexcept {
  return joint == kHips || is_limb_middle(joint) || limb_ending_with(joint) != nullptr;
}

std::vector<StandardJoint> turned_for(StandardJoint joint) {
  if (!can_reach(joint))
    throw Error(ErrorKind::kUsage, "turned_for: this joint cannot be brought to a place");
  std::vector<StandardJoint> all;
  for (const Limb& limb : limbs()) {
    const bool arm_or_leg = limb.end != kHead;
    if (joint == limb.end || joint == limb.lower || (joint == kHips && arm_or_leg))
      all.insert(all.end(), {limb.upper, limb.lower, limb.end});
  }
  return all;
}

Clip reach(const Clip& clip, int frame, const Humanoid& humanoid, StandardJoint joint,
           const Vector3d& target) {
  if (clip.joint_count() != humanoid.rig_joint_count() || frame < 0 || frame >= clip.frame_count())
    throw Error(ErrorKind::kUsage, "reach: the humanoid or the frame is not of this clip");
  if (!can_reach(joint))
    throw Error(ErrorKind::kUsage, "reach: this joint cannot be brought to a place");
  if (!target.allFinite()) throw Error(ErrorKind::kData, "reach: the place is not finite");
  const Clip pose = clip.slice(frame, frame + 1);
  if (joint == kHips) return with_hips_at(pose, humanoid, target);
  if (const Limb* limb = limb_bending_at(joint))
    return with_middle_near(pose, joints_of(*limb, humanoid), target);
  return with_end_at(pose, joints_of(*limb_ending_with(joint), humanoid), target);
}

}  // namespace laban::motion
