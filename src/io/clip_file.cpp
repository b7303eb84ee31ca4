#include "laban/io/clip_file.h"

#include <algorithm>
#include <array>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"
#include "laban/io/asf_amc.h"
#include "laban/io/bvh.h"
#include "laban/io/glb.h"

#include "io/find_asf.h"
#include "io/text_scanner.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;

/// A format we can name: how its files end and begin, and, of one that is not read, why and the way
/// out.
struct KnownFormat {
  std::string_view name;
  std::array<std::string_view, 2> endings;
  std::array<std::string_view, 2> openings;
  std::string_view refusal = {};
};

// Openings are compared without regard to case, after a byte-order mark and space.
constexpr std::array<KnownFormat, 6> kFormats = {{
    {"bvh", {".bvh"}, {"HIERARCHY"}},
    {"gltf", {".glb", ".gltf"}, {"glTF"}},
    {"asf", {".asf"}, {":version"}},
    {"amc", {".amc"}, {"#!OML:ASF", ":FULLY-SPECIFIED"}},
    {"fbx",
     {".fbx"},
     {"Kaydara FBX", "; FBX"},
     "FBX is not read; import it into Blender (File, Import, FBX) and export glTF or BVH"},
    {"c3d",
     {".c3d"},
     {},
     "C3D holds markers and no skeleton; solve them onto one in the capture system's own program "
     "or "
     "in MotionBuilder and export BVH"},
}};

std::string_view opening_text(std::string_view bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  const auto skip_space = [&] {
    bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
  };
  skip_space();
  // Comments of ASF and AMC files; "#!OML:ASF" is an opening.
  while (bytes.starts_with('#') && !bytes.starts_with("#!")) {
    bytes.remove_prefix(std::min(bytes.find_first_of("\r\n"), bytes.size()));
    skip_space();
  }
  return bytes;
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

bool is_read(const KnownFormat& format) {
  return format.refusal.empty();
}

std::string input_format(std::string_view bytes, std::string_view name,
                         const ReadOptions& options) {
  if (options.input_format) {
    for (const KnownFormat& known : kFormats) {
      if (is_read(known) && known.name == *options.input_format) return *options.input_format;
    }
    throw Error(ErrorKind::kUsage, "input format '" + *options.input_format +
                                       "' is not known or not read (bvh, gltf, asf and amc are)");
  }
  const KnownFormat* format = find_by_content(bytes);
  if (format == nullptr) format = find_by_ending(std::filesystem::path(name));
  if (format == nullptr) {
    throw Error(ErrorKind::kFormat, std::string(name) +
                                        ": not a motion file that is known; BVH, which begins "
                                        "with HIERARCHY, glTF (.gltf, .glb) and ASF/AMC are read");
  }
  if (!is_read(*format)) {
    throw Error(ErrorKind::kFormat, std::string(name) + ": " + std::string(format->refusal));
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

ClipFile parse_bvh(std::string_view bytes, std::string_view name, const ReadOptions& options) {
  BvhFile bvh =
      read_bvh(bytes, name, {.unit_m = options.unit_m, .frame_rate_hz = options.frame_rate_hz});
  return turned_upright({.clip = std::move(bvh.clip),
                         .unit_m = bvh.unit_m,
                         .unit_guessed = bvh.unit_guessed,
                         .format = "bvh",
                         .warnings = std::move(bvh.warnings)},
                        options);
}

ClipFile parse_gltf(std::string_view bytes, std::string_view name, const ReadOptions& options) {
  GltfFile gltf = read_gltf(bytes, name,
                            {.unit_m = options.unit_m,
                             .frame_rate_hz = options.frame_rate_hz,
                             .animation = options.animation,
                             .folder = options.folder});
  return {.clip = std::move(gltf.clip),
          .unit_m = gltf.unit_m,
          .format = "gltf",
          .warnings = std::move(gltf.warnings),
          .animations = std::move(gltf.animations),
          .animation = gltf.animation,
          .asset = std::move(gltf.asset)};
}

ClipFile parse_asf(std::string_view bytes, std::string_view name, const ReadOptions& options) {
  AsfFile asf = read_asf(bytes, name, {.unit_m = options.unit_m});
  asf.warnings.push_back(std::string(name) +
                         ":1:1: a skeleton without motion; it is read as one frame at rest (its "
                         "motion is in .amc files)");
  return {.clip = rest_clip(asf),
          .unit_m = asf.unit_m,
          .unit_guessed = asf.unit_guessed,
          .format = "asf",
          .warnings = std::move(asf.warnings),
          .frame_rate_guessed = true};
}

ClipFile parse_amc(std::string_view bytes, std::string_view name, const ReadOptions& options) {
  if (!options.skeleton && !options.folder) {
    throw Error(ErrorKind::kUsage, std::string(name) +
                                       ": AMC motion needs its skeleton; name it "
                                       "(--skeleton FILE.asf)");
  }
  const std::filesystem::path path =
      options.skeleton ? *options.skeleton : find_asf(*options.folder, std::filesystem::path(name));
  AsfFile asf = read_asf(base::read_file(path), path.string(), {.unit_m = options.unit_m});
  AmcFile amc = read_amc(bytes, name, asf, {.frame_rate_hz = options.frame_rate_hz});
  std::vector<std::string> warnings = std::move(asf.warnings);
  warnings.insert(warnings.end(), amc.warnings.begin(), amc.warnings.end());
  return {.clip = std::move(amc.clip),
          .unit_m = asf.unit_m,
          .unit_guessed = asf.unit_guessed,
          .format = "amc",
          .warnings = std::move(warnings),
          .frame_rate_guessed = amc.frame_rate_guessed};
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
    return {write_glb(clip, {.bone_mesh = options.bone_mesh,
                             .animation_name = animation_name,
                             .compact = options.compact}),
            {}};
  }
  throw Error(ErrorKind::kUsage,
              "output format '" + std::string(format) + "' is not written (bvh and glb are)");
}

}  // namespace

ClipFile parse_clip(std::string_view bytes, std::string_view name, const ReadOptions& options) {
  const std::string format = input_format(bytes, name, options);
  if (options.animation && format != "gltf") {
    throw Error(ErrorKind::kUsage,
                std::string(name) + ": only glTF files have animations to choose from");
  }
  if (format == "gltf") return parse_gltf(bytes, name, options);
  if (format == "asf") return parse_asf(bytes, name, options);
  if (format == "amc") return parse_amc(bytes, name, options);
  return parse_bvh(bytes, name, options);
}

ClipFile read_clip(const std::filesystem::path& path, const ReadOptions& options) {
  ReadOptions reading = options;
  if (!reading.folder) reading.folder = path.parent_path();
  return parse_clip(base::read_file(path), path.string(), reading);
}

bool is_motion_file(const std::filesystem::path& path) {
  const KnownFormat* format = find_by_ending(path);
  return format != nullptr && is_read(*format) && format->name != "asf";
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
