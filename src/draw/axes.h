#pragma once

#include <span>
#include <string>
#include <vector>

#include "laban/draw/line_chart.h"

#include "draw/canvas.h"

namespace laban::draw {

// Units on the page that all charts share.
inline constexpr double kChartMargin = 20.0;
inline constexpr double kChartTitleSize = 16.0;
inline constexpr double kPanelTitleSize = 12.5;
inline constexpr double kTickSize = 10.5;

/// A range of an axis with its ticks.
struct Scale {
  double min = 0.0;
  double max = 1.0;
  std::vector<double> ticks;
  int decimals = 0;  ///< of the tick labels
};

/// The range of `axis`: its own ends where set, else those of `values` (those that are finite)
/// rounded outwards to a tick; 0 .. 1 without values.
/// @param most_ticks  about how many ticks fit, >= 2.
/// @throws Error{kUsage} "place: ..." if an end is not finite or min >= max.
[[nodiscard]] Scale make_scale(const Axis& axis, std::span<const double> values, int most_ticks,
                               std::string_view place);

[[nodiscard]] std::string tick_label(const Scale& scale, double tick);

/// Room that the tick labels of a vertical axis need, units.
[[nodiscard]] double label_room(const Scale& scale);

/// From data to the canvas.
struct PlotArea {
  Box box;
  Scale x;
  Scale y;

  [[nodiscard]] double to_x(double value) const {
    return box.x + box.width * ((value - x.min) / (x.max - x.min));
  }
  [[nodiscard]] double to_y(double value) const {
    return box.y + box.height * ((y.max - value) / (y.max - y.min));
  }
};

/// Horizontal grid lines, a stronger one at 0, tick labels and axis label of the vertical axis.
void draw_vertical_axis(Canvas& canvas, const PlotArea& area, const std::string& label);

/// Ticks, their labels and the axis label below the plot.
void draw_horizontal_axis(Canvas& canvas, const PlotArea& area, const std::string& label);

enum class Swatch { kLine, kDashedLine, kDot, kBox, kDiamond };

struct LegendEntry {
  std::string name;
  Color color;
  Swatch swatch = Swatch::kLine;
};

/// Entries from (x, y) to the right, in as many lines as `width` needs.
/// @returns the height used, units; draws nothing if `canvas` is null.
double draw_legend(Canvas* canvas, const std::vector<LegendEntry>& entries, double x, double y,
                   double width);

/// The chart's title at the top left, if any. @returns the y below it.
double draw_chart_title(Canvas& canvas, const std::string& title, double width);

void draw_diamond(Canvas& canvas, const Point& center, double radius, const Color& fill);

}  // namespace laban::draw
