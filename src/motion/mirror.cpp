#include "laban/motion/mirror.h"

#include <array>
#include <cctype>
#include <map>
#include <string>
#include <string_view>

#include "laban/base/error.h"
#include "laban/motion/forward_kinematics.h"

namespace laban::motion {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Mirror images at x = 0 of a vector and of a rotation, M q M.
Vector3d mirror_image(const Vector3d& v) {
  return {-v.x(), v.y(), v.z()};
}
Quaterniond mirror_image(const Quaterniond& q) {
  return {q.w(), q.x(), -q.y(), -q.z()};
}

StandardJoint counterpart(StandardJoint joint) {
  using enum StandardJoint;
  const int i = index_of(joint);
  const bool left = (i >= index_of(kLeftClavicle) && i <= index_of(kLeftHand)) ||
                    (i >= index_of(kLeftThigh) && i <= index_of(kLeftToe));
  const bool right = (i >= index_of(kRightClavicle) && i <= index_of(kRightHand)) ||
                     (i >= index_of(kRightThigh) && i <= index_of(kRightToe));
  return static_cast<StandardJoint>(left ? i + 4 : right ? i - 4 : i);
}

bool is_lower(char c) {
  return std::islower(static_cast<unsigned char>(c)) != 0;
}
bool is_alpha(char c) {
  return std::isalpha(static_cast<unsigned char>(c)) != 0;
}

/// True if the letter at `at` stands for a side by itself: "L_Thumb", "thumb.L", "lThumb".
bool stands_alone(std::string_view name, std::size_t at) {
  const bool opens = at == 0 || !is_alpha(name[at - 1]);
  const bool closes = at + 1 == name.size() || !is_lower(name[at + 1]);
  return opens && closes;
}

/// Names that would say the other side of what `name` says.
std::vector<std::string> names_of_other_side(const std::string& name) {
  static constexpr std::array<std::array<std::string_view, 2>, 5> kSides = {
      {{"Left", "Right"}, {"left", "right"}, {"LEFT", "RIGHT"}, {"L", "R"}, {"l", "r"}}};
  std::vector<std::string> others;
  for (const auto& pair : kSides) {
    for (std::size_t side = 0; side < 2; ++side) {
      const std::string_view here = pair[side];
      for (std::size_t at = name.find(here); at != std::string::npos;
           at = name.find(here, at + 1)) {
        if (here.size() == 1 && !stands_alone(name, at)) continue;
        std::string other = name;
        others.push_back(other.replace(at, here.size(), pair[1 - side]));
      }
    }
  }
  return others;
}

/// For each joint the one on the other side.
std::vector<int> counterparts(const Skeleton& skeleton, const Humanoid& humanoid) {
  std::map<std::string_view, int> by_name;
  for (int j = 0; j < skeleton.joint_count(); ++j) by_name.emplace(skeleton.joint(j).name, j);
  std::vector<int> others(static_cast<std::size_t>(skeleton.joint_count()));
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    int& other = others[static_cast<std::size_t>(j)];
    other = j;
    if (const auto role = humanoid.played_by(j)) {
      const auto& mapped = humanoid.mapped(counterpart(*role));
      if (mapped) other = mapped->joint;
      continue;
    }
    for (const std::string& name : names_of_other_side(skeleton.joint(j).name)) {
      const auto found = by_name.find(name);
      if (found == by_name.end() || humanoid.played_by(found->second)) continue;
      other = found->second;
      break;
    }
  }
  return others;
}

/// Model-space rotations of all joints in the reference pose; joints that play no part turn with
/// their parents.
std::vector<Quaterniond> reference_rotations(const Skeleton& skeleton, const Humanoid& humanoid) {
  std::vector<Quaterniond> rotations;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const int parent = skeleton.joint(j).parent;
    const auto role = humanoid.played_by(j);
    rotations.push_back(role         ? humanoid.mapped(*role)->reference
                        : parent < 0 ? Quaterniond::Identity()
                                     : rotations[static_cast<std::size_t>(parent)]);
  }
  return rotations;
}

Vector3d rest_offset(const Clip& clip, int frame, int joint) {
  const Joint& it = clip.skeleton().joint(joint);
  return it.parent < 0 ? Vector3d(clip.translation(frame, joint)) : it.rest_offset;
}

}  // namespace

Clip mirrored(const Clip& clip, const Humanoid& humanoid) {
  if (clip.joint_count() != humanoid.rig_joint_count()) {
    throw base::Error(base::ErrorKind::kUsage, "mirrored: the clip has " +
                                                   std::to_string(clip.joint_count()) +
                                                   " joints, the humanoid was made for " +
                                                   std::to_string(humanoid.rig_joint_count()));
  }
  const Skeleton& skeleton = clip.skeleton();
  const int joints = clip.joint_count();
  const std::vector<int> others = counterparts(skeleton, humanoid);
  const std::vector<Quaterniond> reference = reference_rotations(skeleton, humanoid);
  const auto cells =
      static_cast<std::size_t>(clip.frame_count()) * static_cast<std::size_t>(joints);
  std::vector<Quaterniond> rotations;
  rotations.reserve(cells);
  Eigen::Matrix3Xd root(3, clip.frame_count());
  Eigen::Matrix3Xd translations;
  if (clip.has_translations()) translations.resize(3, static_cast<Eigen::Index>(cells));
  std::vector<Quaterniond> model(static_cast<std::size_t>(joints));
  for (int f = 0; f < clip.frame_count(); ++f) {
    const ModelPose pose = forward_kinematics(clip, f);
    root.col(f) = mirror_image(Vector3d(clip.root_positions().col(f)));
    for (int j = 0; j < joints; ++j) {
      const auto cell = static_cast<std::size_t>(j);
      const auto other = static_cast<std::size_t>(others[cell]);
      const int parent = skeleton.joint(j).parent;
      const Quaterniond parent_from_model =
          parent < 0 ? Quaterniond::Identity()
                     : model[static_cast<std::size_t>(parent)].conjugate();
      model[cell] =
          (mirror_image(pose.rotations[other] * reference[other].conjugate()) * reference[cell])
              .normalized();
      rotations.push_back((parent_from_model * model[cell]).normalized());
      if (!clip.has_translations()) continue;
      const Eigen::Index column = static_cast<Eigen::Index>(f) * joints + j;
      if (parent < 0) {
        translations.col(column) = root.col(f);
        continue;
      }
      // What the other side's joint moves away from its rest, seen in the mirror.
      const auto other_parent = static_cast<std::size_t>(skeleton.joint(others[cell]).parent);
      const Vector3d moved = pose.rotations[other_parent] * (clip.translation(f, others[cell]) -
                                                             rest_offset(clip, f, others[cell]));
      translations.col(column) =
          skeleton.joint(j).rest_offset + parent_from_model * mirror_image(moved);
    }
  }
  return {clip.shared_skeleton(), clip.frame_rate_hz(), std::move(root), std::move(rotations),
          std::move(translations)};
}

}  // namespace laban::motion
