#pragma once

#include <span>

namespace laban::io {

/// Sine and cosine of half of each angle, for quaternions from channels in degrees.
///
/// @param degrees  each at most kLargestDegrees from 0.
/// @param sines, cosines  as many values as `degrees`; written.
/// Each within 4e-16 of the true value; exactly 0 and 1 for 0 degrees. Several times as fast as
/// std::sin and std::cos: the loop is one that compilers vectorise.
void half_angle_sin_cos(std::span<const double> degrees, std::span<double> sines,
                        std::span<double> cosines);

inline constexpr double kLargestDegrees = 1e9;

}  // namespace laban::io
