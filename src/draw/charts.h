#pragma once

#include "laban/draw/line_chart.h"
#include "laban/draw/matrix_chart.h"

#include "draw/canvas.h"

namespace laban::draw {

/// Charts drawn on a page that is there: options.width and height are theirs.
/// @throws as matrix_chart and line_chart.
void paint(Canvas& canvas, const MatrixChart& chart, const ChartOptions& options);
void paint(Canvas& canvas, const LineChart& chart, const ChartOptions& options);

}  // namespace laban::draw
