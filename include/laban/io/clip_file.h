#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "laban/io/gltf.h"
#include "laban/motion/clip.h"
#include "laban/motion/up_axis.h"

namespace laban::io {

struct ReadOptions {
  /// Metres per unit of the file, > 0; nullopt: the file's own, else guessed.
  std::optional<double> unit_m = {};
  /// Overrides the file's frame rate, > 0, Hz.
  std::optional<double> frame_rate_hz = {};
  /// "bvh", "gltf" (both .gltf and .glb), "asf" or "amc"; nullopt: by content, else by the name's
  /// ending.
  std::optional<std::string> input_format = {};
  /// The file's axis that points up, where its format leaves it open (BVH); nullopt: found from how
  /// the body stands (motion::find_up_axis).
  std::optional<motion::UpAxis> up_axis = {};
  /// Of a file with several animations (glTF), the name of one, else its index; nullopt: the first.
  std::optional<std::string> animation = {};
  /// Where files that the file names, or that belong to it such as an AMC's skeleton, may be found;
  /// nullopt: nowhere. read_clip sets it to the file's own folder.
  std::optional<std::filesystem::path> folder = {};
  /// The .asf of an AMC; nullopt: the one in `folder` of the same stem, else of the longest stem
  /// that the AMC's begins with, else the only one there.
  std::optional<std::filesystem::path> skeleton = {};
};

struct ClipFile {
  motion::Clip clip;
  double unit_m = 0.01;       ///< metres per unit of the file, as used
  bool unit_guessed = false;  ///< true if neither file nor options told it
  /// Which axis of the file points up; the clip has been turned to +Y.
  motion::UpAxis up_axis = motion::UpAxis::kY;
  std::string format;                 ///< "bvh", "gltf", "asf" or "amc"
  std::vector<std::string> warnings;  ///< each "name:line:column: ..."
  /// True if neither file nor options told the rate: an AMC is taken to have 120 Hz.
  bool frame_rate_guessed = false;
  /// Names of all animations of a glTF file, and the index of the one that was read.
  std::vector<std::string> animations = {};
  std::size_t animation = 0;
  /// What a glTF file holds beside the clip, to be written back with another one (write_glb).
  std::shared_ptr<const GltfAsset> asset = {};
};

/// A clip from the bytes of a file of any format we read. An ASF gives one frame of its skeleton at
/// rest, with a warning.
///
/// @param name  of the file, for messages and, by its ending, for the format.
/// @throws Error{kUsage} if input_format is unknown or options have a wrong value; Error{kFormat}
///         if the format is not recognised, is one that is not read (FBX, C3D: the message names it
///         and the way out), or the file is malformed; Error{kIo} if the skeleton of an AMC is not
///         found or cannot be read.
[[nodiscard]] ClipFile parse_clip(std::string_view bytes, std::string_view name,
                                  const ReadOptions& options = {});

/// parse_clip of a file; the path is the name in messages.
/// @throws also Error{kIo} if the file cannot be read.
[[nodiscard]] ClipFile read_clip(const std::filesystem::path& path,
                                 const ReadOptions& options = {});

/// True if a path ends like a file of motion that is read: .bvh, .amc; any case.
[[nodiscard]] bool is_motion_file(const std::filesystem::path& path);

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
  /// Fewer and shorter keys, where the format can hold them (GLB).
  std::optional<GlbCompactOptions> compact = {};
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
