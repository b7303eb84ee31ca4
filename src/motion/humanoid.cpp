#include "laban/motion/humanoid.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "laban/base/error.h"

#include "motion/reference_pose.h"
#include "motion/rig_tables.h"

namespace laban::motion {
namespace {

using base::Error;
using base::ErrorKind;

StandardJoint standard_joint(std::size_t index) {
  return static_cast<StandardJoint>(index);
}

std::string name_of(std::size_t standard) {
  return std::string(kStandardJointNames[standard]);
}

/// Standard joints found by one table.
struct Match {
  const RigTable* table = nullptr;
  StandardJointIndices joints;
  int found = 0;
};

/// Joints that the user named. @throws Error{kUsage} naming one that the skeleton does not have.
StandardJointIndices joints_told(const Skeleton& skeleton, const HumanoidOptions& options) {
  StandardJointIndices joints;
  for (const auto& [which, name] : options.joint_names) {
    const auto index = static_cast<std::size_t>(index_of(which));
    joints[index] = skeleton.find(name);
    if (!joints[index]) {
      throw Error(ErrorKind::kUsage,
                  "humanoid: the skeleton has no joint '" + name + "' to play " + name_of(index));
    }
  }
  return joints;
}

/// First joint of each normalised name.
std::map<std::string, int> normalised_names(const Skeleton& skeleton) {
  std::map<std::string, int> names;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    names.emplace(normalised_joint_name(skeleton.joint(j).name), j);
  }
  return names;
}

bool has_prefix(const Skeleton& skeleton, const std::string& prefix) {
  if (prefix.empty()) return true;
  return std::any_of(skeleton.joints().begin(), skeleton.joints().end(), [&](const Joint& joint) {
    std::string name = joint.name;
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return name.find(prefix) != std::string::npos;
  });
}

/// False if a table tells where the bones of arms and legs lie and this skeleton's lie otherwise.
bool bones_lie_as_told(const RigTable& table, const Skeleton& skeleton,
                       const StandardJointIndices& joints) {
  // Rigs of such a family have them along the axis to a degree; others are anywhere.
  constexpr double kCosTolerance = 0.94;  // 20 degrees
  return std::all_of(table.axes.begin(), table.axes.end(), [&](const AxisHint& hint) {
    using enum StandardJoint;
    const bool limb = hint.joint == kLeftUpperArm || hint.joint == kRightUpperArm ||
                      hint.joint == kLeftForearm || hint.joint == kRightForearm ||
                      hint.joint == kLeftThigh || hint.joint == kRightThigh ||
                      hint.joint == kLeftShin || hint.joint == kRightShin;
    if (!limb) return true;
    const std::optional<int>& next = joints[static_cast<std::size_t>(index_of(hint.joint)) + 1];
    if (!next) return true;
    return skeleton.joint(*next).rest_offset.normalized().dot(hint.first_local) > kCosTolerance;
  });
}

Match match(const RigTable& table, const Skeleton& skeleton,
            const std::map<std::string, int>& names, const StandardJointIndices& told) {
  Match result;
  result.table = &table;
  result.joints = told;
  if (!has_prefix(skeleton, table.prefix)) return result;
  for (const std::string& needed : table.signature) {
    if (names.count(needed) == 0) return result;
  }
  std::set<int> used;
  for (const std::optional<int>& joint : told) {
    if (joint) used.insert(*joint);
  }
  for (std::size_t s = 0; s < result.joints.size(); ++s) {
    for (const std::string& name : table.names[s]) {
      if (result.joints[s]) break;
      const auto found = names.find(name);
      if (found != names.end() && used.insert(found->second).second) {
        result.joints[s] = found->second;
      }
    }
    result.found += result.joints[s].has_value() ? 1 : 0;
  }
  if (!bones_lie_as_told(table, skeleton, result.joints)) result.found = 0;
  return result;
}

Match best_match(const Skeleton& skeleton, const HumanoidOptions& options) {
  const StandardJointIndices told = joints_told(skeleton, options);
  const std::map<std::string, int> names = normalised_names(skeleton);
  Match best;
  best.found = -1;
  for (const RigTable& table : rig_tables()) {
    Match candidate = match(table, skeleton, names, told);
    if (candidate.found > best.found) best = candidate;
  }
  return best;
}

void require_all(const Match& match, const Skeleton& skeleton) {
  std::string missing;
  for (std::size_t s = 0; s < match.joints.size(); ++s) {
    if (match.joints[s] || is_optional(standard_joint(s))) continue;
    missing += (missing.empty() ? "" : ", ") + name_of(s);
  }
  if (missing.empty()) return;
  constexpr int kMostShown = 60;
  std::string seen;
  for (int j = 0; j < std::min(kMostShown, skeleton.joint_count()); ++j) {
    seen += (seen.empty() ? "'" : ", '") + skeleton.joint(j).name + "'";
  }
  if (skeleton.joint_count() > kMostShown) {
    seen += " and " + std::to_string(skeleton.joint_count() - kMostShown) + " more";
  }
  throw Error(ErrorKind::kData,
              "humanoid: no joint of the skeleton plays " + missing +
                  " (nearest name table: " + match.table->rig_name +
                  "); name the joints that do in a JSON file (--map); its joints are " + seen);
}

}  // namespace

