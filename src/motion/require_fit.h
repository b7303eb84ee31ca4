#pragma once

#include <string>

#include "laban/base/error.h"
#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {

/// @throws Error{kUsage}, naming `place`, if the humanoid was made for a skeleton of another size.
inline void require_fit(const Clip& clip, const Humanoid& humanoid, const std::string& place) {
  if (clip.joint_count() == humanoid.rig_joint_count()) return;
  throw base::Error(base::ErrorKind::kUsage, place + ": the clip has " +
                                                 std::to_string(clip.joint_count()) +
                                                 " joints, the humanoid was made for " +
                                                 std::to_string(humanoid.rig_joint_count()));
}

}  // namespace laban::motion
