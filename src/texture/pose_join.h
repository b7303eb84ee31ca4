#pragma once

#include <Eigen/Dense>

#include "laban/texture/motion_texture.h"

namespace laban::texture {

/// The longest that an offset takes to come or to go.
inline constexpr double kLongestFadeS = 1.25;

/// How two frames become two others, d x 2: the second on the first's branch.
[[nodiscard]] Eigen::MatrixXd offsets_between(const ObservationSpace& space,
                                              const Eigen::Ref<const Eigen::MatrixXd>& from,
                                              const Eigen::Ref<const Eigen::MatrixXd>& to);

/// Where two motions meet: the two frames halfway between two of the one and two of the other, d
/// x 2.
[[nodiscard]] Eigen::MatrixXd halfway(const ObservationSpace& space,
                                      const Eigen::Ref<const Eigen::MatrixXd>& a,
                                      const Eigen::Ref<const Eigen::MatrixXd>& b);

/// Offsets of a motion of `length` frames from given ones of its first two and its last two: they
/// come and go over three quarters of a second, longer if they are large, the sooner the faster
/// they change, for then they would overshoot.
/// @param first, last  d x 2.  @returns d x length, C1 (ramp_between).
[[nodiscard]] Eigen::MatrixXd offset_curve(const MotionTexture& texture, int length,
                                           const Eigen::Ref<const Eigen::MatrixXd>& first,
                                           const Eigen::Ref<const Eigen::MatrixXd>& last);

/// The same for the turns of one joint, radians. @param ends  3 x 4: of the first and last two.
[[nodiscard]] Eigen::MatrixXd joint_offset_curve(double frame_rate_hz, int length,
                                                 const Eigen::Ref<const Eigen::MatrixXd>& ends);

}  // namespace laban::texture
