#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace laban::base {

struct WriteFileOptions {
  bool overwrite = false;  ///< false: an existing file is an error
};

/// Writes a file whole or not at all: aside, flushed to disk, then renamed over the target.
///
/// @throws Error{kIo} naming the path and the mend: it exists (and overwriting was not asked for),
///         its folder is missing or not writable, the disk is full. The target is then as it was.
void write_file(const std::filesystem::path& path, std::string_view bytes,
                const WriteFileOptions& options = {});

/// Throws what write_file would throw for a path that cannot be written: asked for before long
/// work, so that hours are not lost to a typing error.
void check_writable(const std::filesystem::path& path, const WriteFileOptions& options = {});

/// All bytes of a regular file. @throws Error{kIo} naming the path and the system's reason.
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

}  // namespace laban::base
