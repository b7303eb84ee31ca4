#pragma once

#include <string>
#include <vector>

#include "laban/draw/format.h"
#include "laban/draw/line_chart.h"

namespace laban::draw {

/// One bar in every group, all of one color: a regressor of Table 1.
struct BarSeries {
  std::string name;
  std::vector<double> values;      ///< one a group; a value that is not finite leaves a gap
  std::vector<double> errors;      ///< empty, or one a group, >= 0: half length of the error bar
  std::vector<double> references;  ///< empty, or one a group: a diamond, e.g. the paper's number
};

/// Grouped bars with error bars: mean squared error by model, grouped by Effort factor.
struct BarChart {
  std::string title;
  std::vector<std::string> groups;  ///< names below the groups
  std::vector<BarSeries> series;
  Axis y;
  std::string reference_name;  ///< what the diamonds are, in the legend
  bool show_values = true;     ///< write each value above its bar
};

/// @returns bytes of a PNG or SVG file. In SVG, each bar is a group of class "bar".
/// @throws Error{kUsage} if `options` has problems, there is no group or no series, or the axis has
///         min >= max or an end that is not finite; Error{kData} naming the series if a size is not
///         the number of groups or an error is negative.
[[nodiscard]] std::string bar_chart(const BarChart& chart, const ChartOptions& options = {});

}  // namespace laban::draw
