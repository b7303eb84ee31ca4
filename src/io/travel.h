#pragma once

#include <vector>

#include "laban/motion/clip.h"

namespace laban::io {

/// For each joint, whether it travels: its position within its parent varies by more than 5 cm on
/// some axis. Such a joint is carried by its parent, not tied to it by a bone of fixed length (hips
/// below a root that stays at the origin), and its rest offset means nothing. Never the root.
[[nodiscard]] std::vector<bool> travelling_joints(const motion::Clip& clip);

}  // namespace laban::io
