#pragma once

#include <vector>

#include "laban/base/progress.h"
#include "laban/motion/standard_joint.h"
#include "laban/texture/motion_texture.h"
#include "laban/texture/texture_motion.h"

namespace laban::cli {

/// Where a joint is to be in a frame, one that can be brought there (motion::can_reach).
struct JointPin {
  int frame = 0;  ///< of its texton
  motion::StandardJoint joint = motion::StandardJoint::kLeftHand;
  /// Metres, from the hips joint and in its axes: right wherever the path leads. Of the hips
  /// themselves, from where they would be.
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
};

/// A texton of a path, with what of it is pinned.
struct TextonBlock {
  texture::PlannedTexton planned;
  std::vector<JointPin> pins;
};

/// What is to be made of a texture: one texton after the other.
struct TextureChoices {
  std::vector<TextonBlock> path;
  texture::TextureMotionOptions options;
};

/// How far pins bend a texton (texture::EditedTexton).
struct PinnedTexton {
  int part = 0;
  double state_deviations = 0.0;
  double residual_deviations = 0.0;
};

struct MadeTexture {
  motion::Clip clip;
  std::vector<texture::TextonPart> parts;
  std::vector<PinnedTexton> pinned;
};

/// The path between given ends before it is pinned: pins change nothing of it.
/// @throws as texture::synthesize_path.
[[nodiscard]] texture::PathMotion draw_path(const texture::MotionTexture& texture,
                                            const TextureChoices& choices,
                                            const texture::PathEnds& ends = {},
                                            base::Progress* progress = nullptr);

/// What draw_path has drawn of the same choices and ends, pinned frames reached for by
/// motion::reach and the textons solved anew through them ([Li02, 5.2]), begun at `start`.
/// @throws Error{kUsage} for a pin beyond its texton or where two textons meet.
[[nodiscard]] MadeTexture play_path(const texture::MotionTexture& texture,
                                    const TextureChoices& choices, texture::PathMotion motion,
                                    const texture::PathEnds& ends = {},
                                    const motion::PlanarPose& start = {},
                                    base::Progress* progress = nullptr);

/// draw_path and play_path.
[[nodiscard]] MadeTexture make_texture(const texture::MotionTexture& texture,
                                       const TextureChoices& choices,
                                       const texture::PathEnds& ends = {},
                                       const motion::PlanarPose& start = {},
                                       base::Progress* progress = nullptr);

}  // namespace laban::cli
