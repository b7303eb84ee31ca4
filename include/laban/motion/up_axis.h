#pragma once

#include <Eigen/Geometry>

#include "laban/motion/clip.h"

namespace laban::motion {

/// The axis of a file's model space that points away from the ground. Here it is always +Y; other
/// programs write +Z (3ds Max, Blender, Unreal) or, seldom, +X.
enum class UpAxis { kX, kY, kZ };

/// The rotation that turns model space with that axis up into model space with +Y up.
[[nodiscard]] Eigen::Quaterniond y_up_from(UpAxis up);

/// A clip and its skeleton as seen from a turned model space: positions, rest offsets and the axes
/// in which rotations are told are all turned, so that the rest skeleton turns with the motion. The
/// opposite turn gives the clip back.
/// @param turn  a unit rotation.
[[nodiscard]] Clip turned(const Clip& clip, const Eigen::Quaterniond& turn);

/// Which axis is up in a clip that was read as it stands in its file: the one along which head and
/// feet lie apart (median over time) where they do so clearly, within about 37 degrees, and +Y does
/// not. Needs head and feet of known names; +Y without. A rest skeleton that stands along +Y is
/// believed before the motion, since people lie down more often than files mix axes.
[[nodiscard]] UpAxis find_up_axis(const Clip& clip);

}  // namespace laban::motion
