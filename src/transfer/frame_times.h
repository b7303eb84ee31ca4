#pragma once

#include <span>
#include <vector>

namespace laban::transfer {

/// Times of frames as (fractional) frames of something else: 0, 1, .. `frames` - 1.
[[nodiscard]] std::vector<double> counted(int frames);

/// `count` times spread evenly from 0 to `last`; `count` >= 1, one time is 0.
[[nodiscard]] std::vector<double> evenly(int count, double last);

/// Values at fractional frames (clamped to their range), on straight lines between whole ones.
[[nodiscard]] std::vector<double> read_at(std::span<const double> values,
                                          std::span<const double> frames);

/// The inverse: the fractional frames at which non-decreasing `values` reach each of some ascending
/// `wanted`, clamped to their range; the first such frame where they stand still.
[[nodiscard]] std::vector<double> where(std::span<const double> values,
                                        std::span<const double> wanted);

/// Times without jumps of their rate: frames [k - reach, k + reach] averaged, three times, the ends
/// reflected about themselves (2 x_0 - x_k). The ends stay, what rises goes on rising, and a steady
/// rise stays as it is.
[[nodiscard]] std::vector<double> smoothed_times(std::vector<double> times, int reach);

}  // namespace laban::transfer
