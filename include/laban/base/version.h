#pragma once

#include <string_view>

namespace laban::base {

/// Version of the library, "major.minor.patch".
[[nodiscard]] std::string_view version() noexcept;

}  // namespace laban::base
