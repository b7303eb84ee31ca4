#pragma once

#include <memory>
#include <ostream>

#include <gmock/gmock.h>

#include "laban/math/rotation.h"
#include "laban/motion/clip.h"
#include "laban/motion/pose_matrix.h"

namespace laban::test {

/// What random_clip and random_pose_matrix make; smooth in time, and the same for the same seed.
struct ClipShape {
  int joints = 5;
  int frames = 40;
  double frame_rate_hz = 60.0;
  unsigned seed = 1;
  double amplitude_rad = 0.6;  ///< of each joint's swing
};

/// A chain of joints that swings smoothly while its root travels and turns.
[[nodiscard]] motion::Clip random_clip(const ClipShape& shape = {});

/// A smooth pose matrix of the standard humanoid: sines of a few random phases a row.
[[nodiscard]] motion::PoseMatrix random_pose_matrix(const ClipShape& shape = {});

/// Matches a quaternion that is the same rotation within `degrees` (q and -q are equal).
MATCHER_P2(IsNearRotation, expected, degrees, "") {
  const double angle = math::angle_between(arg, expected) * 57.29577951308232;
  *result_listener << "which is " << angle << " degrees away";
  return angle <= degrees;
}

}  // namespace laban::test