Humanoid::Humanoid(std::string rig_name, const Skeleton& skeleton, Mapping joints,
                   double leg_length_m, const Eigen::Vector3d& root_point, int first_motion_frame)
    : rig_name_(std::move(rig_name)),
      joints_(std::move(joints)),
      leg_length_m_(leg_length_m),
      root_point_(root_point),
      rig_joint_count_(skeleton.joint_count()),
      first_motion_frame_(first_motion_frame) {
  std::set<int> used;
  for (std::size_t s = 0; s < joints_.size(); ++s) {
    const std::string place = "humanoid: " + name_of(s) + ": ";
    if (!joints_[s]) {
      if (is_optional(standard_joint(s))) continue;
      throw Error(ErrorKind::kData, place + "no joint plays it");
    }
    if (joints_[s]->joint < 0 || joints_[s]->joint >= rig_joint_count_) {
      throw Error(ErrorKind::kData, place + "joint " + std::to_string(joints_[s]->joint) +
                                        " is not in a skeleton of " +
                                        std::to_string(rig_joint_count_));
    }
    if (!used.insert(joints_[s]->joint).second) {
      throw Error(ErrorKind::kData, place + "'" + skeleton.joint(joints_[s]->joint).name +
                                        "' plays another standard joint already");
    }
    if (!(std::abs(joints_[s]->reference.squaredNorm() - 1.0) <= 1e-9)) {
      throw Error(ErrorKind::kData, place + "the reference is not a unit quaternion");
    }
  }
  if (!(leg_length_m_ > 0.0) || !std::isfinite(leg_length_m_)) {
    throw Error(ErrorKind::kData, "humanoid: the leg length must be positive and finite");
  }
  if (!root_point_.allFinite()) {
    throw Error(ErrorKind::kData, "humanoid: the root point must be finite");
  }
  if (first_motion_frame_ != 0 && first_motion_frame_ != 1) {
    throw Error(ErrorKind::kData, "humanoid: the first motion frame must be 0 or 1");
  }
}

std::optional<StandardJoint> Humanoid::played_by(int rig_joint) const {
  for (std::size_t s = 0; s < joints_.size(); ++s) {
    if (joints_[s] && joints_[s]->joint == rig_joint) return standard_joint(s);
  }
  return std::nullopt;
}

std::vector<StandardJoint> Humanoid::missing() const {
  std::vector<StandardJoint> absent;
  for (std::size_t s = 0; s < joints_.size(); ++s) {
    if (!joints_[s]) absent.push_back(standard_joint(s));
  }
  return absent;
}

Humanoid Humanoid::without_t_pose_frame() const {
  Humanoid cut = *this;
  cut.first_motion_frame_ = 0;
  return cut;
}

StandardJointIndices find_standard_joints(const Skeleton& skeleton,
                                          const HumanoidOptions& options) {
  return best_match(skeleton, options).joints;
}

Humanoid find_humanoid(const Clip& clip, const HumanoidOptions& options) {
  const Match found = best_match(clip.skeleton(), options);
  require_all(found, clip.skeleton());
  const bool t_pose_frame =
      options.t_pose_frame ? *options.t_pose_frame
                           : found.table->t_pose_frame && begins_with_t_pose(clip, found.joints);
  const ReferencePose reference = reference_pose(clip, found.joints, *found.table, t_pose_frame);
  return {found.table->rig_name,  clip.skeleton(),      reference.joints,
          reference.leg_length_m, reference.root_point, t_pose_frame ? 1 : 0};
}

Capture find_capture(const Clip& clip, const HumanoidOptions& options) {
  Humanoid humanoid = find_humanoid(clip, options);
  if (!humanoid.has_t_pose_frame()) return {clip, std::move(humanoid)};
  if (clip.frame_count() < 2) {
    throw Error(ErrorKind::kData, "humanoid: the clip holds a T-pose frame and no motion");
  }
  return {clip.slice(1, clip.frame_count()), humanoid.without_t_pose_frame()};
}

}  // namespace laban::motion
