#pragma once

#include <string>
#include <string_view>

#include "laban/manifold/pose_manifold.h"

namespace laban::manifold {

/// The bytes of a `.manifold` file (base/container.h, kind "laban.manifold"). The same manifold
/// gives the same bytes.
[[nodiscard]] std::string write_manifold(const PoseManifold& manifold);

/// Reads a `.manifold` file back.
/// @param name  of the file, for messages.
/// @throws Error{kFormat} "name: ..." for a file that is damaged, of another kind, newer than this
///         laban, or whose parts do not fit together.
[[nodiscard]] PoseManifold read_manifold(std::string_view bytes, std::string_view name);

}  // namespace laban::manifold
