#pragma once

#include <string>
#include <string_view>

#include "laban/texture/motion_texture.h"

namespace laban::texture {

/// The bytes of a `.texture` file (base/container.h, kind "laban.texture"). The same texture gives
/// the same bytes.
[[nodiscard]] std::string write_texture(const MotionTexture& texture);

/// Reads a `.texture` file back.
/// @param name  of the file, for messages.
/// @throws Error{kFormat} "name: ..." for a file that is damaged, of another kind, newer than this
///         laban, or whose parts do not fit together.
[[nodiscard]] MotionTexture read_texture(std::string_view bytes, std::string_view name);

}  // namespace laban::texture
