#pragma once

#include <string>

#include "laban/motion/clip.h"

namespace laban::io {

struct GlbWriteOptions {
  /// Adds a small mesh of octahedral bones, skinned to the joints, so that the clip shows in any
  /// viewer.
  bool bone_mesh = true;
  /// Name of the animation.
  std::string animation_name = "motion";
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
/// @throws Error{kData} if the clip is too long for float32 times or a 4 GB file, or has more than
///         65 535 joints.
[[nodiscard]] std::string write_glb(const motion::Clip& clip, const GlbWriteOptions& options = {});

}  // namespace laban::io
