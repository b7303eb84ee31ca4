#pragma once

#include <span>

namespace laban::math {

/// A mean and how far it may be off.
struct DyadicMean {
  double mean = 0.0;
  /// Infinite where it cannot be told: every two values share a member.
  double standard_error = 0.0;
  int members = 0;  ///< different members met; for t intervals: members - 1 degrees of freedom
};

/// Mean of values that each belong to a pair of members (a blend of two performers), with a
/// standard error for *other members*: values that share one may be as correlated as they like
/// [AronowSamiiAssenova15].
///
/// With residuals r, the variance of the mean is the sum of r_a r_b over all ordered pairs of
/// values that share a member (a value with itself too), over N^2 (1 - s), s the share of pairs
/// that share one. The divisor 1 - s is ours: residuals sum to zero, which takes just that part
/// away, both of independent noise and, in balanced designs, of effects of the members. (Values of
/// one member each, `first` = `second`, in groups of one size: 1 - s = 1 - 1 / groups, the usual
/// correction.) A sum of products may turn out small or negative by chance; it is never taken below
/// what independent values have, variance / N.
///
/// @param first, second  members of each value, any numbers; equal for a value of one member.
/// @throws Error{kData} unless the three have one size N >= 1.
[[nodiscard]] DyadicMean dyadic_mean(std::span<const double> values, std::span<const int> first,
                                     std::span<const int> second);

}  // namespace laban::math
