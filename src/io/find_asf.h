#pragma once

#include <filesystem>

namespace laban::io {

/// The skeleton file of an AMC file, in the AMC's folder: of the same stem, else of the longest
/// stem that the AMC's begins with (135.asf for 135_07.amc, HDM_bd.asf for HDM_bd_walk_001.amc),
/// else the only .asf there is. Stems and endings are compared without regard to case.
///
/// @throws Error{kIo} if there is none, or several of which none fits; it says the way out
///         (--skeleton).
[[nodiscard]] std::filesystem::path find_asf(const std::filesystem::path& folder,
                                             const std::filesystem::path& amc);

}  // namespace laban::io
