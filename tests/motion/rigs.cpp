#include "rigs.h"

#include <cmath>

#include "laban/base/rng.h"
#include "laban/math/rotation.h"

namespace laban::test {

using motion::Clip;
using motion::Joint;
using motion::Skeleton;

Skeleton mixamo_skeleton() {
  std::vector<Joint> joints;
  const auto add = [&joints](const std::string& name, const std::string& parent, double x, double y,
                             double z) {
    int index = -1;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      if (joints[i].name == "mixamorig:" + parent) index = static_cast<int>(i);
    }
    joints.push_back({"mixamorig:" + name, index, {x, y, z}, std::nullopt});
  };
  add("Hips", "", 0.0, 0.99, 0.01);
  add("Spine", "Hips", 0.0, 0.099, -0.012);
  add("Spine1", "Spine", 0.0, 0.117, 0.0);
  add("Spine2", "Spine1", 0.0, 0.134, 0.0);
  add("Neck", "Spine2", 0.0, 0.150, 0.0);
  add("Head", "Neck", 0.0, 0.096, 0.031);
  for (const double side : {1.0, -1.0}) {
    const std::string of = side > 0.0 ? "Left" : "Right";
    add(of + "Shoulder", "Spine2", side * 0.061, 0.091, 0.007);
    add(of + "Arm", of + "Shoulder", side * 0.127, -0.001, -0.024);
    add(of + "ForeArm", of + "Arm", side * 0.274, 0.0, 0.0);
    add(of + "Hand", of + "ForeArm", side * 0.276, 0.0, 0.0);
    add(of + "HandIndex1", of + "Hand", side * 0.123, -0.002, 0.028);
    add(of + "UpLeg", "Hips", side * 0.091, -0.067, 0.0);
    add(of + "Leg", of + "UpLeg", 0.0, -0.443, 0.003);
    add(of + "Foot", of + "Leg", 0.0, -0.445, -0.030);
    add(of + "ToeBase", of + "Foot", side * 0.01, -0.098, 0.120);
  }
  return Skeleton(std::move(joints));
}

Clip at_rest(const Skeleton& skeleton) {
  const auto joints = static_cast<std::size_t>(skeleton.joint_count());
  return {std::make_shared<const Skeleton>(skeleton), 30.0, skeleton.joint(0).rest_offset,
          std::vector<Eigen::Quaterniond>(joints, Eigen::Quaterniond::Identity())};
}

Clip random_motion(const Skeleton& skeleton, int frames, unsigned seed) {
  base::Rng rng(seed);
  std::vector<Eigen::Vector3d> phases;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    phases.emplace_back(rng.uniform(0, 6), rng.uniform(0, 6), rng.uniform(0, 6));
  }
  Eigen::Matrix3Xd root(3, frames);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < frames; ++f) {
    const double t = f / 60.0;
    root.col(f) << 0.3 * t, 0.95 + 0.03 * std::sin(7.0 * t), 1.1 * t;
    for (int j = 0; j < skeleton.joint_count(); ++j) {
      const Eigen::Array3d phase = phases[static_cast<std::size_t>(j)].array();
      const Eigen::Quaterniond local = math::exp((0.7 * (2.0 * t + phase).sin()).matrix());
      rotations.push_back(j == 0 ? math::yaw_rotation(5.0 * t) * local : local);
    }
  }
  return {std::make_shared<const Skeleton>(skeleton), 60.0, std::move(root), std::move(rotations)};
}

}  // namespace laban::test
