#pragma once

#include "laban/motion/standard_body.h"
#include "laban/texture/motion_texture.h"
#include "support/clips.h"

namespace laban::test {

/// The standard body, which no foot's floor is known of.
inline texture::TextureRig standard_rig() {
  const motion::Capture capture = motion::find_capture(
      motion::to_standard_clip(random_pose_matrix({.frames = 2, .amplitude_rad = 0.1})));
  return {capture.clip.slice(0, 1), capture.humanoid, std::nullopt};
}

/// A texture without anything but its body.
inline texture::MotionTexture empty_texture() {
  return {{}, 60.0, 0.9, 3, {}, {}, {}, {}, {}, standard_rig(), "{}"};
}

}  // namespace laban::test
