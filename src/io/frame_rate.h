#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace laban::io {

/// Rates that cameras, games and capture systems run at, Hz.
inline constexpr std::array<double, 12> kCustomaryRatesHz = {24, 25,  30,  50,  60,  72,
                                                             90, 100, 120, 144, 200, 240};

/// The whole rate that a rounded one stands for: the nearest one, if it lies within 0.01 %, or 0.5
/// % if it is a customary one; else none. The caller knows how much rounding its source allows.
[[nodiscard]] inline std::optional<double> whole_rate_near(double rate_hz) {
  const double whole = std::round(rate_hz);
  const bool customary = std::find(kCustomaryRatesHz.begin(), kCustomaryRatesHz.end(), whole) !=
                         kCustomaryRatesHz.end();
  if (whole < 1.0 || !(std::abs(rate_hz - whole) <= (customary ? 0.005 : 0.0001) * whole)) {
    return std::nullopt;
  }
  return whole;
}

}  // namespace laban::io
