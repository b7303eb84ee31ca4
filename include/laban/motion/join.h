#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "laban/motion/pose_matrix.h"

namespace laban::motion {

struct JoinOptions {
  /// Half-life of the offset that a join leaves, seconds, > 0 (DESIGN 5).
  double halflife_s = 0.1;
  /// A larger half-life for offsets so large that their decay would bend the motion more than its
  /// parts do near the join (or, where those hardly move, than an ordinary movement does), up to
  /// this, seconds; nullopt: halflife_s always. With it, a join of parts that do not fit may bend
  /// half as much as they do, not 1.25 times.
  std::optional<double> longest_halflife_s;
  /// Within half a second of a join, jerk is held to this share of the largest that the parts
  /// beside it have anywhere, by a local low-pass (calm_locally), > 0; nullopt: left as it is.
  std::optional<double> most_jerk_share;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Plays pose matrices one after the other without a jump, by inertialisation (DESIGN 5, Joins).
///
/// All frames of all parts are kept: a part's first frame is the successor of the last frame before
/// it. Root position and heading continue, since parts hold steps. The step between two parts,
/// which neither knows, is the mean of the steps on either side of it.
///
/// At a join the second difference of each joint's exponential map and of the height, and the first
/// difference of the steps, may be as large as the parts' own near the join (within 2.5 half-lives,
/// times 1.25); only the excess is taken up, half by an offset on the part before and half by one
/// on the new part (of rotations, of height, of steps), which die away from the join as critically
/// damped springs. So pose and velocity are continuous as far as they are in the parts, neither
/// part is bent as far as one alone would be, and a clip cut in two comes back as it was (its step
/// over the cut as above). Offsets reach over further joins if parts are short.
///
/// Each joint continues on the branch of its exponential map that it had at the end of the part
/// before. leg_length_m is the first part's; height and steps are in leg lengths and stay.
///
/// @param parts  at least one. One part alone is returned as it is.
/// @throws Error{kUsage} if there is no part or `options` has problems; Error{kData} if frame rates
///         differ, a part has no frame or its members disagree in size.
[[nodiscard]] PoseMatrix concatenate(std::span<const PoseMatrix> parts,
                                     const JoinOptions& options = {});

}  // namespace laban::motion
