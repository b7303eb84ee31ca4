#include "laban/draw/matrix_chart.h"

#include <array>
#include <cmath>

#include "draw/axes.h"
#include "draw/charts.h"
#include "draw/options.h"

namespace laban::draw {
namespace {

constexpr double kSmallestLabel = 5.5;  // units: below, labels are left out
constexpr double kLargestLabel = 11.0;
constexpr double kGroupLine = 18.0;
constexpr double kBarWidth = 14.0;
constexpr double kBarGap = 18.0;
constexpr int kColorSteps = 256;

// Nine points of viridis (matplotlib, public domain), evenly spaced.
constexpr std::array<Color, 9> kViridis = {rgb(0x440154), rgb(0x472d7b), rgb(0x3b528b),
                                           rgb(0x2c728e), rgb(0x21918c), rgb(0x28ae80),
                                           rgb(0x5ec962), rgb(0xaddc30), rgb(0xfde725)};

Color viridis(double share) {
  const double at = std::clamp(share, 0.0, 1.0) * (kViridis.size() - 1.0);
  const auto below = std::min(static_cast<std::size_t>(at), kViridis.size() - 2);
  return mix(kViridis[below], kViridis[below + 1], at - static_cast<double>(below));
}

double luminance(const Color& color) {
  return 0.299 * color.red + 0.587 * color.green + 0.114 * color.blue;
}

[[noreturn]] void refuse(const std::string& what) {
  throw base::Error(base::ErrorKind::kData, "matrix_chart: " + what);
}

void check_labels(std::string_view what, const std::vector<std::string>& labels,
                  const std::vector<MatrixGroup>& groups, Eigen::Index count) {
  if (!labels.empty() && static_cast<Eigen::Index>(labels.size()) != count) {
    refuse(std::to_string(labels.size()) + " " + std::string(what) + " labels for " +
           std::to_string(count) + " (must be as many, or none)");
  }
  for (const MatrixGroup& group : groups) {
    if (group.begin >= 0 && group.begin < group.end && group.end <= count) continue;
    refuse(std::string(what) + " group '" + group.name + "' is [" + std::to_string(group.begin) +
           ", " + std::to_string(group.end) + ") of " + std::to_string(count) +
           " (must be inside, not empty)");
  }
}

void check_chart(const MatrixChart& chart, const ChartOptions& options) {
  throw_first_problem("matrix_chart", options.problems());
  if (chart.values.size() == 0) refuse("the matrix is empty (give at least one value)");
  check_labels("row", chart.row_labels, chart.row_groups, chart.values.rows());
  check_labels("column", chart.column_labels, chart.column_groups, chart.values.cols());
}

Scale scale_of(const MatrixChart& chart) {
  const std::vector<double> values(chart.values.data(), chart.values.data() + chart.values.size());
  double low = HUGE_VAL;
  double high = -HUGE_VAL;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  Axis axis{.label = {}, .min = chart.min, .max = chart.max};
  // Unlike an axis, the color scale ends with the data: rounding would waste colors.
  if (low < high) {
    if (!axis.min && (!axis.max || low < *axis.max)) axis.min = low;
    if (!axis.max && (!axis.min || high > *axis.min)) axis.max = high;
  }
  return make_scale(axis, values, 6, "matrix_chart");
}

int color_step(const Scale& scale, double value) {
  const double share = std::clamp((value - scale.min) / (scale.max - scale.min), 0.0, 1.0);
  return static_cast<int>(std::lround(share * (kColorSteps - 1)));
}

Color step_color(int step) {
  return viridis(step / (kColorSteps - 1.0));
}

struct Grid {
  Box box;
  double cell = 0.0;
  double label_size = 0.0;  // 0: no labels

