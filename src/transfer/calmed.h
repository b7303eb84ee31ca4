#pragma once

#include <span>

#include "laban/transfer/play_choice.h"

namespace laban::transfer {

[[nodiscard]] Jerk jerk_of(const motion::PoseMatrix& pose);
/// Of the fragments that are blended: the mean of what is usual, the largest at any moment.
[[nodiscard]] Jerk jerk_of(PlayMemory& memory, std::span<const PlayedPart> parts);

/// A motion without the jerks that quick play and extrapolation make of its sources' trembling.
/// Where a time warp changes pace a blend may jerk for a moment: there it is held to what its
/// sources do at most.
[[nodiscard]] motion::PoseMatrix calmed(const motion::PoseMatrix& pose, const Jerk& sources);

}  // namespace laban::transfer
