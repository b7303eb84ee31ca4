#pragma once

#include <cstddef>

namespace laban::texture {

/// A number of something as a place in a vector.
[[nodiscard]] constexpr std::size_t at(std::ptrdiff_t index) noexcept {
  return static_cast<std::size_t>(index);
}

}  // namespace laban::texture
