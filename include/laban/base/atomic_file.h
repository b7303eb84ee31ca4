#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace laban::base {

struct WriteFileOptions {
  bool overwrite = false;  ///< false: an existing file is an error
};

/// Writes a file whole or not at all: aside in its folder, flushed to disk, then renamed over the
/// target, so that the target at any time is the old file or the new one, whatever happens. The
/// file aside is named like the target with ".part-" and six characters behind; it is left only if
/// the process is killed without a chance to call remove_unfinished_files().
///
/// A link is followed: the file it leads to is replaced, the link stays. A file that is replaced
/// keeps its permissions. What is not a file but takes bytes, such as /dev/stdout or a named pipe,
/// is written to directly.
///
/// @throws Error{kIo} naming the path and the mend: it exists (and overwriting was not asked for),
///         its folder is missing or not writable, the disk is full. The target is then as it was.
void write_file(const std::filesystem::path& path, std::string_view bytes,
                const WriteFileOptions& options = {});

/// Removes the files that write_file is writing aside at this moment. For a signal handler that
/// ends the process: it only calls what is safe there.
void remove_unfinished_files() noexcept;

/// Throws what write_file would throw for a path that cannot be written: asked for before long
/// work, so that hours are not lost to a typing error.
void check_writable(const std::filesystem::path& path, const WriteFileOptions& options = {});

/// All bytes of a regular file. @throws Error{kIo} naming the path and the system's reason.
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

}  // namespace laban::base
