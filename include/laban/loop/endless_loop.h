#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "laban/base/progress.h"
#include "laban/loop/graph_cut_seam.h"
#include "laban/loop/turning_points.h"
#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"

namespace laban::loop {

/// How one motion is sewn to another (METHODS 3.2, 3.3).
struct SeamOptions {
  /// The seam is looked for in so many frames at the outgoing clip's end and at the incoming one's
  /// beginning (m of [Graphcut]), >= 8; half the clip where that is shorter.
  int texton_frames = 100;
  /// And in so many seconds, >= 0, where that is more and the clip has them: at 120 Hz a hundred
  /// frames are less than one step of a walk.
  double texton_s = 2.0;
  /// Frames in which both are played, of which the cut chooses for each joint where it switches
  /// (n_overlap of [Graphcut]), 4 .. texton_frames; half of that where it was shortened.
  int overlap_frames = 50;
  SeamMetric metric = SeamMetric::kDifference;
  /// Frames of the blend along the seam (k of [Graphcut, eq. 11-13]), >= 1, at most the overlap;
  /// half of them where that is better for feet and poses.
  /// Its weight is of the fifth degree (ours): the acceleration of the paper's cubic leaps at both
  /// ends.
  int blend_frames = 25;
  /// Rebuild the overlap from blended gradients [Graphcut, eq. 14] instead of the blend alone.
  bool poisson = true;
  /// An edge between joints of the Poisson grid, in edges of time, >= 0.
  double joint_weight = 0.01;
  /// How fast the correction fades away from a seam (PoissonGrid), >= 0; 0 is the paper's equation,
  /// which moves the whole overlap.
  double screening = 0.1;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct LoopOptions {
  SeamOptions seam;
  TurningPointOptions turning;
  bool turns = true;  ///< play backwards from turning points
  bool leaps = true;  ///< sew the end to the beginning
  /// Most seams that are kept to choose from, >= 1.
  int seam_count = 3;
  /// By how much the probability of a turn changes, in [0, 2].
  double probability_step = 0.25;
  /// Feet stand still where they touch the ground, at the heights they were captured at.
  bool hold_feet = true;
  bool in_place = false;  ///< take the travel over the ground out
  std::uint64_t seed = 1;

  [[nodiscard]] std::vector<std::string> problems() const;
};

/// One seam as it was found.
struct FoundSeam {
  int out_begin = 0;  ///< first frame of the overlap in the outgoing clip
  int in_begin = 0;   ///< and in the incoming one
  int frames = 0;     ///< of the overlap
  /// Frames it is played in: more than `frames` where it would be quicker than the captures are.
  int played_frames = 0;
  /// Mean distance of the two over the overlap, metres a joint: angles times the reach of the
  /// joint, height, velocity over the ground.
  double distance_m = 0.0;
  /// First frame of the overlap, for each joint of the rig, that comes from the incoming clip.
  std::vector<int> switch_frames;
  /// Greatest rms speed and acceleration of the body in the overlap and beside it, in 99th
  /// percentiles of the captures' own.
  double speed_ratio = 0.0;
  double acceleration_ratio = 0.0;
};

enum class LoopStep { kForwards, kBackwards, kSeam };

/// A stretch of output frames.
struct LoopPart {
  LoopStep step = LoopStep::kForwards;
  std::int64_t begin = 0;  ///< first output frame
  std::int64_t end = 0;    ///< one past the last
  int seam = -1;           ///< index among the seams, of a kSeam
};

struct LoopedClip {
  motion::Clip clip;
  std::vector<double> source_frames;  ///< of the capture, that each frame shows
  std::vector<LoopPart> parts;        ///< that overlap the frames, in output frames from the start
  int foot_stances = 0;               ///< held
};

/// Endless motion from one short clip [Graphcut]: forth and back between turning points, from the
/// end to the beginning through graph-cut seams, until nobody asks for more.
///
/// Frames come out in order, in pieces of any size: the same frames whatever the pieces, from
/// memory that does not grow. Travel continues: playing backwards walks back on the same path, a
/// seam goes on from where the body stands and to where it faces. Up to three first frames that
/// leap into the motion (a pose that files of some rigs begin with) are left out.
class EndlessLoop {
 public:
  /// @throws Error{kUsage} if `options` has problems; Error{kData} if the clip has fewer than 8
  ///         frames.
  EndlessLoop(const motion::Capture& capture, const LoopOptions& options);
  EndlessLoop(EndlessLoop&&) noexcept;
  EndlessLoop& operator=(EndlessLoop&&) noexcept;
  ~EndlessLoop();

  /// The next frames.
  /// @throws Error{kUsage} unless frame_count >= 1; "interrupted" if progress asks.
  [[nodiscard]] LoopedClip next(int frame_count, base::Progress* progress = nullptr);

  [[nodiscard]] const Turning& turning() const noexcept;
  [[nodiscard]] const std::vector<FoundSeam>& seams() const noexcept;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// One perfect loop.
struct SeamlessLoop {
  motion::Clip clip;
  std::vector<double> source_frames;
  FoundSeam seam;
  int seam_begin = 0;  ///< the overlap is frames [seam_begin, seam_end) of the clip
  int seam_end = 0;
  /// By how much one round moves the body: metres over the ground and radians; zero where the loop
  /// ends where it begins.
  double travel_m = 0.0;
  double turn_rad = 0.0;
  bool closed = false;  ///< it ends where it begins
  /// What one round does to every point of the body: a turn about +Y, radians, then a shift over
  /// the ground, metres; nothing if it is closed. The frame after the last is the first, moved so.
  double round_yaw_rad = 0.0;
  Eigen::Vector3d round_shift_m = Eigen::Vector3d::Zero();
  int foot_stances = 0;
};

/// A clip whose last frame flows into its first: from one seam to its other end.
///
/// A body that travels (more than 0.15 leg lengths a second, net) is left to travel: played again,
/// the loop goes on from where it ended. One that does not, or all with in_place, ends where it
/// begins; what it has drifted and turned (to the nearest whole turn) is spread evenly.
/// @throws as EndlessLoop.
[[nodiscard]] SeamlessLoop seamless_loop(const motion::Capture& capture,
                                         const LoopOptions& options = {});

struct JoinedClips {
  motion::Clip clip;  ///< on the first clip's rig, at its rate
  FoundSeam seam;
  int seam_begin = 0;  ///< the overlap is frames [seam_begin, seam_end) of the clip
  int seam_end = 0;
  int foot_stances = 0;
};

/// Sews the end of one clip to the beginning of another: the same seam between two different clips.
/// The second is brought to the first one's rate and, where skeletons differ, to its rig, and
/// lifted or lowered so that it stands on the floor of the first.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if a clip has fewer than 8 frames.
[[nodiscard]] JoinedClips join_clips(const motion::Capture& first, const motion::Capture& second,
                                     const LoopOptions& options = {});

}  // namespace laban::loop
