#include "io/half_angle.h"

#include <bit>
#include <cstdint>
#include <numbers>

namespace laban::io {
namespace {

constexpr double kHalfDegree = std::numbers::pi / 360.0;

// Added to a double below 2^51, it leaves the nearest whole number in the sum's last bits.
constexpr double kRounder = 0x1.8p52;

/// 1 / n!
constexpr double inverse_factorial(int n) {
  double product = 1.0;
  for (int i = 2; i <= n; ++i) product *= i;
  return 1.0 / product;
}

// Taylor series to x^15 and x^16. For |x| <= pi / 4 what is left out is at most x^16 / 17! of the
// sine and x^18 / 18!, that is 6e-17 and 2e-18: below the rounding of the result.
constexpr double sine_near_zero(double x) {
  const double z = x * x;
  double sum = -inverse_factorial(15);
  sum = sum * z + inverse_factorial(13);
  sum = sum * z - inverse_factorial(11);
  sum = sum * z + inverse_factorial(9);
  sum = sum * z - inverse_factorial(7);
  sum = sum * z + inverse_factorial(5);
  sum = sum * z - inverse_factorial(3);
  return x + x * (z * sum);
}

constexpr double cosine_near_zero(double x) {
  const double z = x * x;
  double sum = inverse_factorial(16);
  sum = sum * z - inverse_factorial(14);
  sum = sum * z + inverse_factorial(12);
  sum = sum * z - inverse_factorial(10);
  sum = sum * z + inverse_factorial(8);
  sum = sum * z - inverse_factorial(6);
  sum = sum * z + inverse_factorial(4);
  return 1.0 - z * (0.5 - z * sum);
}

}  // namespace

void half_angle_sin_cos(std::span<const double> degrees, std::span<double> sines,
                        std::span<double> cosines) {
  const double* const in = degrees.data();
  double* const sine_out = sines.data();
  double* const cosine_out = cosines.data();
  const std::size_t count = degrees.size();
  for (std::size_t i = 0; i < count; ++i) {
    // Half of the angle is n quarter turns and the rest x. The rest is found in degrees, where it
    // is exact: 180 n is a whole number, and a multiple of the last bit of an angle that is large
    // enough for n not to be 0. So the only roundings are one product and the series.
    const double shifted = in[i] * (1.0 / 180.0) + kRounder;
    const double n = shifted - kRounder;
    const double x = (in[i] - 180.0 * n) * kHalfDegree;
    const auto sine = std::bit_cast<std::uint64_t>(sine_near_zero(x));
    const auto cosine = std::bit_cast<std::uint64_t>(cosine_near_zero(x));
    // Odd n: they change places. Their signs are those of the quadrant. By bits, as a branch would
    // keep the loop from being vectorised.
    const auto quadrant = std::bit_cast<std::uint64_t>(shifted);
    const std::uint64_t odd = 0 - (quadrant & 1U);
    const std::uint64_t sine_sign = (quadrant & 2U) << 62U;
    const std::uint64_t cosine_sign = ((quadrant + 1) & 2U) << 62U;
    sine_out[i] = std::bit_cast<double>(((sine & ~odd) | (cosine & odd)) ^ sine_sign);
    cosine_out[i] = std::bit_cast<double>(((cosine & ~odd) | (sine & odd)) ^ cosine_sign);
  }
}

}  // namespace laban::io
