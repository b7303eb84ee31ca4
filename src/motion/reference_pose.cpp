#include "motion/reference_pose.h"

#include <cmath>

#include "laban/base/error.h"
#include "laban/math/constants.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"

namespace laban::motion {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using enum StandardJoint;

int rig_joint(const StandardJointIndices& joints, StandardJoint which) {
  return *joints[static_cast<std::size_t>(index_of(which))];
}

Vector3d position(const ModelPose& pose, const StandardJointIndices& joints, StandardJoint which) {
  return pose.positions.col(rig_joint(joints, which));
}

StandardJoint next(StandardJoint joint) {
  return static_cast<StandardJoint>(index_of(joint) + 1);
}

bool is_right(StandardJoint joint) {
  const int i = index_of(joint);
  return (i >= index_of(kRightClavicle) && i <= index_of(kRightHand)) || i >= index_of(kRightThigh);
}

StandardJoint left_of(StandardJoint joint) {
  return is_right(joint) ? static_cast<StandardJoint>(index_of(joint) - 4) : joint;
}

/// Mirror image in the plane x = 0 of a direction, and of a rotation axis.
Vector3d mirrored(const Vector3d& v) {
  return {-v.x(), v.y(), v.z()};
}
Vector3d mirrored_axis(const Vector3d& v) {
  return {v.x(), -v.y(), -v.z()};
}

/// Model space of the rest skeleton with the table's T-pose rotations applied.
ModelPose table_pose(const Skeleton& skeleton, const RigTable& table) {
  ModelPose pose = rest_pose(skeleton);
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const auto cell = static_cast<std::size_t>(j);
    const Joint& joint = skeleton.joint(j);
    Quaterniond local = Quaterniond::Identity();
    for (const TPoseRotation& turned : table.t_pose) {
      if (turned.name == normalised_joint_name(joint.name)) local = math::exp(turned.rotation);
    }
    if (joint.parent < 0) {
      pose.rotations[cell] = local;
      continue;
    }
    const Quaterniond& model_from_parent = pose.rotations[static_cast<std::size_t>(joint.parent)];
    pose.positions.col(j) =
        pose.positions.col(joint.parent) + model_from_parent * joint.rest_offset;
    pose.rotations[cell] = model_from_parent * local;
  }
  return pose;
}

/// Model space of the T-pose frame, without what the table says is the figure's own.
ModelPose frame_pose(const Clip& clip, const StandardJointIndices& joints, const RigTable& table) {
  ModelPose pose = forward_kinematics(clip, 0);
  for (const StandardJoint joint : table.unbent) {
    const int index = rig_joint(joints, joint);
    const int parent = clip.skeleton().joint(index).parent;
    if (parent < 0) continue;
    pose.rotations[static_cast<std::size_t>(index)] =
        pose.rotations[static_cast<std::size_t>(parent)];
  }
  return pose;
}

/// Turns the pose about +Y until it faces +Z: the hip line and the shoulder line together point
/// along +X. (Each alone is askew by up to a degree on captured bodies.)
ModelPose facing_forward(ModelPose pose, const StandardJointIndices& joints) {
  Vector3d line = position(pose, joints, kLeftThigh) - position(pose, joints, kRightThigh) +
                  position(pose, joints, kLeftUpperArm) - position(pose, joints, kRightUpperArm);
  const double length = line.norm();
  line.y() = 0.0;
  if (!(line.norm() > 0.5 * length)) {
    throw base::Error(base::ErrorKind::kData,
                      "humanoid: hips and shoulders of the rest skeleton do not lie side by side; "
                      "it must stand upright along +Y");
  }
  // A rotation about +Y by a takes +X to (cos a, 0, -sin a).
  const Quaterniond turn = math::yaw_rotation(std::atan2(line.z(), line.x()));
  for (Quaterniond& rotation : pose.rotations) rotation = turn * rotation;
  pose.positions = turn.toRotationMatrix() * pose.positions;
  return pose;
}

/// What the table says of a limb, on the joint's own side.
LimbHint hint_for(const RigTable& table, StandardJoint joint) {
  LimbHint found;
  found.joint = joint;
  for (const LimbHint& hint : table.limbs) {
    if (hint.joint != left_of(joint)) continue;
    found.bone = is_right(joint) ? mirrored(hint.bone) : hint.bone;
    found.hinge = is_right(joint) ? mirrored_axis(hint.hinge) : hint.hinge;
  }
  return found;
}

