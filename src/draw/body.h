#pragma once

#include <optional>
#include <string>
#include <vector>

#include "laban/motion/clip.h"

namespace laban::draw {

enum class Side { kMiddle, kLeft, kRight };

/// Side of every joint: from its name ("LeftArm", "l_arm", "Arm.L", "lhumerus" where there is a
/// "rhumerus"), else its parent's; where no name tells a side, from x at rest (left is +x).
[[nodiscard]] std::vector<Side> joint_sides(const motion::Skeleton& skeleton);

/// A tapered bone between two nodes (see Body); radii in metres.
struct Bone {
  int from = 0;
  int to = 0;
  double radius_from = 0.0;
  double radius_to = 0.0;
};

/// Bones that are drawn together: the trunk, an arm, a leg.
struct Limb {
  Side side = Side::kMiddle;
  std::vector<Bone> bones;
};

/// A joint whose trail is drawn.
struct Tracer {
  int joint = 0;
  Side side = Side::kMiddle;
};

/// What is drawn of a skeleton. Its nodes are the J joints, then the end sites in joint order.
struct Body {
  int root = 0;                      ///< topmost joint drawn
  std::vector<int> end_site_joints;  ///< joint that each end site belongs to
  double size_m = 0.0;               ///< about the stature of a humanoid
  std::vector<Limb> limbs;           ///< the trunk first
  std::optional<int> head;           ///< joint named head
  int head_base = 0;                 ///< from this node ..
  int head_tip = 0;                  ///< .. to this one the head points up
  std::vector<Tracer> tracers;       ///< hands, feet and head; leaves of a nameless skeleton
  std::optional<int> left_hip;       ///< with right_hip: tells where the character faces
  std::optional<int> right_hip;

  [[nodiscard]] double head_radius() const { return 0.062 * size_m; }
};

/// The body that a clip moves. Joints above it that only carry it about (a root that stays where it
/// is while the hips travel) are no part of it.
[[nodiscard]] Body describe_body(const motion::Clip& clip);

/// Model-space positions of every node at `frame`, 3 x N, metres; what lies above the body's root
/// is put on it.
[[nodiscard]] Eigen::Matrix3Xd node_positions(const motion::Clip& clip, const Body& body,
                                              int frame);

}  // namespace laban::draw
