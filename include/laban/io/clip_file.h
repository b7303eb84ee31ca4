#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "laban/motion/clip.h"
#include "laban/motion/up_axis.h"

namespace laban::io {

struct ReadOptions {
  /// Metres per unit of the file, > 0; nullopt: the file's own, else guessed.
  std::optional<double> unit_m = {};
  /// Overrides the file's frame rate, > 0, Hz.
  std::optional<double> frame_rate_hz = {};
  /// "bvh"; nullopt: by content, else by the name's ending.
  std::optional<std::string> input_format = {};
  /// The file's axis that points up, where its format leaves it open (BVH); nullopt: found from how
  /// the body stands (motion::find_up_axis).
  std::optional<motion::UpAxis> up_axis = {};
};

struct ClipFile {
  motion::Clip clip;
  double unit_m = 0.01;       ///< metres per unit of the file, as used
  bool unit_guessed = false;  ///< true if neither file nor options told it
  /// Which axis of the file points up; the clip has been turned to +Y.
  motion::UpAxis up_axis = motion::UpAxis::kY;
  std::string format;                 ///< "bvh"
  std::vector<std::string> warnings;  ///< each "name:line:column: ..."
};

/// A clip from the bytes of a file of any format we read.
///
/// @param name  of the file, for messages and, by its ending, for the format.
/// @throws Error{kUsage} if input_format is unknown; Error{kFormat} if the format is not
/// recognised,
///         is one that is not read (glTF, ASF/AMC, FBX, C3D: the message names it and the way out),
///         or the file is malformed.
[[nodiscard]] ClipFile parse_clip(std::string_view bytes, std::string_view name,
                                  const ReadOptions& options = {});

/// parse_clip of a file; the path is the name in messages.
/// @throws also Error{kIo} if the file cannot be read.
[[nodiscard]] ClipFile read_clip(const std::filesystem::path& path,
                                 const ReadOptions& options = {});

struct WriteOptions {
  /// Metres per unit, where the format leaves it open (BVH).
  double unit_m = 0.01;
  /// "bvh" or "glb"; nullopt: by the path's ending.
  std::optional<std::string> format = {};
  /// Overwrite an existing file.
  bool force = false;
  /// The axis to point up, where the format leaves it open (BVH).
  motion::UpAxis up_axis = motion::UpAxis::kY;
  /// Add a mesh of the bones, where the format can hold one (GLB).
  bool bone_mesh = true;
};

struct ClipBytes {
  std::string bytes;
  /// Joints whose names the format could not hold, each "'a:b' is written as 'a_b'".
  std::vector<std::string> renames;
};

/// The format that `options` ask for, or that the path's ending stands for: "bvh" or "glb".
/// @throws Error{kUsage} naming what is written, if it is neither.
[[nodiscard]] std::string output_format(const std::filesystem::path& path,
                                        const WriteOptions& options = {});

/// The bytes of a file of that format ("bvh" or "glb").
/// @throws Error{kUsage} if the format is unknown or an option has a wrong value.
[[nodiscard]] ClipBytes format_clip(const motion::Clip& clip, std::string_view format,
                                    const WriteOptions& options = {});

/// Writes a clip, whole or not at all; returns the renames. The file's stem becomes the name of a
/// GLB's animation.
/// @throws as output_format and format_clip; Error{kIo} if the file exists (unless `force`) or
///         cannot be written.
std::vector<std::string> write_clip(const std::filesystem::path& path, const motion::Clip& clip,
                                    const WriteOptions& options = {});

}  // namespace laban::io
