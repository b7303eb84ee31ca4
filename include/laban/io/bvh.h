#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "laban/motion/clip.h"

namespace laban::io {

/// Most joints, and deepest nesting, that a BVH file may have. Far above any rig; they bound what
/// a damaged or hostile file can ask for.
inline constexpr int kMaxBvhJoints = 100'000;
inline constexpr int kMaxBvhDepth = 10'000;

struct BvhReadOptions {
  /// Metres per unit of the file, > 0; nullopt: guessed (see read_bvh).
  std::optional<double> unit_m = {};
  /// Overrides the file's Frame Time, > 0, Hz.
  std::optional<double> frame_rate_hz = {};

  /// Broken rules, each like "BvhReadOptions::unit_m = 0 (must be > 0)"; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct BvhFile {
  motion::Clip clip;
  double unit_m = 0.01;       ///< metres per unit of the file, as used
  bool unit_guessed = false;  ///< true if no unit was given
  /// What was mended or ignored, each "name:line:column: ..."; empty for a flawless file.
  std::vector<std::string> warnings;
};

/// Reads a Biovision hierarchy with its motion (DESIGN 3).
///
/// Rotations are composed in the order of a joint's channels, q = q_first * q_second * q_third.
/// Position channels replace the joint's OFFSET, axis by axis; a joint below the root with all
/// three of them and OFFSET 0 0 0 has its first position for a rest offset. Scale channels are read
/// and ignored with a warning. The clip has translations only if a joint other than the root is
/// ever more than 1e-6 m from its OFFSET; joints that are not then stay exactly on it.
///
/// Accepted: channels in any order, any subset; tabs, CRLF, a byte-order mark, blank lines; names
/// with spaces and colons; `End Site` in any case, named or absent; rows wrapped over lines, if the
/// first row is; several roots (the first is used, with a warning); Frames other than the number of
/// rows (the rows win, with a warning).
///
/// The frame rate is 1 / Frame Time, which most files round. It is snapped to the nearest whole
/// rate if that lies within one unit of the last decimal of Frame Time and within 0.01 %, or 0.5 %
/// if it is a customary one (24, 25, 30, 50, 60, 72, 90, 100, 120, 144, 200, 240 Hz): 0.0333333 is
/// 30 Hz and .0083 is 120 Hz, but 0.0333667 stays 29.97 Hz.
///
/// BVH does not say its unit. Unless given it is guessed: the reach, that is the longest sum of
/// offset lengths from the first branching joint down to a leaf (hips to fingertips), is about 1.12
/// m for an adult; the unit among metre, centimetre, millimetre, inch and 0.05644 m (CMU's ASF
/// unit) that brings it nearest to that, by ratio, is taken.
///
/// @param text  the whole file.
/// @param name  of the file, for messages.
/// @throws Error{kUsage} if `options` has problems. Error{kFormat} "name:line:column: ..." with the
///         mend: NaN or infinity, a number beyond 1e30, Frame Time <= 0 (unless overridden),
///         decimal commas, a row of the wrong length, unbalanced braces, more than kMaxBvhJoints
///         or kMaxBvhDepth, Frames above 2^31 - 1, joints without channels that would take more
///         than 12 times the file and 32 MB.
/// Time O(size): 300 MB/s; memory: the clip's own, at most 16 times the file and 64 MB whatever it
/// says.
[[nodiscard]] BvhFile read_bvh(std::string_view text, std::string_view name,
                               const BvhReadOptions& options = {});

struct BvhWriteOptions {
  /// Metres per unit of the file, > 0; default: centimetres.
  double unit_m = 0.01;
  /// Order of a joint's rotation channels: a permutation of "XYZ".
  std::string rotation_order = "ZXY";
  /// Digits after the point, 0 to 15, for angles (degrees) and positions (units) alike. nullopt: 6
  /// for angles and as many for positions as resolve 1e-8 m, so that BVH -> Clip -> BVH -> Clip
  /// keeps rotations within 1e-5 degrees and joint positions within 1e-6 m.
  std::optional<int> decimals = {};

  /// Broken rules, as BvhReadOptions::problems.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct BvhText {
  std::string text;
  /// Joints whose names had to change, each "'mixamorig:Hips' is written as 'mixamorig_Hips'".
  std::vector<std::string> renames;
};

/// Writes the form of BVH that Blender, three.js and assimp all agree on: root OFFSET 0 0 0;
/// positions on the root only, unless another joint leaves its rest offset by more than 1e-7 m (it
/// then has six channels too); unique names of [A-Za-z0-9_]; an End Site below every leaf (0 0 0
/// where the clip has none); one row a frame.
///
/// A joint with position channels has OFFSET 0 0 0, since three.js adds the two where others put
/// the one in the place of the other; read_bvh takes its first position for its rest offset.
///
/// What is not kept: the order of joints (they come depth first); the root's rest offset, which a
/// clip's root positions replace; the rest offset of other joints with position channels.
///
/// Euler angles are continuous in time (they may pass 180 degrees), through gimbal lock too.
///
/// @throws Error{kUsage} if `options` has problems.
[[nodiscard]] BvhText write_bvh(const motion::Clip& clip, const BvhWriteOptions& options = {});

/// Writes a motion that comes in pieces, whatever its length, as write_bvh writes it whole: Euler
/// angles continue from piece to piece. Only of a motion that animates positions below the root
/// does every joint have position channels, since nobody knows which will move.
class BvhStream {
 public:
  /// @param clip  of the skeleton and at the rate of all pieces, and with translations if any piece
  ///              has them.
  /// @throws Error{kUsage} if `options` has problems.
  explicit BvhStream(const motion::Clip& clip, const BvhWriteOptions& options = {});
  BvhStream(BvhStream&&) noexcept;
  BvhStream& operator=(BvhStream&&) noexcept;
  ~BvhStream();

  /// Hierarchy and the lines before the rows. Readers take more or fewer rows than `frame_count`
  /// says with a warning at best.
  [[nodiscard]] std::string head(std::int64_t frame_count);
  /// The rows of the next piece. @throws Error{kData} for another skeleton's or rate's.
  [[nodiscard]] std::string rows(const motion::Clip& piece);
  /// As BvhText::renames.
  [[nodiscard]] std::vector<std::string> renames() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace laban::io
