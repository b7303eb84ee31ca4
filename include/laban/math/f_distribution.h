#pragma once

namespace laban::math {

/// Regularized incomplete beta function I_x(a, b), the distribution function of Beta(a, b) at x.
///
/// Continued fraction of [DLMF, 8.17.22] by Lentz's method, on the side where it converges fast.
/// Absolute error about 1e-13 for a + b up to 1e4, growing with a + b (1e-9 at 1e6).
/// @param a, b  > 0. @param x  in [0, 1].
/// @throws Error{kUsage} outside these; Error{kNumeric} if a + b is so large (beyond about 1e9)
///         that the fraction does not converge.
[[nodiscard]] double incomplete_beta(double a, double b, double x);

/// P(F <= f) of Fisher's F with d1 and d2 degrees of freedom, not necessarily whole numbers.
/// @throws Error{kUsage} unless d1, d2 > 0 and f >= 0.
[[nodiscard]] double f_distribution(double f, double d1, double d2);

/// The f with P(F <= f) = p, by bisection of log f to the last bits; within [1e-300, 1e300].
/// @param p  in (0, 1). @throws Error{kUsage} otherwise, or unless d1, d2 > 0.
[[nodiscard]] double f_quantile(double p, double d1, double d2);

}  // namespace laban::math
