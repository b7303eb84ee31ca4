#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/motion/clip.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {

/// Lengths are those of a body of kStandardLegLengthM; they scale with the leg.
struct FootLockOptions {
  /// Where heels and toes are to stand; nullopt: at their median heights in contact.
  std::optional<FootFloor> floor;
  /// First frames of what follows a join, ascending. Between joins the body is raised or lowered as
  /// a whole until its feet stand on the floor (level_parts); a foot that is on the ground on both
  /// sides of a join steps if it would have to slide too far.
  std::vector<int> joins;
  /// False where all parts are of one capture, whose floor is theirs.
  bool level_parts = true;
  /// Of a motion that is one capture's, sewn to itself or bent: the steps of the left and the right
  /// foot, each from the frame before, that were not captured; 3 x F each, metres. The ground is
  /// then what it was in the capture, level or not: feet stand still at the heights they have, the
  /// body is not raised, and only swings that such steps lengthen are lifted clear of the floor.
  /// nullopt: feet stand on the floor.
  std::optional<std::array<Eigen::Matrix3Xd, 2>> added_steps;
  /// A foot is brought to where it stands, and let go, over this time, seconds.
  double ease_s = 0.25;
  /// Sliding over a join farther than this takes a step.
  double longest_slide_m = 0.05;
  /// A held foot is moved no farther than this; what drifts more slides the rest of the way.
  double farthest_m = 0.12;
  /// The pelvis is lowered at most so far for a foot out of reach.
  double deepest_m = 0.06;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct LockedFeet {
  Clip clip;
  int stances = 0;          ///< of both feet
  int steps = 0;            ///< taken at joins
  double farthest_m = 0.0;  ///< that a foot was moved
  double deepest_m = 0.0;   ///< that the pelvis was lowered for feet out of reach
};

/// Holds feet where they touch the ground, by two-bone IK on the rig of the clip (DESIGN 5, Feet).
///
/// - While the toe is in contact the toe stands still on the floor, else the heel does; from one to
///   the other the foot rolls over. A stance keeps its mean place. Before and after it the
///   correction is eased in and out by cubics that continue position and velocity, over all of a
///   swing shorter than two `ease_s`.
/// - The foot keeps its orientation in model space. The knee bends about its own axis, the normal
///   of the leg's plane (of the thigh's side where the leg is straight), and the thigh turns by the
///   shortest rotation.
/// - A leg is never stretched beyond what it is in the clip or a knee bent by 4 degrees, whichever
///   is longer: first the pelvis is lowered, smoothly, then the foot slides.
/// - Toes are kept from sinking into the floor, off contact too; a foot that swings to another
/// place
///   clears the floor by a tenth of its way, at most 3 cm, where it would drag.
/// - A contact in which the point moves at 1 m/s or more is none: a blend may not make the contacts
///   of its parents.
///
/// Without any contact the clip comes back as it is, bit for bit.
///
/// @param contacts  a column a frame of the clip.
/// @throws Error{kUsage} if `options` has problems or the humanoid was made for a skeleton of
///         another size; Error{kData} if contacts and clip differ in frames or rate.
[[nodiscard]] LockedFeet lock_feet(const Clip& clip, const Humanoid& humanoid,
                                   const FootContacts& contacts,
                                   const FootLockOptions& options = {});

}  // namespace laban::motion
