#pragma once

#include <filesystem>
#include <optional>

#include "laban/motion/clip.h"

namespace laban::test {

inline constexpr const char* kNoCaptures =
    "LABAN_DATA is not set: this test needs the folder of real captures it would name";

/// The folder of real captures, if the environment names one.
[[nodiscard]] std::optional<std::filesystem::path> captures_root();

/// A BVH or AMC capture; only its first frames if `max_frames` > 0, which spares parsing the rest
/// of a BVH.
[[nodiscard]] motion::Clip load_capture(const std::filesystem::path& path, int max_frames = 0);

}  // namespace laban::test
