#include "laban/math/cubic_interpolation.h"

#include <array>
#include <cmath>

#include "laban/base/error.h"

namespace laban::math {
namespace {

using Eigen::Index;

/// The columns that make up one value: weight[m] of column first + m.
struct Stencil {
  Index first = 0;
  int size = 1;
  std::array<double, 4> weight{};
};

/// Adds `factor` times the tangent at column i of F >= 2.
void add_tangent(Stencil& stencil, Index i, Index count, double factor) {
  const auto add = [&](Index column, double value) {
    stencil.weight[static_cast<std::size_t>(column - stencil.first)] += factor * value;
  };
  if (count == 2) {
    add(0, -1.0);
    add(1, 1.0);
  } else if (i == 0) {
    add(0, -1.5);
    add(1, 2.0);
    add(2, -0.5);
  } else if (i == count - 1) {
    add(i, 1.5);
    add(i - 1, -2.0);
    add(i - 2, 0.5);
  } else {
    add(i - 1, -0.5);
    add(i + 1, 0.5);
  }
}

Stencil stencil_at(double frame, Index count) {
  if (std::isnan(frame)) {
    throw base::Error(base::ErrorKind::kUsage, "interpolate: the frame is not a number");
  }
  Stencil stencil;
  if (count == 1) {
    stencil.weight[0] = 1.0;
    return stencil;
  }
  const double t = std::clamp(frame, 0.0, static_cast<double>(count - 1));
  const Index i = std::min(static_cast<Index>(t), count - 2);
  const double s = t - static_cast<double>(i);
  stencil.size = static_cast<int>(std::min<Index>(4, count));
  stencil.first = std::clamp<Index>(i - 1, 0, count - stencil.size);
  // The Hermite basis; at s = 0 and s = 1 three of the four vanish exactly.
  const auto at = static_cast<std::size_t>(i - stencil.first);
  stencil.weight[at] += (1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s);
  stencil.weight[at + 1] += s * s * (3.0 - 2.0 * s);
  add_tangent(stencil, i, count, s * (1.0 - s) * (1.0 - s));
  add_tangent(stencil, i + 1, count, s * s * (s - 1.0));
  return stencil;
}

template <typename Output>
void apply(const Stencil& stencil, const Eigen::Ref<const Eigen::MatrixXd>& columns,
           Output&& output) {
  output = stencil.weight[0] * columns.col(stencil.first);
  for (int m = 1; m < stencil.size; ++m) {
    output += stencil.weight[static_cast<std::size_t>(m)] * columns.col(stencil.first + m);
  }
}

void require_columns(const Eigen::Ref<const Eigen::MatrixXd>& columns) {
  if (columns.cols() < 1) {
    throw base::Error(base::ErrorKind::kUsage, "interpolate: the sequence has no frame");
  }
}

}  // namespace

Eigen::VectorXd interpolate(const Eigen::Ref<const Eigen::MatrixXd>& columns, double frame) {
  require_columns(columns);
  Eigen::VectorXd value(columns.rows());
  apply(stencil_at(frame, columns.cols()), columns, value);
  return value;
}

Eigen::MatrixXd interpolate(const Eigen::Ref<const Eigen::MatrixXd>& columns,
                            std::span<const double> frames) {
  require_columns(columns);
  Eigen::MatrixXd values(columns.rows(), static_cast<Index>(frames.size()));
  for (Index k = 0; k < values.cols(); ++k) {
    apply(stencil_at(frames[static_cast<std::size_t>(k)], columns.cols()), columns, values.col(k));
  }
  return values;
}

}  // namespace laban::math
