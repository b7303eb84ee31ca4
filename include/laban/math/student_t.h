#pragma once

namespace laban::math {

/// Regularized incomplete beta function I_x(a, b) for a, b > 0 and x in [0, 1], by its continued
/// fraction (Abramowitz and Stegun 26.5.8). To about 1e-14 times 1 + a + b, relative.
/// @throws Error{kUsage} for values out of range.
[[nodiscard]] double regularized_incomplete_beta(double x, double a, double b);

/// P(T <= t) of Student's t.
/// @param degrees_of_freedom  > 0, need not be whole. @throws Error{kUsage} otherwise, or if t is
///        not a number.
[[nodiscard]] double student_t_probability(double t, double degrees_of_freedom);

/// The t with P(T <= t) = probability: 0.975 gives half the width of a 95 % interval in standard
/// errors. To about 1e-12 relative up to 1000 degrees of freedom.
/// @param probability  in (0, 1). @throws Error{kUsage} otherwise, and as student_t_probability.
[[nodiscard]] double student_t_quantile(double probability, double degrees_of_freedom);

}  // namespace laban::math
