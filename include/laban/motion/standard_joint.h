#pragma once

#include <array>
#include <string_view>

namespace laban::motion {

/// The 21 joints of the standard humanoid (DESIGN 2); parents come before children.
enum class StandardJoint {
  kHips,
  kSpine,
  kChest,
  kNeck,
  kHead,
  kLeftClavicle,
  kLeftUpperArm,
  kLeftForearm,
  kLeftHand,
  kRightClavicle,
  kRightUpperArm,
  kRightForearm,
  kRightHand,
  kLeftThigh,
  kLeftShin,
  kLeftFoot,
  kLeftToe,
  kRightThigh,
  kRightShin,
  kRightFoot,
  kRightToe,
};

inline constexpr int kStandardJointCount = 21;

/// Index of a standard joint: its place in the enumeration and in every pose matrix.
[[nodiscard]] constexpr int index_of(StandardJoint joint) {
  return static_cast<int>(joint);
}

/// Parent of each standard joint, -1 for the hips.
inline constexpr std::array<int, kStandardJointCount> kStandardParents = {
    -1, 0,  1,  2,  3,  // hips, spine, chest, neck, head
    2,  5,  6,  7,      // left arm, from the chest
    2,  9,  10, 11,     // right arm
    0,  13, 14, 15,     // left leg
    0,  17, 18, 19};    // right leg

/// Snake-case names, e.g. "left_upper_arm": used in reports, maps and drawings.
inline constexpr std::array<std::string_view, kStandardJointCount> kStandardJointNames = {
    "hips",       "spine",          "chest",           "neck",
    "head",       "left_clavicle",  "left_upper_arm",  "left_forearm",
    "left_hand",  "right_clavicle", "right_upper_arm", "right_forearm",
    "right_hand", "left_thigh",     "left_shin",       "left_foot",
    "left_toe",   "right_thigh",    "right_shin",      "right_foot",
    "right_toe"};

/// Clavicles and toes may be absent from a rig (their rotation is then the identity).
[[nodiscard]] constexpr bool is_optional(StandardJoint joint) {
  return joint == StandardJoint::kLeftClavicle || joint == StandardJoint::kRightClavicle ||
         joint == StandardJoint::kLeftToe || joint == StandardJoint::kRightToe;
}

}  // namespace laban::motion
