#include "laban/io/clip_file.h"

#include <algorithm>
#include <array>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"
#include "laban/io/bvh.h"
#include "laban/io/glb.h"

#include "io/text_scanner.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;

/// A format we can name: how its files end and begin.
struct KnownFormat {
  std::string_view name;
  std::string_view title;
  std::array<std::string_view, 2> endings;
  std::array<std::string_view, 2> openings;
};

// Openings are compared without regard to case, after a byte-order mark and space.
constexpr std::array<KnownFormat, 6> kFormats = {{
    {"bvh", "BVH", {".bvh"}, {"HIERARCHY"}},
    {"glb", "glTF", {".glb", ".gltf"}, {"glTF"}},
    {"asf", "an ASF skeleton", {".asf"}, {":version"}},
    {"amc", "AMC motion", {".amc"}, {"#!OML:ASF", ":FULLY-SPECIFIED"}},
    {"fbx", "FBX", {".fbx"}, {"Kaydara FBX", "; FBX"}},
    {"c3d", "C3D markers", {".c3d"}, {}},
}};

std::string_view opening_text(std::string_view bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  return bytes.substr(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
}

bool opens_as(std::string_view text, std::string_view opening) {
  return !opening.empty() && equal_but_for_case(text.substr(0, opening.size()), opening);
}

const KnownFormat* find_by_content(std::string_view bytes) {
  const std::string_view text = opening_text(bytes);
  for (const KnownFormat& format : kFormats) {
    for (const std::string_view opening : format.openings) {
      if (opens_as(text, opening)) return &format;
    }
  }
  return nullptr;
}

const KnownFormat* find_by_ending(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  for (const KnownFormat& format : kFormats) {
    for (const std::string_view known : format.endings) {
      if (!known.empty() && equal_but_for_case(ending, known)) return &format;
    }
  }
  return nullptr;
}

std::string input_format(std::string_view bytes, std::string_view name,
                         const ReadOptions& options) {
  if (options.input_format) {
    if (*options.input_format == "bvh") return *options.input_format;
    throw Error(ErrorKind::kUsage, "input format '" + *options.input_format +
                                       "' is not known or not read yet (known: bvh)");
  }
  const KnownFormat* format = find_by_content(bytes);
  if (format == nullptr) format = find_by_ending(std::filesystem::path(name));
  if (format == nullptr) {
    throw Error(ErrorKind::kFormat, std::string(name) +
                                        ": not a motion file that is known; BVH is read, and it "
                                        "begins with HIERARCHY");
  }
  if (format->name != "bvh") {
    throw Error(ErrorKind::kFormat, std::string(name) + ": " + std::string(format->title) +
                                        " is not read yet; convert it to BVH");
  }
  return std::string(format->name);
}

/// The clip with +Y up, whichever axis the file has up.
ClipFile turned_upright(ClipFile file, const ReadOptions& options) {
  file.up_axis = options.up_axis ? *options.up_axis : motion::find_up_axis(file.clip);
  if (file.up_axis != motion::UpAxis::kY) {
    file.clip = motion::turned(file.clip, motion::y_up_from(file.up_axis));
  }
  return file;
}

motion::Clip from_y_up(const motion::Clip& clip, motion::UpAxis up) {
  return up == motion::UpAxis::kY ? clip : motion::turned(clip, motion::y_up_from(up).conjugate());
}

ClipBytes format_named(const motion::Clip& clip, std::string_view format,
                       const std::string& animation_name, const WriteOptions& options) {
  if (format == "bvh") {
    BvhText bvh = write_bvh(from_y_up(clip, options.up_axis), {.unit_m = options.unit_m});
    return {std::move(bvh.text), std::move(bvh.renames)};
  }
  if (format == "glb") {
    return {write_glb(clip, {.bone_mesh = options.bone_mesh, .animation_name = animation_name}),
            {}};
  }
  throw Error(ErrorKind::kUsage,
              "output format '" + std::string(format) + "' is not written (bvh and glb are)");
}

}  // namespace

ClipFile parse_clip(std::string_view bytes, std::string_view name, const ReadOptions& options) {
  const std::string format = input_format(bytes, name, options);
  BvhFile bvh =
      read_bvh(bytes, name, {.unit_m = options.unit_m, .frame_rate_hz = options.frame_rate_hz});
  return turned_upright({.clip = std::move(bvh.clip),
                         .unit_m = bvh.unit_m,
                         .unit_guessed = bvh.unit_guessed,
                         .format = format,
                         .warnings = std::move(bvh.warnings)},
                        options);
}

ClipFile read_clip(const std::filesystem::path& path, const ReadOptions& options) {
  return parse_clip(base::read_file(path), path.string(), options);
}

std::string output_format(const std::filesystem::path& path, const WriteOptions& options) {
  std::string format = options.format.value_or("");
  if (!options.format) {
    const std::string ending = path.extension().string();
    if (equal_but_for_case(ending, ".bvh")) format = "bvh";
    if (equal_but_for_case(ending, ".glb")) format = "glb";
  }
  if (format == "bvh" || format == "glb") return format;
  throw Error(ErrorKind::kUsage,
              path.string() +
                  ": clips are written as .bvh or .glb; end the name so or give the "
                  "format (--format)");
}

ClipBytes format_clip(const motion::Clip& clip, std::string_view format,
                      const WriteOptions& options) {
  return format_named(clip, format, GlbWriteOptions{}.animation_name, options);
}

std::vector<std::string> write_clip(const std::filesystem::path& path, const motion::Clip& clip,
                                    const WriteOptions& options) {
  ClipBytes file = format_named(clip, output_format(path, options), path.stem().string(), options);
  base::write_file(path, file.bytes, {.overwrite = options.force});
  return std::move(file.renames);
}

}  // namespace laban::io
