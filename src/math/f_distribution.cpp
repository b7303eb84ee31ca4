#include "laban/math/f_distribution.h"

#include <cmath>
#include <string>

#include "laban/base/error.h"

namespace laban::math {
namespace {

using base::Error;
using base::ErrorKind;

void require(bool holds, const std::string& rule) {
  if (!holds) throw Error(ErrorKind::kUsage, "F distribution: " + rule);
}

double log_gamma(double x) {
  int sign = 0;
  return ::lgamma_r(x, &sign);  // std::lgamma writes a global variable
}

/// The continued fraction of I_x(a, b) [DLMF, 8.17.22], by Lentz's method as Thompson and Barnett
/// changed it. Converges fast, in O(sqrt(max(a, b))) steps, for x < (a + 1) / (a + b + 2).
double continued_fraction(double a, double b, double x) {
  constexpr int kMaxSteps = 100000;
  constexpr double kTiny = 1e-300;  // instead of 0 in a denominator
  const auto not_zero = [](double value) { return std::abs(value) < kTiny ? kTiny : value; };
  double c = 1.0;
  double d = 1.0 / not_zero(1.0 - (a + b) * x / (a + 1.0));
  double value = d;
  for (int m = 1; m <= kMaxSteps; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    double change = 1.0;
    for (const double term : {even, odd}) {
      d = 1.0 / not_zero(1.0 + term * d);
      c = not_zero(1.0 + term / c);
      change = c * d;
      value *= change;
    }
    if (std::abs(change - 1.0) < 1e-15) return value;
  }
  throw Error(ErrorKind::kNumeric, "incomplete beta function: a = " + std::to_string(a) +
                                       ", b = " + std::to_string(b) +
                                       ": the continued fraction does not converge");
}

/// I_x(a, b) with y = 1 - x, each to its own full precision.
double incomplete_beta(double a, double b, double x, double y) {
  if (x <= 0.0) return 0.0;
  if (y <= 0.0) return 1.0;
  const double front =
      std::exp(log_gamma(a + b) - log_gamma(a) - log_gamma(b) + a * std::log(x) + b * std::log(y));
  if (x < (a + 1.0) / (a + b + 2.0)) return front * continued_fraction(a, b, x) / a;
  return 1.0 - front * continued_fraction(b, a, y) / b;
}

}  // namespace

double incomplete_beta(double a, double b, double x) {
  require(a > 0.0 && b > 0.0 && x >= 0.0 && x <= 1.0,
          "incomplete beta function needs a, b > 0 and x in [0, 1]");
  return incomplete_beta(a, b, x, 1.0 - x);
}

double f_distribution(double f, double d1, double d2) {
  require(d1 > 0.0 && d2 > 0.0, "degrees of freedom must be > 0");
  require(f >= 0.0, "f must be >= 0");
  if (std::isinf(f)) return 1.0;
  const double sum = d1 * f + d2;
  return incomplete_beta(0.5 * d1, 0.5 * d2, d1 * f / sum, d2 / sum);
}

double f_quantile(double p, double d1, double d2) {
  require(p > 0.0 && p < 1.0, "p must be in (0, 1)");
  constexpr double kMaxLog = 690.0;  // e^690 = 1e300
  double low = -kMaxLog;
  double high = kMaxLog;
  while (true) {
    const double middle = 0.5 * (low + high);
    // The bracket cannot be halved any more.
    if (middle <= low || middle >= high) return std::exp(middle);
    (f_distribution(std::exp(middle), d1, d2) < p ? low : high) = middle;
  }
}

}  // namespace laban::math
