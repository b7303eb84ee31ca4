#pragma once

#include <limits>
#include <numbers>

namespace laban::math {

inline constexpr double kDegree = std::numbers::pi / 180.0;  ///< in radians
inline constexpr double kLogTwoPi = 1.8378770664093453;      ///< log 2 pi
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace laban::math