/// The direction of a limb's bone in the pose: the table's, or from the joint to the next.
Vector3d bone_direction(const ModelPose& pose, const StandardJointIndices& joints,
                        const RigTable& table, StandardJoint joint) {
  const Vector3d told = hint_for(table, joint).bone;
  if (!told.isZero()) return told;
  const Vector3d bone = position(pose, joints, next(joint)) - position(pose, joints, joint);
  if (!(bone.norm() > 0.0)) {
    throw base::Error(
        base::ErrorKind::kData,
        "humanoid: " + std::string(kStandardJointNames[static_cast<std::size_t>(index_of(joint))]) +
            " has no length on this skeleton");
  }
  return bone;
}

/// Flexion axis of the elbow or knee of a limb: the table's; else, where the pose bends it visibly,
/// the normal of the bend; zero if neither tells.
Vector3d hinge_axis(const ModelPose& pose, const StandardJointIndices& joints,
                    const RigTable& table, StandardJoint upper) {
  const Vector3d told = hint_for(table, upper).hinge;
  if (!told.isZero()) return told;
  const Vector3d a = bone_direction(pose, joints, table, upper).normalized();
  const Vector3d b = bone_direction(pose, joints, table, next(upper)).normalized();
  const Vector3d normal = a.cross(b);
  // Below 10 degrees a bend says more about where joint centres were put than about the hinge.
  return normal.norm() > std::sin(10.0 * math::kDegree) ? normal : Vector3d(Vector3d::Zero());
}

/// Standard-from-pose rotation of the arm's three joints. Elbows flex the hand forward: about -Y on
/// the left, +Y on the right. With no hinge known, what points forward stays forward.
void align_arm(const ModelPose& pose, const StandardJointIndices& joints, const RigTable& table,
               StandardJoint upper, std::array<Quaterniond, kStandardJointCount>& aligned) {
  const double side = is_right(upper) ? -1.0 : 1.0;
  const Vector3d outward = side * Vector3d::UnitX();
  const Vector3d hinge = hinge_axis(pose, joints, table, upper);
  const auto turn = [&](const Vector3d& bone) {
    return hinge.isZero()
               ? math::rotation_between_frames(bone, Vector3d::UnitZ(), outward, Vector3d::UnitZ())
               : math::rotation_between_frames(bone, hinge, outward, -side * Vector3d::UnitY());
  };
  const StandardJoint fore = next(upper);
  const Vector3d fore_bone = bone_direction(pose, joints, table, fore);
  aligned[static_cast<std::size_t>(index_of(upper))] =
      turn(bone_direction(pose, joints, table, upper));
  aligned[static_cast<std::size_t>(index_of(fore))] = turn(fore_bone);
  // The hand is in line with the forearm, its palm down: the hinge says nothing about it.
  aligned[static_cast<std::size_t>(index_of(next(fore)))] =
      math::rotation_between_frames(fore_bone, Vector3d::UnitZ(), outward, Vector3d::UnitZ());
}

/// Standard-from-pose rotation of the leg's joints. Knees flex about +X on both sides; feet and
/// toes are flat and turn forward.
void align_leg(const ModelPose& pose, const StandardJointIndices& joints, const RigTable& table,
               StandardJoint thigh, std::array<Quaterniond, kStandardJointCount>& aligned) {
  Vector3d hinge = hinge_axis(pose, joints, table, thigh);
  if (hinge.isZero()) hinge = Vector3d::UnitX();
  for (const StandardJoint joint : {thigh, next(thigh)}) {
    aligned[static_cast<std::size_t>(index_of(joint))] = math::rotation_between_frames(
        bone_direction(pose, joints, table, joint), hinge, -Vector3d::UnitY(), Vector3d::UnitX());
  }
  const StandardJoint foot = next(next(thigh));
  const StandardJoint toe = next(foot);
  Vector3d forward = hint_for(table, foot).bone;
  if (forward.isZero() && joints[static_cast<std::size_t>(index_of(toe))]) {
    forward = position(pose, joints, toe) - position(pose, joints, foot);
  }
  forward.y() = 0.0;
  if (!(forward.z() > 0.0)) forward = Vector3d::UnitZ();
  const Quaterniond turn = math::rotation_between_frames(forward, Vector3d::UnitY(),
                                                         Vector3d::UnitZ(), Vector3d::UnitY());
  aligned[static_cast<std::size_t>(index_of(foot))] = turn;
  aligned[static_cast<std::size_t>(index_of(toe))] = turn;
}

