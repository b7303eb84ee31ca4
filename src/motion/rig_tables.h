#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

#include "laban/motion/standard_joint.h"

namespace laban::motion {

/// Where two axes of a joint point when the rig stands in the standard T-pose: for rigs whose rest
/// skeleton is no standing person.
struct AxisHint {
  StandardJoint joint;
  Eigen::Vector3d first_local, first_standard;
  Eigen::Vector3d second_local, second_standard;
};

/// A joint's local rotation in the T-pose that a rig's files begin with, for files that were cut.
struct TPoseRotation {
  std::string name;          ///< normalised
  Eigen::Vector3d rotation;  ///< exponential map, radians
};

/// What the skeleton does not say about a left limb in the rig's T-pose, model space (the right one
/// is its mirror image).
struct LimbHint {
  StandardJoint joint;
  /// Direction to be turned into the standard T-pose in place of the bone's; zero: the bone's.
  Eigen::Vector3d bone = Eigen::Vector3d::Zero();
  /// Axis of elbow or knee flexion; zero: not known.
  Eigen::Vector3d hinge = Eigen::Vector3d::Zero();
};

/// What is known of one family of rigs.
struct RigTable {
  std::string rig_name;
  /// Normalised names by standard joint, best first.
  std::array<std::vector<std::string>, kStandardJointCount> names;
  /// What the joints' names of this family have before the normalised one, lower case, such as
  /// "mixamorig"; empty: nothing in common.
  std::string prefix;
  /// Normalised names without which a skeleton is not of this family.
  std::vector<std::string> signature;
  /// Files begin with a T-pose frame.
  bool t_pose_frame = false;
  std::vector<TPoseRotation> t_pose;
  /// Joints taken as not turned from their parent in the T-pose frame: what it turns there is the
  /// figure's, not the body's.
  std::vector<StandardJoint> unbent;
  /// Empty: the rest skeleton stands upright. Else the first axis of an arm's or leg's joint lies
  /// along its bone; a skeleton whose bones lie otherwise is not of this family.
  std::vector<AxisHint> axes;
  std::vector<LimbHint> limbs;
};

/// All families, in order of preference.
[[nodiscard]] const std::vector<RigTable>& rig_tables();

/// A joint name without what rigs add to it: namespace or path ("mixamorig:", "Armature|"), known
/// prefixes ("Character1_", "Bip01 ", "J_Bip_", Rigify's "DEF-"), case and separators. What comes
/// after a name stays: "LeftHand_end", "HeadNub" or "upperarm_twist_01_l" are other joints.
[[nodiscard]] std::string normalised_joint_name(std::string_view name);

}  // namespace laban::motion
