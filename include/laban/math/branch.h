#pragma once

#include <Eigen/Dense>

namespace laban::math {

/// Moves a whole curve of exponential maps to another branch: the frame `anchor` becomes `value`
/// and every other frame the equivalent (r + 2 pi k r / |r|) nearest to its neighbour on the
/// anchor's side (METHODS 0). This is what a constant branch shift means: r + 2 pi k r / |r| is no
/// constant vector, and k changes sign where the curve runs through r = 0, so the shift is fixed at
/// one frame and carried to the others by continuity.
///
/// @param curve   3 x F, radians, F >= 1.
/// @param anchor  a frame, 0 <= anchor < F.
/// @param value   an exponential map of the rotation curve.col(anchor).
[[nodiscard]] Eigen::Matrix3Xd carry_branch(const Eigen::Ref<const Eigen::Matrix3Xd>& curve,
                                            int anchor, const Eigen::Vector3d& value);

/// The curve moved by `turns` whole turns about its own axis at the frame whose axis is best
/// defined (the one with |r| farthest from every multiple of 2 pi), carried to the other frames.
[[nodiscard]] Eigen::Matrix3Xd shift_branch(const Eigen::Ref<const Eigen::Matrix3Xd>& curve,
                                            int turns);

}  // namespace laban::math