  [[nodiscard]] double x(Eigen::Index column) const {
    return box.x + cell * static_cast<double>(column);
  }
  [[nodiscard]] double y(Eigen::Index row) const { return box.y + cell * static_cast<double>(row); }
};

double widest(const std::vector<std::string>& labels, double size) {
  double width = 0.0;
  for (const std::string& label : labels) width = std::max(width, text_width(label, size));
  return labels.empty() || size == 0.0 ? 0.0 : width + 8.0;
}

double widest_group(const std::vector<MatrixGroup>& groups) {
  double width = 0.0;
  for (const MatrixGroup& group : groups) {
    width = std::max(width, text_width(group.name, kLargestLabel, true) + 12.0);
  }
  return width;
}

// Cells are as large as they can be beside labels whose size follows the cells': a few rounds of
// shrinking the labels settle it.
Grid lay_out(const MatrixChart& chart, const Scale& scale, double top,
             const ChartOptions& options) {
  const auto rows = static_cast<double>(chart.values.rows());
  const auto columns = static_cast<double>(chart.values.cols());
  Grid grid;
  double size = kLargestLabel;
  constexpr int kRounds = 4;
  const double bar =
      kBarGap + kBarWidth + label_room(scale) + (chart.value_label.empty() ? 0.0 : 18.0);
  for (int round = 0; round < kRounds; ++round) {
    const double left =
        kChartMargin + widest_group(chart.row_groups) + widest(chart.row_labels, size);
    const double below = widest(chart.column_labels, size);
    const double head = chart.column_groups.empty() ? 0.0 : kGroupLine;
    const double width = options.width - left - bar - kChartMargin;
    const double height = options.height - top - head - below - kChartMargin;
    grid.cell = std::max(std::min(width / columns, height / rows), 0.1);
    grid.box = {left, top + head, grid.cell * columns, grid.cell * rows};
    grid.label_size = size;
    if (size <= 0.9 * grid.cell) break;
    size = std::min(kLargestLabel, 0.85 * grid.cell);
    if (size < kSmallestLabel) size = 0.0;
  }
  return grid;
}

// Neighbours of one color are one rectangle.
void draw_cells(Canvas& canvas, const MatrixChart& chart, const Scale& scale, const Grid& grid) {
  for (Eigen::Index r = 0; r < chart.values.rows(); ++r) {
    for (Eigen::Index begin = 0; begin < chart.values.cols();) {
      const double value = chart.values(r, begin);
      Eigen::Index end = begin + 1;
      if (std::isnan(value)) {
        begin = end;
        continue;
      }
      const int step = color_step(scale, value);
      while (end < chart.values.cols() && !std::isnan(chart.values(r, end)) &&
             color_step(scale, chart.values(r, end)) == step) {
        ++end;
      }
      canvas.rectangle({grid.x(begin), grid.y(r), grid.x(end) - grid.x(begin), grid.cell},
                       step_color(step));
      begin = end;
    }
  }
}

void draw_values(Canvas& canvas, const MatrixChart& chart, const Scale& scale, const Grid& grid) {
  if (!chart.show_values) return;
  const double size = std::min(kLargestLabel, 0.4 * grid.cell);
  if (size < kSmallestLabel) return;
  const bool whole =
      (chart.values.array().isNaN() || (chart.values.array() == chart.values.array().round()))
          .all();
  const int decimals = whole ? 0 : std::max(2, scale.decimals);
  for (Eigen::Index r = 0; r < chart.values.rows(); ++r) {
    for (Eigen::Index c = 0; c < chart.values.cols(); ++c) {
      const double value = chart.values(r, c);
      if (!std::isfinite(value)) continue;
      const std::string text = fixed_number(value, decimals);
      if (text_width(text, size) > grid.cell - 2.0) continue;
      const bool bright = luminance(step_color(color_step(scale, value))) > 0.55;
      canvas.text({grid.x(c) + 0.5 * grid.cell, grid.y(r) + 0.5 * grid.cell + 0.36 * size}, text,
                  {.size = size, .color = bright ? kInk : kWhite, .anchor = Anchor::kMiddle});
    }
  }
}

void draw_labels(Canvas& canvas, const MatrixChart& chart, const Grid& grid) {
  const double size = grid.label_size;
  if (size == 0.0) return;
  for (std::size_t r = 0; r < chart.row_labels.size(); ++r) {
    const double y = grid.y(static_cast<Eigen::Index>(r)) + 0.5 * grid.cell + 0.36 * size;
    canvas.text({grid.box.x - 5.0, y}, chart.row_labels[r], {.size = size, .anchor = Anchor::kEnd});
  }
  for (std::size_t c = 0; c < chart.column_labels.size(); ++c) {
    const double x = grid.x(static_cast<Eigen::Index>(c)) + 0.5 * grid.cell + 0.36 * size;
    canvas.text({x, grid.box.y + grid.box.height + 5.0}, chart.column_labels[c],
                {.size = size, .anchor = Anchor::kEnd, .upward = true});
  }
}

void draw_row_groups(Canvas& canvas, const MatrixChart& chart, const Grid& grid, double left) {
  for (const MatrixGroup& group : chart.row_groups) {
    const double middle = 0.5 * (grid.y(group.begin) + grid.y(group.end));
    canvas.text({left, middle + 0.36 * kLargestLabel}, group.name,
                {.size = kLargestLabel, .color = kInk, .bold = true});
    if (group.begin == 0) continue;
    const double y = grid.y(group.begin);
    canvas.line({grid.box.x, y}, {grid.box.x + grid.box.width, y},
                {.color = kWhite, .width = 1.6, .round_caps = false});
  }
}

void draw_column_groups(Canvas& canvas, const MatrixChart& chart, const Grid& grid) {
  for (const MatrixGroup& group : chart.column_groups) {
    const double width = grid.x(group.end) - grid.x(group.begin);
    canvas.text({grid.x(group.begin) + 0.5 * width, grid.box.y - 6.0},
                fit_text(group.name, kLargestLabel, true, width),
                {.size = kLargestLabel, .color = kInk, .anchor = Anchor::kMiddle, .bold = true});
    if (group.begin == 0) continue;
    const double x = grid.x(group.begin);
    canvas.line({x, grid.box.y}, {x, grid.box.y + grid.box.height},
                {.color = kWhite, .width = 1.6, .round_caps = false});
  }
}

void draw_color_bar(Canvas& canvas, const MatrixChart& chart, const Scale& scale,
                    const Grid& grid) {
  const double height = std::min(grid.box.height, 260.0);
  const Box bar{grid.box.x + grid.box.width + kBarGap, grid.box.y, kBarWidth, height};
  constexpr int kSlices = 64;
  for (int i = 0; i < kSlices; ++i) {
    const double slice = height / kSlices;
    canvas.rectangle({bar.x, bar.y + slice * i, bar.width, slice},
                     viridis(1.0 - (i + 0.5) / kSlices));
  }
  const PlotArea area{bar, {}, scale};
  for (const double tick : scale.ticks) {
    const double y = area.to_y(tick);
    const double right = bar.x + bar.width;
    canvas.line({right, y}, {right + 4.0, y}, {.color = kHairline});
    canvas.text({right + 7.0, y + 0.36 * kTickSize}, tick_label(scale, tick), {.size = kTickSize});
  }
  if (chart.value_label.empty()) return;
  canvas.text({bar.x + bar.width + label_room(scale) + 12.0, bar.y + 0.5 * height},
              fit_text(chart.value_label, kTickSize, false, height),
              {.size = kTickSize, .anchor = Anchor::kMiddle, .upward = true});
}

}  // namespace

void paint(Canvas& canvas, const MatrixChart& chart, const ChartOptions& options) {
  check_chart(chart, options);
  const Scale scale = scale_of(chart);
  const double top = draw_chart_title(canvas, chart.title, options.width);
  const Grid grid = lay_out(chart, scale, top, options);
  draw_cells(canvas, chart, scale, grid);
  draw_values(canvas, chart, scale, grid);
  draw_row_groups(canvas, chart, grid, kChartMargin);
  draw_column_groups(canvas, chart, grid);
  draw_labels(canvas, chart, grid);
  draw_color_bar(canvas, chart, scale, grid);
}

std::string matrix_chart(const MatrixChart& chart, const ChartOptions& options) {
  check_chart(chart, options);
  const auto canvas = make_canvas(options.format, options.width, options.height,
                                  options.pixel_ratio, "matrix_chart");
  paint(*canvas, chart, options);
  return canvas->finish();
}

}  // namespace laban::draw
