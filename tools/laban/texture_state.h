#pragma once

#include <string>
#include <string_view>

#include "files.h"
#include "texture_making.h"

namespace laban::cli {

/// What the studio's texture room was set to, and all that `laban texture synthesize --state` needs
/// to make the same clip again, byte for byte. As a file: one JSON object, schema
/// "laban.texture-room/1" (DESIGN 9).
struct TextureState {
  std::string texture;  ///< path
  TextureChoices choices;
};

[[nodiscard]] Json to_json(const TextureState& state);

/// @param name  of the file, for messages.
/// @throws Error{kFormat} "name: ..." naming the key: no JSON, another schema, a key that is
///         missing, unknown or of the wrong type, a value beyond the option's limits.
[[nodiscard]] TextureState parse_texture_state(std::string_view text, const std::string& name);
[[nodiscard]] TextureState read_texture_state(const Json& json, const std::string& name);

}  // namespace laban::cli
