#include "laban/motion/standard_body.h"

#include "laban/math/rotation.h"

namespace laban::motion {
namespace {

// Offsets from the parent in the T-pose, metres, for a leg of 0.84 m: segment lengths of a 1.75 m
// adult, rounded. Left is +X.
Skeleton build_standard_skeleton() {
  const auto left = [](double x, double y, double z) { return Eigen::Vector3d(x, y, z); };
  const auto right = [](double x, double y, double z) { return Eigen::Vector3d(-x, y, z); };
  std::vector<Joint> joints(kStandardJointCount);
  const auto set = [&joints](StandardJoint which, const Eigen::Vector3d& offset) {
    const auto i = static_cast<std::size_t>(index_of(which));
    joints[i].name = std::string(kStandardJointNames[i]);
    joints[i].parent = kStandardParents[i];
    joints[i].rest_offset = offset;
  };
  const auto end = [&joints](StandardJoint which, const Eigen::Vector3d& offset) {
    joints[static_cast<std::size_t>(index_of(which))].end_site = offset;
  };
  using enum StandardJoint;
  set(kHips, left(0.0, 0.98, 0.0));
  set(kSpine, left(0.0, 0.10, 0.0));
  set(kChest, left(0.0, 0.14, 0.0));
  set(kNeck, left(0.0, 0.26, 0.0));
  set(kHead, left(0.0, 0.10, 0.0));
  end(kHead, left(0.0, 0.18, 0.0));
  const auto side = [&](StandardJoint clavicle, StandardJoint thigh, const auto& at) {
    const auto next = [](StandardJoint joint, int steps) {
      return static_cast<StandardJoint>(index_of(joint) + steps);
    };
    set(clavicle, at(0.03, 0.20, 0.0));
    set(next(clavicle, 1), at(0.15, 0.0, 0.0));
    set(next(clavicle, 2), at(0.28, 0.0, 0.0));
    set(next(clavicle, 3), at(0.26, 0.0, 0.0));
    end(next(clavicle, 3), at(0.18, 0.0, 0.0));
    set(thigh, at(0.09, -0.06, 0.0));
    set(next(thigh, 1), at(0.0, -0.42, 0.0));
    set(next(thigh, 2), at(0.0, -0.42, 0.0));
    set(next(thigh, 3), at(0.0, -0.06, 0.13));
    end(next(thigh, 3), at(0.0, -0.02, 0.07));
  };
  side(kLeftClavicle, kLeftThigh, left);
  side(kRightClavicle, kRightThigh, right);
  return Skeleton(std::move(joints));
}

}  // namespace

const std::shared_ptr<const Skeleton>& standard_skeleton() {
  static const auto skeleton = std::make_shared<const Skeleton>(build_standard_skeleton());
  return skeleton;
}

Clip to_standard_clip(const PoseMatrix& pose, const PlanarPose& start) {
  const Eigen::Matrix3Xd path = planar_path(pose, start);
  const int frames = pose.frame_count();
  Eigen::Matrix3Xd root(3, frames);
  std::vector<Eigen::Quaterniond> rotations;
  rotations.reserve(static_cast<std::size_t>(frames) * kStandardJointCount);
  for (int f = 0; f < frames; ++f) {
    root.col(f) << path(0, f), pose.height(f), path(1, f);
    for (int s = 0; s < kStandardJointCount; ++s) {
      const Eigen::Quaterniond q = math::exp(pose.angles.block<3, 1>(3 * s, f));
      rotations.push_back(s == 0 ? math::yaw_rotation(path(2, f)) * q : q);
    }
  }
  return {standard_skeleton(), pose.frame_rate_hz, root * kStandardLegLengthM,
          std::move(rotations)};
}

}  // namespace laban::motion
