#pragma once

#include <optional>
#include <string>
#include <vector>

#include "laban/draw/format.h"

namespace laban::draw {

/// An axis of a chart. An end that is not set follows the data, rounded outwards to a tick.
struct Axis {
  std::string label;
  std::optional<double> min;
  std::optional<double> max;
};

/// A curve through points (x, y), in their order. A point that is not finite breaks the curve.
struct Curve {
  std::string name;  ///< in the legend; curves of one name share a color and one legend entry
  std::vector<double> x;
  std::vector<double> y;          ///< as many as x
  std::vector<double> band_low;   ///< empty, or as many as x: lower edge of a shaded band
  std::vector<double> band_high;  ///< with band_low: its upper edge
  bool line = true;               ///< draw the line
  bool markers = false;           ///< draw a dot at each point
  bool dashed = false;
};

/// A span of x shaded grey, e.g. the trained range of alpha or a snippet of a clip.
struct ShadedSpan {
  double begin = 0.0;
  double end = 0.0;
  std::string label;  ///< at its top; may be empty
};

/// One set of axes.
struct ChartPanel {
  std::string title;
  Axis x;
  Axis y;
  std::vector<Curve> curves;
  std::vector<ShadedSpan> spans;
  std::vector<double> marks_x;  ///< dashed vertical lines, e.g. joins
};

/// Panels in reading order; curves of one name have one color in all of them, and one legend
/// stands above them all.
struct LineChart {
  std::string title;
  std::vector<ChartPanel> panels;
  int columns = 0;  ///< panels a row; 0 puts all into one row
};

/// Curves as a picture: Effort against alpha (Figure 1 of [Torresani06]: x from -0.5 to 1.5, y from
/// -3 to 3), Effort over time. Curves are clipped to the axes given. A panel without a finite point
/// shows its axes and "no data".
///
/// @returns bytes of a PNG or SVG file. In SVG, each curve is a group of class "curve".
/// @throws Error{kUsage} if `options` has problems, there is no panel, columns < 0, or an axis has
///         min >= max or an end that is not finite; Error{kData} naming panel and curve if sizes
///         differ.
[[nodiscard]] std::string line_chart(const LineChart& chart, const ChartOptions& options = {});

}  // namespace laban::draw
