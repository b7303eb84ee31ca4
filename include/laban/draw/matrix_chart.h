#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/draw/format.h"

namespace laban::draw {

/// Rows or columns [begin, end) that belong together, e.g. a content group.
struct MatrixGroup {
  std::string name;
  int begin = 0;
  int end = 0;
};

/// A heat map: cell (r, c) is colored by values(r, c), row 0 at the top; NaN is left white.
struct MatrixChart {
  std::string title;
  Eigen::MatrixXd values;                  ///< R x C, R and C >= 1
  std::vector<std::string> row_labels;     ///< empty or R; left out where too small to read
  std::vector<std::string> column_labels;  ///< empty or C
  std::vector<MatrixGroup> row_groups;     ///< separated by white lines and named in bold
  std::vector<MatrixGroup> column_groups;
  std::string value_label;    ///< of the color scale, with its unit
  std::optional<double> min;  ///< of the color scale; the data's when not set
  std::optional<double> max;
  bool show_values = false;  ///< write the value into each cell, where it fits
};

/// A matrix as a picture: a distance matrix sorted by content group. The color scale is
/// perceptually even and safe for the color-blind (viridis), dark for small values.
///
/// @param options  the cells are square and as large as width and height allow.
/// @returns bytes of a PNG or SVG file.
/// @throws Error{kUsage} if `options` has problems or min >= max; Error{kData} if the matrix is
///         empty, or labels or groups do not fit it.
[[nodiscard]] std::string matrix_chart(const MatrixChart& chart, const ChartOptions& options = {});

}  // namespace laban::draw
