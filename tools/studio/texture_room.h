#pragma once

#include <optional>

#include "laban/texture/motion_texture.h"

#include "stage.h"
#include "texture_state.h"
#include "work.h"

namespace laban::studio {

/// Makes motion of a texture's textons: what each request asks for stands in a state
/// (cli::TextureState). The room keeps where endless play has come to, and the path drawn last.
class TextureRoom {
 public:
  /// @param path  of the texture. @throws as cli::read_texture_file.
  TextureRoom(const Stage& stage, std::string path, Work& work);

  [[nodiscard]] Routes routes();

  /// Textons, which follows which, and the state to begin with: how the first capture begins.
  [[nodiscard]] Json open() const;
  /// The cheapest path between two textons, or the cheapest of some length; null: there is none. A
  /// bridge from a texton to itself goes by others.
  [[nodiscard]] Json path(const Json& request) const;
  /// The motion, its parts, and how far its pins bend them. A draft leaves the quality figures out.
  [[nodiscard]] Response made(const Json& request);
  /// The motion as a file, byte for byte what `laban texture synthesize --state` writes.
  [[nodiscard]] Response exported(const Json& request, const std::string& format);
  /// A piece of an endless walk with the state's noise and seed, its pieces counted from 0.
  [[nodiscard]] Response walk(const Json& request);

 private:
  struct Walk {
    texture::TextureMotionOptions options;
    texture::TextureMotion motion;
    int given = 0;
  };
  /// What was drawn last: while pins alone are dragged it stays.
  struct Drawn {
    Json asked;  ///< a state without its pins
    texture::PathMotion motion;
  };
  [[nodiscard]] cli::MadeTexture make(const cli::TextureState& state);
  [[nodiscard]] cli::TextureState state_of(const Json& request) const;

  const Stage& stage_;
  Work& work_;
  std::string path_;
  texture::MotionTexture texture_;
  std::optional<Walk> walk_;
  std::optional<Drawn> drawn_;
};

}  // namespace laban::studio
