#pragma once

#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {

/// The clip as seen in a mirror at x = 0: what the left hand did the right one does, and a path to
/// the left goes right. The skeleton stays as it is, so that the motion plays on the same body and,
/// where that is not symmetric, keeps its bone lengths.
///
/// With M = diag(-1, 1, 1), every joint j of which the counterpart is c(j) gets the model-space
/// rotation M R_c(j) M G_j(ref), where R = G G(ref)^-1 is a rotation away from the reference pose,
/// in which bodies are symmetric. Counterparts of mapped joints are those of the standard body; of
/// fingers, twist and other joints the one whose name says the other side ("LeftHandThumb1" and
/// "RightHandThumb1", "thumb.01.L" and "thumb.01.R"); a joint without one is its own.
///
/// @throws Error{kUsage} if the humanoid was made for a skeleton of another size.
[[nodiscard]] Clip mirrored(const Clip& clip, const Humanoid& humanoid);

}  // namespace laban::motion
