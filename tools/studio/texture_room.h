#pragma once

#include <optional>

#include "laban/texture/motion_texture.h"

#include "stage.h"
#include "texture_state.h"

namespace laban::studio {

/// Makes motion of a texture's textons: what each request asks for stands in a state
/// (cli::TextureState). Of endless play alone the room keeps where it has come to.
class TextureRoom {
 public:
  /// @param path  of the texture. @throws as cli::read_texture_file.
  TextureRoom(const Stage& stage, std::string path);

  [[nodiscard]] Routes routes();

  /// Textons, which follows which, and the state to begin with: how the first capture begins.
  [[nodiscard]] Json open() const;
  /// The cheapest path between two textons, or the cheapest of some length; null: there is none. A
  /// bridge from a texton to itself goes by others.
  [[nodiscard]] Json path(const Json& request) const;
  /// The motion, its parts, and how far its pins bend them.
  [[nodiscard]] Response made(const Json& request) const;
  /// The motion as a file, byte for byte what `laban texture synthesize --state` writes.
  [[nodiscard]] Response exported(const Json& request, const std::string& format) const;
  /// A piece of an endless walk with the state's noise and seed, its pieces counted from 0.
  [[nodiscard]] Response walk(const Json& request);

 private:
  struct Walk {
    texture::TextureMotionOptions options;
    texture::TextureMotion motion;
    int given = 0;
  };
  [[nodiscard]] cli::TextureState state_of(const Json& request) const;

  const Stage& stage_;
  std::string path_;
  texture::MotionTexture texture_;
  std::optional<Walk> walk_;
};

}  // namespace laban::studio
