#include "laban/motion/retarget.h"

#include <cmath>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"

#include "motion/clip_sample.h"
#include "motion/require_fit.h"

namespace laban::motion {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Quaterniond;
using Eigen::Vector3d;

using StandardRotations = std::array<Quaterniond, kStandardJointCount>;

const MappedJoint& hips_of(const Humanoid& humanoid) {
  return *humanoid.mapped(StandardJoint::kHips);
}

void require_motion(const Clip& clip, const Humanoid& humanoid, const std::string& place) {
  require_fit(clip, humanoid, place);
  if (clip.frame_count() <= humanoid.first_motion_frame()) {
    throw Error(ErrorKind::kData, place + ": the clip holds a T-pose frame and no motion");
  }
}

/// A joint that bends like a hinge, and the direction of its bone in the standard T-pose.
struct Hinge {
  StandardJoint upper, lower;
  Vector3d bone;
};

const std::array<Hinge, 4>& hinges() {
  using enum StandardJoint;
  static const std::array<Hinge, 4> all = {{{kLeftUpperArm, kLeftForearm, Vector3d::UnitX()},
                                            {kRightUpperArm, kRightForearm, Vector3d::UnitX()},
                                            {kLeftThigh, kLeftShin, Vector3d::UnitY()},
                                            {kRightThigh, kRightShin, Vector3d::UnitY()}}};
  return all;
}

/// The turn of a hinge's lower bone about itself: q = swing * twist.
Quaterniond twist_of(const Quaterniond& upper_R, const Quaterniond& lower_R, const Hinge& hinge) {
  const Quaterniond q = upper_R.conjugate() * lower_R;
  const Vector3d along = q.vec().dot(hinge.bone) * hinge.bone;
  const Quaterniond twist(q.w(), along.x(), along.y(), along.z());
  // Bent by 180 degrees, a bone has no turn about itself.
  return twist.norm() < 1e-9 ? Quaterniond::Identity() : twist.normalized();
}

/// R_s of all standard joints; one that the rig does not have turns with its parent. Hinges are
/// free of twist.
StandardRotations standard_rotations(const ModelPose& pose, const Humanoid& humanoid) {
  StandardRotations R;
  for (std::size_t s = 0; s < R.size(); ++s) {
    const auto& mapped = humanoid.mapped(static_cast<StandardJoint>(s));
    R[s] = mapped ? pose.rotations[static_cast<std::size_t>(mapped->joint)] *
                        mapped->reference.conjugate()
                  : R[static_cast<std::size_t>(kStandardParents[s])];
  }
  for (const Hinge& hinge : hinges()) {
    Quaterniond& lower = R[static_cast<std::size_t>(index_of(hinge.lower))];
    const Quaterniond& upper = R[static_cast<std::size_t>(index_of(hinge.upper))];
    lower = lower * twist_of(upper, lower, hinge).conjugate();
  }
  return R;
}

/// Root path at one frame: x, z in leg lengths, heading; and the height.
struct RootPlace {
  Vector3d planar = Vector3d::Zero();
  double height = 0.0;
};

RootPlace root_place(const ModelPose& pose, const Quaterniond& hips_rotation,
                     const Humanoid& humanoid) {
  const auto hips = static_cast<std::size_t>(hips_of(humanoid).joint);
  const Vector3d root = (pose.positions.col(static_cast<Eigen::Index>(hips)) +
                         pose.rotations[hips] * humanoid.root_point()) /
                        humanoid.leg_length_m();
  return {{root.x(), root.z(), math::heading_of(hips_rotation)}, root.y()};
}

/// The other way: model-space rotation and position of the rig's hips joint.
struct HipsPlace {
  Quaterniond rotation;
  Vector3d position;
};

HipsPlace hips_place(const Vector3d& planar, double height, const Quaterniond& hips_rotation,
                     const Humanoid& humanoid) {
  const Quaterniond rotation = hips_rotation * hips_of(humanoid).reference;
  const Vector3d root = humanoid.leg_length_m() * Vector3d(planar.x(), height, planar.y());
  return {rotation, root - rotation * humanoid.root_point()};
}

/// R_s of one frame of a pose matrix, from local rotations and heading.
StandardRotations composed_rotations(const PoseMatrix& pose, int frame, double yaw) {
  StandardRotations R;
  for (int s = 0; s < kStandardJointCount; ++s) {
    const Quaterniond local = math::exp(pose.angles.block<3, 1>(3 * s, frame));
    const int parent = kStandardParents[static_cast<std::size_t>(s)];
    const Quaterniond above =
        parent < 0 ? math::yaw_rotation(yaw) : R[static_cast<std::size_t>(parent)];
    R[static_cast<std::size_t>(s)] = above * local;
  }
  return R;
}

/// Model-space rotation of one joint of the source.
Quaterniond model_rotation_at(const Clip& clip, const FramePosition& at, int joint) {
  Quaterniond rotation = rotation_at(clip, at, joint);
  for (int j = clip.skeleton().joint(joint).parent; j >= 0; j = clip.skeleton().joint(j).parent) {
    rotation = rotation_at(clip, at, j) * rotation;
  }
  return rotation;
}

/// Gives the hinges the twist that the source has there.
void add_source_twist(StandardRotations& R, const Humanoid& humanoid, const Clip& source,
                      const FramePosition& at) {
  const auto source_R = [&](StandardJoint joint) {
    const auto& mapped = humanoid.mapped(joint);
    return model_rotation_at(source, at, mapped->joint) * mapped->reference.conjugate();
  };
  for (const Hinge& hinge : hinges()) {
    Quaterniond& lower = R[static_cast<std::size_t>(index_of(hinge.lower))];
    lower = lower * twist_of(source_R(hinge.upper), source_R(hinge.lower), hinge);
  }
}

/// The source frame (in the clip's own count) to read at each pose frame.
std::vector<FramePosition> source_positions(const PoseMatrix& pose, const Humanoid& humanoid,
                                            const Clip& source, const RetargetOptions& options) {
  const int frames = pose.frame_count();
  const int first = humanoid.first_motion_frame();
  const int motion_frames = source.frame_count() - first;
  if (!options.source_frames.empty() &&
      options.source_frames.size() != static_cast<std::size_t>(frames)) {
    throw Error(ErrorKind::kUsage, "RetargetOptions::source_frames has " +
                                       std::to_string(options.source_frames.size()) +
                                       " values for " + std::to_string(frames) + " pose frames");
  }
  const double step = frames > 1 ? (motion_frames - 1.0) / (frames - 1.0) : 0.0;
  std::vector<FramePosition> positions;
  positions.reserve(static_cast<std::size_t>(frames));
  for (int f = 0; f < frames; ++f) {
    const double at = options.source_frames.empty()
                          ? f * step
                          : options.source_frames[static_cast<std::size_t>(f)];
    if (!std::isfinite(at)) {
      throw Error(ErrorKind::kUsage,
                  "RetargetOptions::source_frames: value " + std::to_string(f) + " is not finite");
    }
    FramePosition position = frame_position(at, motion_frames);
    position.frame += first;
    positions.push_back(position);
  }
  return positions;
}

/// For each rig joint the standard joint it plays, -1 for none.
std::vector<int> roles(const Humanoid& humanoid) {
  std::vector<int> played(static_cast<std::size_t>(humanoid.rig_joint_count()), -1);
  for (int s = 0; s < kStandardJointCount; ++s) {
    const auto& mapped = humanoid.mapped(static_cast<StandardJoint>(s));
    if (mapped) played[static_cast<std::size_t>(mapped->joint)] = s;
  }
  return played;
}

/// One rig frame being written: local rotations and offsets, model-space transforms beside them.
struct RigFrame {
  std::vector<Quaterniond> local, model;
  Eigen::Matrix3Xd offsets, positions;
};

/// Fills a frame, parents first: mapped joints reach their model-space rotation, the hips their
/// place, all else follows the source.
void solve_frame(const StandardRotations& R, const HipsPlace& hips, const Humanoid& humanoid,
                 const Clip& source, const FramePosition& at, const std::vector<int>& played,
                 RigFrame& frame) {
  for (int j = 0; j < source.joint_count(); ++j) {
    const auto cell = static_cast<std::size_t>(j);
    const int parent = source.skeleton().joint(j).parent;
    const bool is_root = parent < 0;
    const auto above = static_cast<std::size_t>(is_root ? 0 : parent);
    const Quaterniond model_from_parent = is_root ? Quaterniond::Identity() : frame.model[above];
    const Vector3d parent_position =
        is_root ? Vector3d(Vector3d::Zero()) : Vector3d(frame.positions.col(parent));
    const int s = played[cell];
    if (s < 0) {
      frame.local[cell] = rotation_at(source, at, j);
      frame.model[cell] = (model_from_parent * frame.local[cell]).normalized();
    } else {
      const auto& mapped = humanoid.mapped(static_cast<StandardJoint>(s));
      frame.model[cell] = (R[static_cast<std::size_t>(s)] * mapped->reference).normalized();
      frame.local[cell] = (model_from_parent.conjugate() * frame.model[cell]).normalized();
    }
    frame.offsets.col(j) = s == index_of(StandardJoint::kHips)
                               ? model_from_parent.conjugate() * (hips.position - parent_position)
                               : translation_at(source, at, j);
    frame.positions.col(j) = parent_position + model_from_parent * frame.offsets.col(j);
  }
}

}  // namespace

