#pragma once

#include <optional>
#include <string>
#include <vector>

#include "laban/motion/foot_lock.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/motion_quality.h"
#include "laban/transfer/apply_style.h"

namespace laban::transfer {

struct StyledClipOptions {
  /// Feet stand still where they touch the ground (motion::lock_feet).
  bool hold_feet = true;
};

/// A styled motion on the input's rig, at the input's rate.
struct StyledClip {
  motion::Clip clip;
  /// For each frame the (fractional) frame of the input's clip that shows the same moment.
  std::vector<double> source_frames;
  std::vector<int> joins;  ///< first frames of what follows a join
  /// Where the feet are to stand. Held, on the floor that the input stands on (in its scene, which
  /// no fragment knows), if it ever does; else where those of the sources do
  /// (StyledSources::floor).
  std::optional<motion::FootFloor> floor;
  int foot_stances = 0;          ///< held; 0 without hold_feet
  int foot_steps = 0;            ///< taken at joins
  double farthest_foot_m = 0.0;  ///< that a foot was moved
};

/// Plays a styled motion on the input's rig: retargeting, then the feet.
/// @param input  the capture whose pose matrix (at the model's rate) was given to apply_style.
/// @throws as motion::from_pose_matrix and motion::lock_feet.
[[nodiscard]] StyledClip play_style(const StyleModel& model, const AppliedStyle& applied,
                                    const motion::Capture& input,
                                    const StyledClipOptions& options = {});

/// What a styled motion is made of, as the input's rig plays it: what the output is compared with.
struct StyledSources {
  /// The fragments, each once, and what was kept as captured.
  std::vector<motion::Clip> clips;
  /// How much of the output is made of each: its frames' share, divided equally among what is
  /// blended there; they sum to 1.
  std::vector<double> shares;
  /// Where their feet stand: the mean of their own floors; nullopt if none ever touches the ground.
  std::optional<motion::FootFloor> floor;
};
[[nodiscard]] StyledSources play_sources(const StyleModel& model, const AppliedStyle& applied,
                                         const motion::Capture& input);

/// How good a styled clip is beside its sources (DESIGN 7). Means over the sources count each by
/// its share of the output.
struct StyledQuality {
  motion::MotionQuality output;
  double source_skate_cm = 0.0;             ///< mean over the sources, each over its own floor
  double source_toe_height_m = 0.0;         ///< mean of their 2nd percentiles
  double source_jerk_m_s3 = 0.0;            ///< root of their mean square: of them in a row
  double source_spectral_arc_length = 0.0;  ///< mean over the sources
  /// Percentile of the worst join's acceleration inside the sources; nullopt without a join.
  std::optional<double> join_percentile;
};

[[nodiscard]] StyledQuality measure_styled(const StyledClip& styled, const StyledSources& sources,
                                           const motion::Humanoid& humanoid);

/// Content kept (DESIGN 7): mean DTW cost of each snippet's output to its input, each relative to
/// its own mean pose, under the model's metric, divided by the median cost inside its content
/// group; snippets count by their frames. nullopt if all are kept as captured.
/// @param input  the pose matrix that was given to apply_style.
[[nodiscard]] std::optional<double> content_ratio(const StyleModel& model,
                                                  const AppliedStyle& applied,
                                                  const motion::PoseMatrix& input);

/// The same of one motion beside another of that content: mean DTW cost, each relative to its own
/// mean pose, over the median cost inside the content group. nullopt if the model has no such
/// content, or a single fragment of it.
[[nodiscard]] std::optional<double> content_ratio(const StyleModel& model,
                                                  const motion::PoseMatrix& pose,
                                                  const motion::PoseMatrix& other,
                                                  const std::string& content);

}  // namespace laban::transfer