/// References of a rig that stands upright in `pose`: torso joints and clavicles keep their
/// orientation (where their bones point is a rig's choice of joint centres), limbs are turned.
Humanoid::Mapping references_from_pose(const ModelPose& pose, const StandardJointIndices& joints,
                                       const RigTable& table) {
  std::array<Quaterniond, kStandardJointCount> aligned;
  aligned.fill(Quaterniond::Identity());
  for (const StandardJoint arm : {kLeftUpperArm, kRightUpperArm}) {
    align_arm(pose, joints, table, arm, aligned);
  }
  for (const StandardJoint leg : {kLeftThigh, kRightThigh}) {
    align_leg(pose, joints, table, leg, aligned);
  }
  Humanoid::Mapping mapping;
  for (std::size_t s = 0; s < mapping.size(); ++s) {
    if (!joints[s]) continue;
    const Quaterniond& in_pose = pose.rotations[static_cast<std::size_t>(*joints[s])];
    mapping[s] = MappedJoint{*joints[s], (aligned[s] * in_pose).normalized()};
  }
  return mapping;
}

Humanoid::Mapping references_from_axes(const StandardJointIndices& joints, const RigTable& table) {
  Humanoid::Mapping mapping;
  for (const AxisHint& hint : table.axes) {
    const auto s = static_cast<std::size_t>(index_of(hint.joint));
    if (!joints[s]) continue;
    mapping[s] = MappedJoint{
        *joints[s], math::rotation_between_frames(hint.first_local, hint.second_local,
                                                  hint.first_standard, hint.second_standard)};
  }
  return mapping;
}

double leg_length(const ModelPose& pose, const StandardJointIndices& joints) {
  double sum = 0.0;
  for (const StandardJoint thigh : {kLeftThigh, kRightThigh}) {
    for (const StandardJoint bone : {thigh, next(thigh)}) {
      sum += (position(pose, joints, next(bone)) - position(pose, joints, bone)).norm();
    }
  }
  return 0.5 * sum;
}

/// The standard body's hips lie above the middle of its hip line by this, leg lengths.
double root_above_hip_line() {
  return -standard_skeleton()->joint(index_of(kLeftThigh)).rest_offset.y() / kStandardLegLengthM;
}

}  // namespace

bool begins_with_t_pose(const Clip& clip, const StandardJointIndices& joints) {
  const ModelPose pose = facing_forward(forward_kinematics(clip, 0), joints);
  const auto points = [&](StandardJoint joint, const Vector3d& along) {
    const Vector3d bone = position(pose, joints, next(joint)) - position(pose, joints, joint);
    return bone.normalized().dot(along) > std::cos(25.0 * math::kDegree);
  };
  const Vector3d x = Vector3d::UnitX();
  const Vector3d down = -Vector3d::UnitY();
  const bool stands = points(kLeftUpperArm, x) && points(kLeftForearm, x) &&
                      points(kRightUpperArm, -x) && points(kRightForearm, -x) &&
                      points(kLeftThigh, down) && points(kLeftShin, down) &&
                      points(kRightThigh, down) && points(kRightShin, down);
  if (!stands) return false;
  if (clip.frame_count() == 1) return true;
  for (const std::optional<int>& joint : joints) {
    if (joint && math::angle_between(clip.rotation(0, *joint), clip.rotation(1, *joint)) >
                     10.0 * math::kDegree) {
      return true;
    }
  }
  return false;
}

ReferencePose reference_pose(const Clip& clip, const StandardJointIndices& joints,
                             const RigTable& table, bool from_first_frame) {
  ReferencePose reference;
  ModelPose pose =
      from_first_frame ? frame_pose(clip, joints, table) : table_pose(clip.skeleton(), table);
  if (table.axes.empty()) {
    pose = facing_forward(std::move(pose), joints);
    reference.joints = references_from_pose(pose, joints, table);
  } else {
    reference.joints = references_from_axes(joints, table);
  }
  reference.leg_length_m = leg_length(pose, joints);
  const MappedJoint& hips = *reference.joints[static_cast<std::size_t>(index_of(kHips))];
  const Vector3d hip_line_middle =
      0.5 * (position(pose, joints, kLeftThigh) + position(pose, joints, kRightThigh));
  const Quaterniond hips_from_model =
      pose.rotations[static_cast<std::size_t>(hips.joint)].conjugate();
  reference.root_point = hips_from_model * (hip_line_middle - position(pose, joints, kHips)) +
                         hips.reference.conjugate() *
                             Vector3d(0.0, root_above_hip_line() * reference.leg_length_m, 0.0);
  return reference;
}

}  // namespace laban::motion
