#pragma once

#include <span>
#include <vector>

#include <Eigen/Dense>

namespace laban::math {

/// The coefficients of a vector as a span; valid while `values` lives.
[[nodiscard]] inline std::span<const double> as_span(const Eigen::VectorXd& values) {
  return {values.data(), static_cast<std::size_t>(values.size())};
}

// All functions below throw Error{kData} for too few values (each says how many it needs) or where
// two sequences differ in length. Values are taken as finite.

/// Arithmetic mean of N >= 1 values.
[[nodiscard]] double mean(std::span<const double> values);

/// Variance with divisor N (population) of N >= 1 values, by two passes.
[[nodiscard]] double population_variance(std::span<const double> values);

/// Sample standard deviation, divisor N - 1, of N >= 2 values.
[[nodiscard]] double standard_deviation(std::span<const double> values);

/// Standard error of the mean: standard_deviation / sqrt(N), N >= 2.
[[nodiscard]] double standard_error(std::span<const double> values);

/// Middle value of N >= 1 (mean of the two middle ones for even N).
[[nodiscard]] double median(std::span<const double> values);

/// Percentile by linear interpolation between order statistics (numpy's default, type 7 of Hyndman
/// and Fan): percentile 0 is the least of N >= 1 values, 100 the greatest.
/// @param percent  in [0, 100]. @throws Error{kUsage} otherwise.
[[nodiscard]] double percentile(std::span<const double> values, double percent);

/// Median absolute deviation from the median times 1.4826, N >= 1: estimates the standard
/// deviation of normal values and withstands up to half of them being wrong.
[[nodiscard]] double robust_deviation(std::span<const double> values);

/// Pearson's correlation of two sequences of N >= 2; 0 if either is constant (its spread is below
/// 1e-12 of its magnitude: only round-off is left).
[[nodiscard]] double pearson(std::span<const double> x, std::span<const double> y);

/// Ranks from 1, equal values share their mean rank.
[[nodiscard]] std::vector<double> ranks(std::span<const double> values);

/// Spearman's rank correlation: Pearson's of the ranks; 0 if either sequence is constant.
[[nodiscard]] double spearman(std::span<const double> x, std::span<const double> y);

/// Agreement of two partitions of N >= 1 items, corrected for chance [Hubert and Arabie 1985]: 1
/// for the same partition under any numbering, about 0 for unrelated ones. Labels are any ints.
/// Two partitions that are both trivial in the same way (all one, or all apart) agree: 1.
[[nodiscard]] double adjusted_rand_index(std::span<const int> a, std::span<const int> b);

}  // namespace laban::math
