#include "laban/math/low_pass.h"

#include <cmath>
#include <numbers>
#include <string>

#include "laban/base/error.h"

namespace laban::math {
namespace {

// Notation                                        here
//   y_n = b_0 x_n + b_1 x_(n-1) + b_2 x_(n-2)       Biquad::b, a (a_0 = 1)
//         - a_1 y_(n-1) - a_2 y_(n-2)
//   s_1, s_2   transposed direct form II            s1, s2
struct Biquad {
  double b0, b1, b2, a1, a2;
};

/// Second-order Butterworth low-pass: poles of s^2 + sqrt(2) s + 1 through the bilinear transform
/// with the cutoff prewarped, k = tan(pi * cutoff / rate).
Biquad butterworth(double cutoff_over_rate) {
  const double k = std::tan(std::numbers::pi * cutoff_over_rate);
  const double norm = 1.0 / (1.0 + std::numbers::sqrt2 * k + k * k);
  const double b0 = k * k * norm;
  return {b0, 2.0 * b0, b0, 2.0 * (k * k - 1.0) * norm,
          (1.0 - std::numbers::sqrt2 * k + k * k) * norm};
}

/// Columns one after the other, `stride` numbers (of either sign) apart.
struct Columns {
  double* first;
  Eigen::Index stride;
  Eigen::Index count;
  Eigen::Index rows;
};

/// One pass over every row, in place, from the states s1 and s2, one a row.
[[gnu::always_inline]] inline void filter(const Biquad& f, const Columns& columns,
                                          double* __restrict s1, double* __restrict s2) {
  for (Eigen::Index n = 0; n < columns.count; ++n) {
    double* __restrict const column = columns.first + n * columns.stride;
    for (Eigen::Index r = 0; r < columns.rows; ++r) {
      const double x = column[r];
      const double y = f.b0 * x + s1[r];
      s1[r] = f.b1 * x - f.a1 * y + s2[r];
      s2[r] = f.b2 * x - f.a2 * y;
      column[r] = y;
    }
  }
}

#if defined(__x86_64__)
// Four rows at a time instead of two. Without FMA, so that every machine gives the same bytes.
[[gnu::target("avx2")]] void filter_by_fours(const Biquad& f, const Columns& columns, double* s1,
                                             double* s2) {
  filter(f, columns, s1, s2);
}

bool has_fours() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}
#endif

/// One pass over every row, in place, from column `first` on by `step` (1 or -1) to the other end,
/// from the steady state of the first column.
void filter(const Biquad& f, Eigen::Index first, Eigen::Index step, Eigen::MatrixXd& rows) {
  // With x = y = c for ever: s_2 = (b_2 - a_2) c and s_1 = (b_1 - a_1) c + s_2.
  Eigen::VectorXd second = (f.b2 - f.a2) * rows.col(first);
  Eigen::VectorXd once = (f.b1 - f.a1) * rows.col(first) + second;
  const Columns columns{rows.col(first).data(), step * rows.rows(), rows.cols(), rows.rows()};
#if defined(__x86_64__)
  if (has_fours()) return filter_by_fours(f, columns, once.data(), second.data());
#endif
  filter(f, columns, once.data(), second.data());
}

/// Odd reflection about both ends: 2 x_0 - x_k before, 2 x_(F-1) - x_(F-1-k) after.
Eigen::MatrixXd padded(const Eigen::Ref<const Eigen::MatrixXd>& rows, Eigen::Index pad) {
  const Eigen::Index frames = rows.cols();
  Eigen::MatrixXd result(rows.rows(), frames + 2 * pad);
  result.middleCols(pad, frames) = rows;
  for (Eigen::Index k = 1; k <= pad; ++k) {
    result.col(pad - k) = 2.0 * rows.col(0) - rows.col(k);
    result.col(pad + frames - 1 + k) = 2.0 * rows.col(frames - 1) - rows.col(frames - 1 - k);
  }
  return result;
}

void require_positive(double value, const char* what) {
  if (value > 0.0 && std::isfinite(value)) return;
  throw base::Error(base::ErrorKind::kUsage, std::string("low_pass: ") + what + " = " +
                                                 std::to_string(value) +
                                                 " Hz (must be positive and finite)");
}

}  // namespace

Eigen::MatrixXd low_pass(const Eigen::Ref<const Eigen::MatrixXd>& rows, double frame_rate_hz,
                         double cutoff_hz) {
  require_positive(frame_rate_hz, "frame rate");
  require_positive(cutoff_hz, "cutoff");
  const double relative = cutoff_hz / frame_rate_hz;
  if (rows.cols() <= 1 || relative >= 0.45) return rows;
  // As a double first: a tiny cutoff would overflow the index.
  const double wanted = std::ceil(3.0 / relative);
  const double longest = static_cast<double>(rows.cols() - 1);
  const auto pad = static_cast<Eigen::Index>(std::min(wanted, longest));
  const Biquad biquad = butterworth(relative);
  Eigen::MatrixXd work = padded(rows, pad);
  filter(biquad, 0, 1, work);
  filter(biquad, work.cols() - 1, -1, work);
  return work.middleCols(pad, rows.cols());
}

}  // namespace laban::math
