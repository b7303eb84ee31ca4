#pragma once

#include <optional>
#include <string>
#include <vector>

#include "laban/math/constants.h"
#include "laban/motion/clip.h"

namespace laban::io {

/// How far a compact animation may be from the clip.
struct GlbCompactOptions {
  /// Greatest angle between a joint's local rotation, decoded and interpolated, and the clip's at
  /// any frame; > 0, radians. Default: 0.1 degrees.
  double rotation_tolerance_rad = 0.1 * math::kDegree;
  /// Greatest distance of the same kind, of positions within the parent, > 0, metres.
  double translation_tolerance_m = 5e-4;

  /// Broken rules, each like "GlbCompactOptions::.. = 0 (must be > 0)"; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct GlbWriteOptions {
  /// Adds a small mesh of octahedral bones, skinned to the joints, so that the clip shows in any
  /// viewer.
  bool bone_mesh = true;
  /// Name of the animation.
  std::string animation_name = "motion";
  /// Fewer and shorter keys: rotations as normalised int16 (float32 where that is too coarse for
  /// the tolerance), and only the keys between which LINEAR stays within tolerance.
  std::optional<GlbCompactOptions> compact = {};
};

/// A clip as binary glTF 2.0: a node a joint, a skin with inverse bind matrices, one animation with
/// LINEAR samplers for every joint's rotation and the root's translation (and other joints', where
/// the clip animates them), float32, seconds and metres.
///
/// The bind pose is the skeleton's rest pose. End sites are kept in their node's
/// `extras.end_site`, the frame rate in the animation's `extras.frame_rate_hz`. Bones run from a
/// joint to each child and to its end site, but not to a child that travels more than 5 cm within
/// its parent (a root above the hips is not a bone). The Khronos validator finds no errors and no
/// warnings.
///
/// @throws Error{kUsage} if `options.compact` has problems; Error{kData} if the clip is too long
/// for float32 times or a 4 GB file, or has more than
///         65 535 joints.
[[nodiscard]] std::string write_glb(const motion::Clip& clip, const GlbWriteOptions& options = {});

}  // namespace laban::io