PoseMatrix to_pose_matrix(const Clip& clip, const Humanoid& humanoid) {
  require_motion(clip, humanoid, "to_pose_matrix");
  const int first = humanoid.first_motion_frame();
  const int frames = clip.frame_count() - first;
  PoseMatrix pose;
  pose.frame_rate_hz = clip.frame_rate_hz();
  pose.leg_length_m = humanoid.leg_length_m();
  pose.angles.resize(kAngleRowCount, frames);
  pose.height.resize(frames);
  Eigen::Matrix3Xd path(3, frames);
  for (int f = 0; f < frames; ++f) {
    const ModelPose model = forward_kinematics(clip, first + f);
    const StandardRotations R = standard_rotations(model, humanoid);
    const RootPlace root = root_place(model, R[0], humanoid);
    path.col(f) = root.planar;
    pose.height(f) = root.height;
    for (int s = 0; s < kStandardJointCount; ++s) {
      const int parent = kStandardParents[static_cast<std::size_t>(s)];
      const Quaterniond above =
          parent < 0 ? math::yaw_rotation(root.planar.z()) : R[static_cast<std::size_t>(parent)];
      const Vector3d r = math::log(above.conjugate() * R[static_cast<std::size_t>(s)]);
      pose.angles.block<3, 1>(3 * s, f) =
          f == 0 ? r : math::nearest_branch(r, pose.angles.block<3, 1>(3 * s, f - 1));
    }
  }
  pose.steps = planar_steps(path);
  return pose;
}

