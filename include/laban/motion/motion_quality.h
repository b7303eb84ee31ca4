#pragma once

#include <optional>
#include <span>
#include <vector>

#include "laban/motion/clip.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {

/// Foot skate [ZhangEtAl18] (there of one foot height and H = 2.5 cm): mean over both toes and
/// all frames of horizontal speed * clamp(2 - 2^(h / 2.5 cm), 0, 1), h the height over the floor,
/// in cm per frame of 1/30 s, whatever the clip's rate. 0 for a single frame.
[[nodiscard]] double foot_skate_cm(const FootPaths& paths, double toe_floor_m);

/// Percentile (in [0, 100]) of the height of both toes over the floor, metres; negative below it.
[[nodiscard]] double toe_height_percentile_m(const FootPaths& paths, double toe_floor_m,
                                             double percent = 2.0);

/// Spectral arc length of a speed profile [Balasubramanian15]: minus the length of its normalised
/// magnitude spectrum, from 0 to the highest frequency (at most 10 Hz) at which that is 0.05 or
/// more; the spectrum is that of the samples padded with zeros to 16 times the next power of two.
/// About -1.4 for one smooth stroke, less the more halts and tremor; whatever the profile's size
/// and length. 0 for fewer than 2 samples or no movement.
[[nodiscard]] double spectral_arc_length(std::span<const double> speed, double rate_hz);

/// What can be told of one clip: the figures of DESIGN 7 that need no comparison.
struct MotionQuality {
  double foot_skate_cm = 0.0;  ///< cm per frame at 30 Hz
  double toe_height_m = 0.0;   ///< 2nd percentile over the floor
  double jerk_m_s3 = 0.0;      ///< rms over joints and frames, positions relative to the hips
  /// Mean spectral arc length of the speeds of hands and feet as seen from the hips.
  double spectral_arc_length = 0.0;
  /// For each frame the rms over the standard joints of the length of the acceleration, m/s^2; 0 at
  /// both ends.
  std::vector<double> acceleration_m_s2;
};

/// @param floor  where the toes stand: for a capture its own (find_foot_contacts), for an output
///               what its sources or its scene say, never what fits the output.
/// @throws Error{kUsage} if the humanoid was made for a skeleton of another size.
[[nodiscard]] MotionQuality measure_quality(const Clip& clip, const Humanoid& humanoid,
                                            const FootFloor& floor);

/// Largest acceleration within two frames of each join, as a percentile in [0, 100] of the same
/// statistic (the largest of five frames) everywhere in the references; the worst join counts.
/// nullopt if there is no join or no reference of five frames.
/// All clips must have one frame rate: accelerations of two rates do not compare.
/// @param joins  first frames of what follows a join.
[[nodiscard]] std::optional<double> join_acceleration_percentile(
    const MotionQuality& output, std::span<const int> joins,
    std::span<const MotionQuality> references);

}  // namespace laban::motion
