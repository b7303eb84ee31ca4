#include "laban/math/golden_section.h"

#include <algorithm>

#include "laban/base/error.h"

namespace laban::math {

Minimum golden_section(const std::function<double(double)>& f, double low, double high,
                       double tolerance) {
  if (!(low <= high) || !(tolerance > 0.0)) {
    throw base::Error(base::ErrorKind::kUsage,
                      "golden_section: needs low <= high and tolerance > 0");
  }
  constexpr double kRatio = 0.6180339887498949;  // (sqrt(5) - 1) / 2
  Minimum left{high - kRatio * (high - low), 0.0};
  Minimum right{low + kRatio * (high - low), 0.0};
  left.value = f(left.x);
  right.value = f(right.x);
  Minimum best = left.value <= right.value ? left : right;
  while (high - low > tolerance) {
    Minimum& moved = left.value <= right.value ? right : left;
    if (&moved == &right) {
      high = right.x;
      right = left;
      left.x = high - kRatio * (high - low);
      left.value = f(left.x);
      if (left.value < best.value) best = left;
    } else {
      low = left.x;
      left = right;
      right.x = low + kRatio * (high - low);
      right.value = f(right.x);
      if (right.value < best.value) best = right;
    }
  }
  return best;
}

Minimum refine_best_sample(const std::function<double(double)>& f, std::span<const double> x,
                           std::span<const double> values, double tolerance) {
  if (x.empty() || x.size() != values.size()) {
    throw base::Error(base::ErrorKind::kUsage,
                      "refine_best_sample: needs a value for each of at least one x");
  }
  const auto best =
      static_cast<std::size_t>(std::min_element(values.begin(), values.end()) - values.begin());
  const Minimum refined = golden_section(f, x[best == 0 ? 0 : best - 1],
                                         x[std::min(best + 1, x.size() - 1)], tolerance);
  return refined.value < values[best] ? refined : Minimum{x[best], values[best]};
}

}  // namespace laban::math
