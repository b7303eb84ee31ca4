#pragma once

#include <vector>

#include "laban/motion/standard_body.h"
#include "laban/texture/learn_texture.h"
#include "support/clips.h"

namespace laban::test {

/// A texture of two smooth random dances of the standard body, four seconds each.
inline texture::MotionTexture synthetic_texture() {
  std::vector<texture::TextureSource> sources;
  for (const unsigned seed : {1U, 2U}) {
    const motion::Clip clip = motion::to_standard_clip(
        random_pose_matrix({.frames = 240, .seed = seed, .amplitude_rad = 0.4}));
    sources.push_back({"dance " + std::to_string(seed), motion::find_capture(clip), 0});
  }
  texture::TextureLearning learning;
  learning.min_frames = 30;
  learning.textons = 6;
  learning.threads = 1;
  return texture::learn_texture(sources, learning).texture;
}

}  // namespace laban::test
