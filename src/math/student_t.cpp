#include "laban/math/student_t.h"

#include <cmath>
#include <limits>
#include <string>

#include "laban/base/error.h"

namespace laban::math {
namespace {

void require(bool holds, const char* what, double value, const char* rule) {
  if (holds) return;
  throw base::Error(base::ErrorKind::kUsage, std::string("Student's t: ") + what + " = " +
                                                 std::to_string(value) + " (must be " + rule + ")");
}

/// The continued fraction of I_x(a, b), by Lentz's method; quick for x < (a + 1) / (a + b + 2).
double beta_fraction(double x, double a, double b) {
  constexpr double kTiny = 1e-300;  // in place of a denominator that vanishes
  constexpr double kPrecision = std::numeric_limits<double>::epsilon();
  const auto nonzero = [](double value) { return std::abs(value) < kTiny ? kTiny : value; };
  double C = 1.0;
  double D = 1.0 / nonzero(1.0 - (a + b) * x / (a + 1.0));
  double fraction = D;
  // About sqrt(max(a, b)) terms are needed.
  for (int m = 1; m < 100000; ++m) {
    const double even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
    D = 1.0 / nonzero(1.0 + even * D);
    C = nonzero(1.0 + even / C);
    fraction *= C * D;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
    D = 1.0 / nonzero(1.0 + odd * D);
    C = nonzero(1.0 + odd / C);
    const double step = C * D;
    fraction *= step;
    if (std::abs(step - 1.0) <= kPrecision) break;
  }
  return fraction;
}

/// The x with I_x(a, b) = p, by halving: I grows with x.
double inverse_beta(double p, double a, double b) {
  double low = 0.0, high = 1.0;
  // A bracket of doubles halves at most 1100 times, tiny x included.
  while (true) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return middle;
    (regularized_incomplete_beta(middle, a, b) < p ? low : high) = middle;
  }
}

}  // namespace

double regularized_incomplete_beta(double x, double a, double b) {
  require(x >= 0.0 && x <= 1.0, "x", x, "in [0, 1]");
  require(a > 0.0 && std::isfinite(a), "a", a, "positive");
  require(b > 0.0 && std::isfinite(b), "b", b, "positive");
  if (x == 0.0 || x == 1.0) return x;
  const double log_front =
      std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x);
  if (x < (a + 1.0) / (a + b + 2.0)) return std::exp(log_front) * beta_fraction(x, a, b) / a;
  return 1.0 - std::exp(log_front) * beta_fraction(1.0 - x, b, a) / b;
}

double student_t_probability(double t, double degrees_of_freedom) {
  require(degrees_of_freedom > 0.0 && std::isfinite(degrees_of_freedom), "degrees of freedom",
          degrees_of_freedom, "positive");
  require(!std::isnan(t), "t", t, "a number");
  const double square = t * t;
  // Whichever of the two is the less loses no digits.
  const double outside =
      square > degrees_of_freedom
          ? regularized_incomplete_beta(degrees_of_freedom / (degrees_of_freedom + square),
                                        0.5 * degrees_of_freedom, 0.5)
          : 1.0 - regularized_incomplete_beta(square / (degrees_of_freedom + square), 0.5,
                                              0.5 * degrees_of_freedom);
  return t > 0.0 ? 1.0 - 0.5 * outside : 0.5 * outside;
}

double student_t_quantile(double probability, double degrees_of_freedom) {
  require(probability > 0.0 && probability < 1.0, "probability", probability, "in (0, 1)");
  require(degrees_of_freedom > 0.0 && std::isfinite(degrees_of_freedom), "degrees of freedom",
          degrees_of_freedom, "positive");
  if (probability == 0.5) return 0.0;
  const double tail = probability < 0.5 ? probability : 1.0 - probability;
  const double half = 0.5 * degrees_of_freedom;
  // t^2 / (v + t^2) and v / (v + t^2): the less of the two is found, the other is its rest.
  double far = 0.0, near = 0.0;
  if (regularized_incomplete_beta(0.5, half, 0.5) > 2.0 * tail) {
    near = inverse_beta(2.0 * tail, half, 0.5);
    far = 1.0 - near;
  } else {
    far = inverse_beta(1.0 - 2.0 * tail, 0.5, half);
    near = 1.0 - far;
  }
  const double t = std::sqrt(degrees_of_freedom * far / near);
  return probability < 0.5 ? -t : t;
}

}  // namespace laban::math
