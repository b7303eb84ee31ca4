#include "laban/math/statistics.h"

#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "laban/base/error.h"

namespace laban::math {
namespace {

using base::Error;
using base::ErrorKind;

void require_count(std::size_t count, std::size_t least, const char* what) {
  if (count >= least) return;
  throw Error(ErrorKind::kData, std::string(what) + ": " + std::to_string(count) +
                                    " values (needs at least " + std::to_string(least) + ")");
}

void require_same_count(std::size_t a, std::size_t b, const char* what) {
  if (a == b) return;
  throw Error(ErrorKind::kData, std::string(what) + ": sequences of " + std::to_string(a) +
                                    " and " + std::to_string(b) +
                                    " values (must be the same length)");
}

/// Order statistic between two neighbours: position 0 is the least of the sorted values.
double interpolated(const std::vector<double>& sorted, double position) {
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double part = position - static_cast<double>(below);
  return sorted[below] + part * (sorted[above] - sorted[below]);
}

double choose_two(double n) {
  return n * (n - 1.0) / 2.0;
}

double greatest_magnitude(std::span<const double> values) {
  double greatest = 0.0;
  for (const double value : values) greatest = std::max(greatest, std::abs(value));
  return greatest;
}

/// True if what spread there is, is round-off of the values' size.
bool is_constant(double sum_of_squares, std::span<const double> values) {
  const double rms = std::sqrt(sum_of_squares / static_cast<double>(values.size()));
  return rms <= 1e-12 * greatest_magnitude(values);
}

}  // namespace

double mean(std::span<const double> values) {
  require_count(values.size(), 1, "mean");
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double population_variance(std::span<const double> values) {
  require_count(values.size(), 1, "variance");
  const double center = mean(values);
  double sum = 0.0;
  for (const double value : values) sum += (value - center) * (value - center);
  return sum / static_cast<double>(values.size());
}

double standard_deviation(std::span<const double> values) {
  require_count(values.size(), 2, "standard deviation");
  const auto n = static_cast<double>(values.size());
  return std::sqrt(population_variance(values) * n / (n - 1.0));
}

double standard_error(std::span<const double> values) {
  require_count(values.size(), 2, "standard error");
  return standard_deviation(values) / std::sqrt(static_cast<double>(values.size()));
}

double median(std::span<const double> values) {
  require_count(values.size(), 1, "median");
  return percentile(values, 50.0);
}

double percentile(std::span<const double> values, double percent) {
  require_count(values.size(), 1, "percentile");
  if (!(percent >= 0.0 && percent <= 100.0)) {
    throw Error(ErrorKind::kUsage,
                "percentile: " + std::to_string(percent) + " (must be in [0, 100])");
  }
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  return interpolated(sorted, percent / 100.0 * static_cast<double>(sorted.size() - 1));
}

double robust_deviation(std::span<const double> values) {
  require_count(values.size(), 1, "robust deviation");
  const double center = median(values);
  std::vector<double> deviations;
  deviations.reserve(values.size());
  for (const double value : values) deviations.push_back(std::abs(value - center));
  // 1 / Phi^-1(3/4): the median absolute deviation of a standard normal.
  return 1.482602218505602 * median(deviations);
}

double pearson(std::span<const double> x, std::span<const double> y) {
  require_same_count(x.size(), y.size(), "correlation");
  require_count(x.size(), 2, "correlation");
  const double mean_x = mean(x), mean_y = mean(y);
  double xx = 0.0, yy = 0.0, xy = 0.0;
  for (std::size_t n = 0; n < x.size(); ++n) {
    const double dx = x[n] - mean_x, dy = y[n] - mean_y;
    xx += dx * dx;
    yy += dy * dy;
    xy += dx * dy;
  }
  if (is_constant(xx, x) || is_constant(yy, y)) return 0.0;
  // Round-off may carry the quotient past its bounds.
  return std::clamp(xy / (std::sqrt(xx) * std::sqrt(yy)), -1.0, 1.0);
}

std::vector<double> ranks(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> result(values.size());
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double shared = static_cast<double>(begin + end + 1) / 2.0;  // mean of begin+1 .. end
    for (std::size_t n = begin; n < end; ++n) result[order[n]] = shared;
  }
  return result;
}

double spearman(std::span<const double> x, std::span<const double> y) {
  require_same_count(x.size(), y.size(), "rank correlation");
  require_count(x.size(), 2, "rank correlation");
  return pearson(ranks(x), ranks(y));
}

double adjusted_rand_index(std::span<const int> a, std::span<const int> b) {
  require_same_count(a.size(), b.size(), "adjusted Rand index");
  require_count(a.size(), 1, "adjusted Rand index");
  std::map<std::pair<int, int>, double> cells;
  std::map<int, double> rows, columns;
  for (std::size_t n = 0; n < a.size(); ++n) {
    cells[{a[n], b[n]}] += 1.0;
    rows[a[n]] += 1.0;
    columns[b[n]] += 1.0;
  }
  const auto pairs = [](const auto& counts) {
    double sum = 0.0;
    for (const auto& entry : counts) sum += choose_two(entry.second);
    return sum;
  };
  const double together = pairs(cells), in_a = pairs(rows), in_b = pairs(columns);
  const double all = choose_two(static_cast<double>(a.size()));
  const double expected = all > 0.0 ? in_a * in_b / all : 0.0;
  const double greatest = (in_a + in_b) / 2.0;
  // Nothing can vary: both put all items together, or both all apart.
  if (greatest == expected) return 1.0;
  return (together - expected) / (greatest - expected);
}

}  // namespace laban::math
