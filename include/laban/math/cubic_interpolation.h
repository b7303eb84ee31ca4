#pragma once

#include <span>

#include <Eigen/Dense>

namespace laban::math {

/// The value of a D x F sequence at a fractional frame: the one interpolator of the library
/// (METHODS 0).
///
/// A cubic Hermite curve through the columns with central-difference tangents (Catmull-Rom), at the
/// two ends one-sided differences of the same order: continuously differentiable, exact at whole
/// frames, linear in the columns, exact for a sequence that is quadratic in time, and the same
/// played backwards. F = 1 is constant, F = 2 a straight line.
///
/// @param columns  D x F, a column is a frame, F >= 1. Angles must be unwrapped before.
/// @param frame    clamped to [0, F - 1].
/// @returns D values.
/// @throws Error{kUsage} if there is no column or `frame` is not a number.
[[nodiscard]] Eigen::VectorXd interpolate(const Eigen::Ref<const Eigen::MatrixXd>& columns,
                                          double frame);

/// The same at many frames, in any order: D x frames.size().
[[nodiscard]] Eigen::MatrixXd interpolate(const Eigen::Ref<const Eigen::MatrixXd>& columns,
                                          std::span<const double> frames);

}  // namespace laban::math
