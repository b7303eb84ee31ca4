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

Minimum grid_then_golden_section(const std::function<double(double)>& f, double low, double high,
                                 int samples, double tolerance) {
  if (samples < 2 || !(low < high)) {
    throw base::Error(base::ErrorKind::kUsage,
                      "grid_then_golden_section: needs samples >= 2 and low < high");
  }
  const double spacing = (high - low) / (samples - 1);
  Minimum best{low, f(low)};
  for (int i = 1; i < samples; ++i) {
    const double x = i == samples - 1 ? high : low + i * spacing;
    const double value = f(x);
    if (value < best.value) best = {x, value};
  }
  const Minimum refined = golden_section(f, std::max(low, best.x - spacing),
                                         std::min(high, best.x + spacing), tolerance);
  return refined.value < best.value ? refined : best;
}

}  // namespace laban::math
