#pragma once

#include <span>

#include "laban/motion/clip.h"
#include "laban/motion/pose_matrix.h"

namespace laban::motion {

/// A clip at another frame rate: rotations by slerp, positions linearly (METHODS 0).
///
/// Frame k of the result is the clip at k / frame_rate_hz; the last frame is the last such time not
/// after the clip's end (a time within 1e-6 of a source frame counts as that frame, which is then
/// copied exactly). The same rate gives the same clip. Cut a T-pose frame off first (find_capture).
///
/// @throws Error{kUsage} unless frame_rate_hz is positive and finite.
[[nodiscard]] Clip resample(const Clip& clip, double frame_rate_hz);

/// A pose matrix at another frame rate, by the one interpolator of the library
/// (math/cubic_interpolation.h) on angles, height and root path; frames as for a clip.
/// @throws Error{kUsage} unless frame_rate_hz is positive and finite.
[[nodiscard]] PoseMatrix resample(const PoseMatrix& pose, double frame_rate_hz);

/// A pose matrix read at fractional frames (clamped to its ends) and played at `frame_rate_hz`, by
/// the same interpolator: carries a motion through a time warp. Steps are those of the root path
/// from one of the frames to the next.
/// @throws Error{kUsage} if there is no frame, one is not a number or the rate is not positive and
///         finite.
[[nodiscard]] PoseMatrix sample(const PoseMatrix& pose, std::span<const double> frames,
                                double frame_rate_hz);

}  // namespace laban::motion
