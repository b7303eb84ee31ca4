#pragma once

#include <functional>

namespace laban::math {

struct Minimum {
  double x = 0.0;
  double value = 0.0;
};

/// Golden-section search for a minimum of `f` in [low, high]: narrows the bracket by 0.618 a step
/// until it is at most `tolerance` wide. The best point evaluated is returned: for a function with
/// one minimum there it lies within `tolerance` of it, for any other it is merely no worse than the
/// points seen.
///
/// @throws Error{kUsage} unless low <= high and tolerance > 0.
[[nodiscard]] Minimum golden_section(const std::function<double(double)>& f, double low,
                                     double high, double tolerance);

/// A grid of `samples` uniform points in [low, high], then golden-section search between the
/// neighbours of the best one (clipped to the range), never returning worse than the best sample
/// (METHODS 1.6). Ties go to the lower x.
///
/// @throws Error{kUsage} unless samples >= 2 and low < high.
[[nodiscard]] Minimum grid_then_golden_section(const std::function<double(double)>& f, double low,
                                               double high, int samples, double tolerance);

}  // namespace laban::math
