#pragma once

#include <Eigen/Dense>

namespace laban::math {

/// Zero-phase low-pass of every row of a D x F matrix: a second-order Butterworth filter (bilinear
/// transform, prewarped) run forward, then backward, so that nothing is delayed. Passing twice
/// makes the gain at the cutoff 1/2 (-6 dB); a constant passes unchanged.
///
/// Ends are padded by odd reflection (2 x_0 - x_k) over 3 * rate / cutoff frames, at most F - 1,
/// and each pass begins in the steady state of its first value, so ends neither ring nor are pulled
/// to zero [Gustafsson 1996, as scipy.signal.filtfilt].
///
/// @param rows           D x F, finite, a column is a frame; F = 1 comes back as it is.
/// @param frame_rate_hz  > 0.
/// @param cutoff_hz      > 0. At 0.45 frame_rate_hz or above (near or past what the rate can hold)
///                       the rows come back unchanged.
/// @throws Error{kUsage} for a rate or cutoff that is not positive and finite.
[[nodiscard]] Eigen::MatrixXd low_pass(const Eigen::Ref<const Eigen::MatrixXd>& rows,
                                       double frame_rate_hz, double cutoff_hz);

}  // namespace laban::math
