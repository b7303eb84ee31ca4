#pragma once

#include <functional>
#include <span>

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

/// Golden-section search around the best of some samples of `f`: between the neighbours of the
/// sample with the least value (clipped to the range), never returning worse than that sample
/// (METHODS 1.6). Ties go to the first sample.
///
/// @param x       ascending, at least one.
/// @param values  f at each x.
/// @throws Error{kUsage} unless sizes agree, x is not empty and tolerance > 0.
[[nodiscard]] Minimum refine_best_sample(const std::function<double(double)>& f,
                                         std::span<const double> x, std::span<const double> values,
                                         double tolerance);

}  // namespace laban::math
