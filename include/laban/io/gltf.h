#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "laban/io/glb.h"
#include "laban/motion/clip.h"

namespace laban::io {

struct GltfReadOptions {
  /// Metres per unit of the file, > 0; nullopt: metres, as the specification says.
  std::optional<double> unit_m = {};
  /// Frames a second at which the animation is sampled, > 0, Hz; nullopt: found (see read_gltf).
  std::optional<double> frame_rate_hz = {};
  /// Name of the animation, else its index; nullopt: the first, with a warning if there are more.
  std::optional<std::string> animation = {};
  /// Where files that the file names may be found; nullopt: nowhere.
  std::optional<std::filesystem::path> folder = {};

  /// Broken rules, each like "GltfReadOptions::unit_m = 0 (must be > 0)"; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// A glTF file as it was read: meshes, materials, skins, animations, extensions and extras, and how
/// the joints of its clip hang on its nodes. Immutable and opaque: it is there to be written back.
class GltfAsset;

struct GltfFile {
  motion::Clip clip;
  double unit_m = 1.0;                  ///< metres per unit of the file, as used
  std::vector<std::string> animations;  ///< names of all; "" where one has none
  std::size_t animation = 0;            ///< index of the one that was read
  std::shared_ptr<const GltfAsset> asset;
  /// What was left out or mended, each "name: JSON pointer: ..."; empty for a flawless file.
  std::vector<std::string> warnings;
};

/// Reads one animation of a glTF 2.0 file, .gltf or .glb (DESIGN 3).
///
/// Joints are the joints of all skins and what connects them to one tree; without a skin, every
/// animated node and what connects them. Of several trees the one with most joints is read. Joints
/// come in the order of the skin where that has parents first, else depth first.
///
/// Everything is taken to model space: transforms and scales of nodes above the root joint,
/// animated or not, are part of the motion. The rest pose is the skin's bind pose where its
/// matrices are rigid up to a uniform scale, else the nodes' own; rest rotations become the
/// identity, rest offsets lie along the axes of the model. The clip has translations only if a
/// joint other than the root is ever more than 1e-6 m from its rest offset; one that keeps to one
/// place within 1e-4 m of where it is bound rests there. A joint's rotation is the product of the
/// rotations above it: under scales that are not uniform its position is right, its mesh would be
/// sheared (a warning says so).
///
/// The frame rate is the animation's `extras.frame_rate_hz` (ours); else the one whose frames all
/// key times fall on: their spacing, snapped to a whole rate as for BVH, or, of keys that are
/// sparse or uneven, the first of 30, 24, 60, 25 and the other customary rates that fits; else 30
/// Hz. Values between keys are those of the samplers (LINEAR, STEP, CUBICSPLINE). Frame 0 is the
/// first key.
///
/// @param bytes  the whole file.
/// @param name   of the file, for messages.
/// @throws Error{kUsage} if `options` has problems or the animation is not there (all are listed);
///         Error{kData} if there is no animation, or nothing that moves; Error{kFormat} "name: JSON
///         pointer: what" for a malformed file: a wrong index, an accessor beyond its buffer, a
///         node that is its own ancestor, a number that is not finite, key times that fall, JSON
///         more than 64 deep, a uri that leads out of `folder`, more frames times joints than
///         max(2^20 + a quarter of the file's bytes); Error{kIo} if a companion file cannot be
///         read.
/// Time O(size + frames * joints), memory bounded by a multiple of the file's size whatever it
/// says.
[[nodiscard]] GltfFile read_gltf(std::string_view bytes, std::string_view name,
                                 const GltfReadOptions& options = {});

/// The file with a new animation, as a GLB: the same nodes, meshes, materials, textures, skins,
/// extensions and extras; the new animation comes first, those that were there follow.
///
/// Joints play the clip. All else that the animation moved, nodes that are no joints, scales and
/// morph targets, is played at the source's moment of each frame. Files that the original named are
/// inside the GLB; pictures that could not be read stay as they were named. `options.bone_mesh`
/// does nothing here.
///
/// @param clip           on the skeleton that read_gltf gave.
/// @param source_frames  for each frame of the clip the (fractional) frame of the clip that was
/// read
///                       which shows the same moment; empty: the same time.
/// @throws Error{kUsage} if the clip has another number of joints, or source_frames another length
///         or a value that is not finite; Error{kData} as the other write_glb.
[[nodiscard]] std::string write_glb(const GltfAsset& asset, const motion::Clip& clip,
                                    std::span<const double> source_frames = {},
                                    const GlbWriteOptions& options = {});

}  // namespace laban::io
