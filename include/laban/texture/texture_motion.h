#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/progress.h"
#include "laban/motion/clip.h"
#include "laban/motion/pose_matrix.h"
#include "laban/texture/motion_texture.h"

namespace laban::texture {

struct TextureMotionOptions {
  std::uint64_t seed = 1;
  /// How much drives the textons, of what did in the captures; 0 gives the likeliest motion between
  /// the ends of each texton.
  double noise_level = 1.0;
  /// What share of that is drawn, 0 to 1. The rest is what drove one of the texton's segments: its
  /// own innovations, which are not white, and what of it the texton cannot show. 0 gives that
  /// segment's motion between new ends, 1 an exact draw from the texton ([Li02, eq. 10]), which at
  /// high frame rates trembles.
  double variation = 0.1;
  /// Texton to begin with; nullopt: where a take begins.
  std::optional<int> first;
  /// Whether feet are held where they stand (motion::lock_feet), if the texture knows a floor.
  bool hold_feet = true;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// One texton of a motion: frames [begin, end).
struct TextonPart {
  int texton = 0;
  std::int64_t begin = 0;
  std::int64_t end = 0;
  bool jump = false;  ///< nothing in the captures goes from here to the next texton
};

struct TextureClip {
  motion::Clip clip;
  std::vector<TextonPart> parts;  ///< those of which a frame is in the clip
};

/// An endless random walk over textons (METHODS 2.3, "ballroom"; TextonWalk says where it goes).
///
/// Each texton is drawn given the first two and the last two frames of a stretch of one of its
/// segments, whose innovations drive it ([Li02, 5.2] with ends of its own); what is drawn anew is
/// lowered where it would turn a joint by more than 4 degrees. Where the walk leaves the capture
/// for another place, the two textons meet halfway: rotations that come and go over up to 1.25
/// seconds on either side lead there, joint by joint the shorter way or, where that leads far from
/// all that was seen of a joint, the way round, so that poses and velocities are continuous. Feet
/// are held as far as that turns no joint by more than 7 degrees. So no joint gets far from what it
/// was seen to do, if the captures have poses that are near each other. Memory does not grow with
/// the frames that have passed.
class TextureMotion {
 public:
  /// @param texture  must outlive this.
  /// @throws Error{kUsage} if `options` has problems or there is no such texton.
  explicit TextureMotion(const MotionTexture& texture, const TextureMotionOptions& options = {});
  TextureMotion(TextureMotion&&) noexcept;
  TextureMotion& operator=(TextureMotion&&) noexcept;
  ~TextureMotion();

  /// The next frames; they do not depend on how many are asked for at a time. The root begins above
  /// the origin, facing +Z.
  /// @throws Error{kUsage} unless frame_count >= 1; "interrupted" if progress asks.
  [[nodiscard]] TextureClip next(int frame_count, base::Progress* progress = nullptr);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// A texton of a path that the user gives.
struct PlannedTexton {
  int texton = 0;
  std::optional<int> length;  ///< frames, >= 5; nullopt: of one of its segments
};

/// Where a path begins and ends: two neighbouring frames, d x 2 each; nullopt: as a segment of the
/// first (last) texton does.
struct PathEnds {
  std::optional<Eigen::MatrixXd> from;
  std::optional<Eigen::MatrixXd> to;
};

/// Observations of a path of textons, and which part is which. The given ends are hit exactly.
struct PathMotion {
  Eigen::MatrixXd observations;  ///< d x frames
  std::vector<TextonPart> parts;
};

/// Synthesises the textons of a path one after the other, joined as by TextureMotion.
/// @throws Error{kUsage} if `options` has problems, the path is empty, names what is no texton or a
///         length below 5, or an end is not d x 2; "interrupted" if progress asks.
[[nodiscard]] PathMotion synthesize_path(const MotionTexture& texture,
                                         std::span<const PlannedTexton> path,
                                         const PathEnds& ends = {},
                                         const TextureMotionOptions& options = {},
                                         base::Progress* progress = nullptr);

struct PlayOptions {
  /// Whether feet are held where they stand, if the texture knows a floor.
  bool hold_feet = true;
  /// Where the root begins: leg lengths of the texture's rig and radians.
  motion::PlanarPose start = {};
  /// Frames whose poses stay as they are: feet are not held there, and less and less in the 0.3
  /// seconds on either side.
  std::vector<int> kept_frames = {};
};

/// Observations as a clip on the texture's rig.
/// @throws Error{kUsage} if there is no frame or they have other rows than the texture's;
///         "interrupted" if progress asks.
[[nodiscard]] motion::Clip play_observations(const MotionTexture& texture,
                                             const Eigen::Ref<const Eigen::MatrixXd>& observations,
                                             const PlayOptions& options = {},
                                             base::Progress* progress = nullptr);

}  // namespace laban::texture
