#include "laban/motion/root_motion.h"

#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"

#include "motion/require_fit.h"

namespace laban::motion {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Where a person is at one frame: the point on the ground below the root point, and the heading.
struct GroundPlace {
  Vector3d position;
  double yaw = 0.0;
};

GroundPlace ground_place(const Clip& clip, int frame, const Humanoid& humanoid) {
  const ModelPose pose = forward_kinematics(clip, frame);
  const MappedJoint& hips = *humanoid.mapped(StandardJoint::kHips);
  const Quaterniond& model_from_hips = pose.rotations[static_cast<std::size_t>(hips.joint)];
  Vector3d point = pose.positions.col(hips.joint) + model_from_hips * humanoid.root_point();
  point.y() = 0.0;
  return {point, math::heading_of(model_from_hips * hips.reference.conjugate())};
}

/// The skeleton below a new joint at the origin.
std::shared_ptr<const Skeleton> below_root_joint(const Skeleton& skeleton) {
  std::vector<Joint> joints = {Joint{"root", -1, Vector3d::Zero(), std::nullopt}};
  for (Joint joint : skeleton.joints()) {
    ++joint.parent;
    joints.push_back(std::move(joint));
  }
  return std::make_shared<const Skeleton>(std::move(joints));
}

}  // namespace

Clip in_place(const Clip& clip, const Humanoid& humanoid) {
  require_fit(clip, humanoid, "in_place");
  Eigen::Matrix3Xd root = clip.root_positions();
  std::vector<Quaterniond> rotations;
  Eigen::Matrix3Xd translations;
  if (clip.has_translations()) {
    translations.resize(3, static_cast<Eigen::Index>(clip.frame_count()) * clip.joint_count());
  }
  for (int f = 0; f < clip.frame_count(); ++f) {
    root.col(f) -= ground_place(clip, f, humanoid).position;
    const auto frame = clip.rotations(f);
    rotations.insert(rotations.end(), frame.begin(), frame.end());
    if (!clip.has_translations()) continue;
    const Eigen::Index first = static_cast<Eigen::Index>(f) * clip.joint_count();
    translations.col(first) = root.col(f);
    for (int j = 1; j < clip.joint_count(); ++j) {
      translations.col(first + j) = clip.translation(f, j);
    }
  }
  return {clip.shared_skeleton(), clip.frame_rate_hz(), std::move(root), std::move(rotations),
          std::move(translations)};
}

Clip with_root_joint(const Clip& clip, const Humanoid& humanoid) {
  require_fit(clip, humanoid, "with_root_joint");
  const int joints = clip.joint_count() + 1;
  Eigen::Matrix3Xd root(3, clip.frame_count());
  Eigen::Matrix3Xd translations(3, static_cast<Eigen::Index>(clip.frame_count()) * joints);
  std::vector<Quaterniond> rotations;
  for (int f = 0; f < clip.frame_count(); ++f) {
    const GroundPlace place = ground_place(clip, f, humanoid);
    const Quaterniond model_from_root = math::yaw_rotation(place.yaw);
    const auto frame = clip.rotations(f);
    rotations.push_back(model_from_root);
    rotations.push_back((model_from_root.conjugate() * frame.front()).normalized());
    rotations.insert(rotations.end(), frame.begin() + 1, frame.end());
    root.col(f) = place.position;
    const Eigen::Index first = static_cast<Eigen::Index>(f) * joints;
    translations.col(first) = place.position;
    translations.col(first + 1) =
        model_from_root.conjugate() * (clip.root_positions().col(f) - place.position);
    for (int j = 1; j < clip.joint_count(); ++j) {
      translations.col(first + 1 + j) = clip.translation(f, j);
    }
  }
  return {below_root_joint(clip.skeleton()), clip.frame_rate_hz(), std::move(root),
          std::move(rotations), std::move(translations)};
}

}  // namespace laban::motion
