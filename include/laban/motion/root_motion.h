#pragma once

#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {

/// The clip without its travel over the ground: the root point (Humanoid::root_point) stays above
/// the origin. Height and turns stay.
/// @throws Error{kUsage} if the humanoid was made for a skeleton of another size.
[[nodiscard]] Clip in_place(const Clip& clip, const Humanoid& humanoid);

/// Travel and turns of the clip on a joint of their own, as game engines read root motion: a new
/// joint "root" above all others lies on the ground below the root point and faces where the hips
/// face; the joint that was the root keeps the rest. Every other joint stays where it was in model
/// space.
/// @throws Error{kUsage} if the humanoid was made for a skeleton of another size.
[[nodiscard]] Clip with_root_joint(const Clip& clip, const Humanoid& humanoid);

}  // namespace laban::motion
