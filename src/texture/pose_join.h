#pragma once

#include <Eigen/Dense>

#include "laban/texture/motion_texture.h"

namespace laban::texture {

/// How two frames become two others, d x 2: the second on the first's branch.
[[nodiscard]] Eigen::MatrixXd offsets_between(const ObservationSpace& space,
                                              const Eigen::Ref<const Eigen::MatrixXd>& from,
                                              const Eigen::Ref<const Eigen::MatrixXd>& to);

/// Offsets of a motion of `length` frames from given ones of its first two and its last two: they
/// come and go over at most three quarters of a second, the sooner the faster they change, for then
/// they would overshoot.
/// @param first, last  d x 2.  @returns d x length, C1 (ramp_between).
[[nodiscard]] Eigen::MatrixXd offset_curve(const MotionTexture& texture, int length,
                                           const Eigen::Ref<const Eigen::MatrixXd>& first,
                                           const Eigen::Ref<const Eigen::MatrixXd>& last);

}  // namespace laban::texture