PlanarPose planar_start(const Clip& clip, const Humanoid& humanoid) {
  require_motion(clip, humanoid, "planar_start");
  const ModelPose model = forward_kinematics(clip, humanoid.first_motion_frame());
  const RootPlace root = root_place(model, standard_rotations(model, humanoid)[0], humanoid);
  return {root.planar.x(), root.planar.y(), root.planar.z()};
}

Clip from_pose_matrix(const PoseMatrix& pose, const Humanoid& humanoid, const Clip& source,
                      const RetargetOptions& options) {
  require_motion(source, humanoid, "from_pose_matrix");
  const std::vector<FramePosition> positions = source_positions(pose, humanoid, source, options);
  const Eigen::Matrix3Xd path =
      planar_path(pose, options.start ? *options.start : planar_start(source, humanoid));
  const std::vector<int> played = roles(humanoid);
  const bool needs_translations = source.has_translations() || hips_of(humanoid).joint != 0;
  const int frames = pose.frame_count();
  const int joints = source.joint_count();
  const auto cells = static_cast<std::size_t>(joints);
  RigFrame frame{std::vector<Quaterniond>(cells), std::vector<Quaterniond>(cells),
                 Eigen::Matrix3Xd(3, joints), Eigen::Matrix3Xd(3, joints)};
  Eigen::Matrix3Xd root(3, frames);
  Eigen::Matrix3Xd translations;
  if (needs_translations) translations.resize(3, static_cast<Eigen::Index>(frames) * joints);
  std::vector<Quaterniond> rotations;
  rotations.reserve(static_cast<std::size_t>(frames) * cells);
  for (int f = 0; f < frames; ++f) {
    const FramePosition& at = positions[static_cast<std::size_t>(f)];
    StandardRotations R = composed_rotations(pose, f, path(2, f));
    add_source_twist(R, humanoid, source, at);
    const HipsPlace hips = hips_place(path.col(f), pose.height(f), R[0], humanoid);
    solve_frame(R, hips, humanoid, source, at, played, frame);
    rotations.insert(rotations.end(), frame.local.begin(), frame.local.end());
    root.col(f) = frame.offsets.col(0);
    if (needs_translations) {
      translations.middleCols(static_cast<Eigen::Index>(f) * joints, joints) = frame.offsets;
    }
  }
  return {source.shared_skeleton(), pose.frame_rate_hz, std::move(root), std::move(rotations),
          std::move(translations)};
}

}  // namespace laban::motion
