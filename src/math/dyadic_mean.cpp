#include "laban/math/dyadic_mean.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "laban/base/error.h"
#include "laban/math/statistics.h"

namespace laban::math {
namespace {

/// Values of one member, or of one pair of members.
struct Cell {
  double residual = 0.0;  // sum
  double count = 0.0;

  void add(double value) {
    residual += value;
    count += 1.0;
  }
};

}  // namespace

DyadicMean dyadic_mean(std::span<const double> values, std::span<const int> first,
                       std::span<const int> second) {
  if (values.empty() || first.size() != values.size() || second.size() != values.size()) {
    throw base::Error(base::ErrorKind::kData,
                      "dyadic_mean: " + std::to_string(values.size()) + " values, " +
                          std::to_string(first.size()) + " first and " +
                          std::to_string(second.size()) +
                          " second members (must be the same number, at least 1)");
  }
  DyadicMean result;
  result.mean = mean(values);
  // Pairs that share both members are found under each of them: once too often.
  std::map<int, Cell> members;
  std::map<std::pair<int, int>, Cell> pairs;
  double squares = 0.0;
  for (std::size_t n = 0; n < values.size(); ++n) {
    const double residual = values[n] - result.mean;
    squares += residual * residual;
    members[first[n]].add(residual);
    if (first[n] == second[n]) continue;
    members[second[n]].add(residual);
    pairs[std::minmax(first[n], second[n])].add(residual);
  }
  double products = 0.0, sharing = 0.0;
  for (const auto& [member, cell] : members) {
    products += cell.residual * cell.residual;
    sharing += cell.count * cell.count;
  }
  for (const auto& [pair, cell] : pairs) {
    products -= cell.residual * cell.residual;
    sharing -= cell.count * cell.count;
  }
  result.members = static_cast<int>(members.size());
  const double N = static_cast<double>(values.size());
  const double apart = N * N - sharing;  // pairs of values without a common member
  if (apart <= 0.0) {
    result.standard_error = std::numeric_limits<double>::infinity();
    return result;
  }
  result.standard_error = std::sqrt(std::max(products / apart, squares / (N * (N - 1.0))));
  return result;
}

}  // namespace laban::math
