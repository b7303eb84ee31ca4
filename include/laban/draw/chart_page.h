#pragma once

#include <span>
#include <string>
#include <variant>

#include "laban/draw/format.h"
#include "laban/draw/line_chart.h"
#include "laban/draw/matrix_chart.h"

namespace laban::draw {

/// A chart and where on a page it stands, units from the top left corner.
struct ChartTile {
  std::variant<MatrixChart, LineChart> chart;
  double x = 0.0;
  double y = 0.0;
  double width = 0.0;   ///< 100 .. 10000
  double height = 0.0;  ///< 100 .. 10000
};

/// Several charts in one picture.
/// @returns bytes of a PNG or SVG file.
/// @throws as matrix_chart and line_chart; Error{kUsage} if there is no tile.
[[nodiscard]] std::string chart_page(std::span<const ChartTile> tiles,
                                     const ChartOptions& options = {});

}  // namespace laban::draw
