#include "laban/draw/line_chart.h"

#include <cmath>

#include "laban/base/error.h"

#include "draw/axes.h"
#include "draw/charts.h"
#include "draw/options.h"

namespace laban::draw {
namespace {

constexpr double kPanelGapX = 22.0;
constexpr double kPanelGapY = 14.0;

std::string panel_place(std::size_t panel) {
  return std::string("line_chart: panel ").append(std::to_string(panel));
}

void check_curve(const Curve& curve, std::size_t panel, std::size_t index) {
  const auto count = curve.x.size();
  const bool no_band = curve.band_low.empty() && curve.band_high.empty();
  const bool band = curve.band_low.size() == count && curve.band_high.size() == count;
  if (curve.y.size() == count && (no_band || band)) return;
  throw base::Error(base::ErrorKind::kData,
                    panel_place(panel) + ", curve " + std::to_string(index) + ": " +
                        std::to_string(count) + " x, " + std::to_string(curve.y.size()) + " y, " +
                        std::to_string(curve.band_low.size()) + " and " +
                        std::to_string(curve.band_high.size()) + " of the band (must agree)");
}

// Names in order of appearance: their order is their color.
std::vector<std::string> names_of(const LineChart& chart) {
  std::vector<std::string> names;
  for (const ChartPanel& panel : chart.panels) {
    for (const Curve& curve : panel.curves) {
      if (std::find(names.begin(), names.end(), curve.name) == names.end()) {
        names.push_back(curve.name);
      }
    }
  }
  return names;
}

Color color_of(const std::vector<std::string>& names, const Curve& curve) {
  const auto at = std::find(names.begin(), names.end(), curve.name);
  return series_color(static_cast<int>(at - names.begin()));
}

std::vector<LegendEntry> legend_of(const LineChart& chart, const std::vector<std::string>& names) {
  std::vector<LegendEntry> entries;
  for (const std::string& name : names) {
    if (name.empty()) continue;
    const Curve* first = nullptr;
    for (const ChartPanel& panel : chart.panels) {
      for (const Curve& curve : panel.curves) {
        if (first == nullptr && curve.name == name) first = &curve;
      }
    }
    LABAN_CHECK(first != nullptr);  // names are those of the curves
    const Swatch line = first->dashed ? Swatch::kDashedLine : Swatch::kLine;
    entries.push_back({name, color_of(names, *first), first->line ? line : Swatch::kDot});
  }
  return entries;
}

PlotArea scales_of(const ChartPanel& panel, std::size_t index, double width, double height) {
  std::vector<double> xs;
  std::vector<double> ys;
  for (const Curve& curve : panel.curves) {
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      if (!std::isfinite(curve.x[i]) || !std::isfinite(curve.y[i])) continue;
      xs.push_back(curve.x[i]);
      ys.push_back(curve.y[i]);
      if (curve.band_low.empty()) continue;
      ys.push_back(curve.band_low[i]);
      ys.push_back(curve.band_high[i]);
    }
  }
  PlotArea area;
  // Wide plots need few ticks for their width, narrow ones as many as have room for their labels.
  const double ticks = std::min(width / 65.0, std::max(4.0, width / 90.0));
  area.x = make_scale(panel.x, xs, std::clamp(static_cast<int>(ticks), 2, 10),
                      panel_place(index) + ", x");
  // A curve over its own span needs no empty rim: x ends with the data.
  if (!xs.empty()) {
    const auto ends = std::minmax_element(xs.begin(), xs.end());
    if (!panel.x.min && *ends.first < *ends.second) area.x.min = *ends.first;
    if (!panel.x.max && *ends.first < *ends.second) area.x.max = *ends.second;
    std::erase_if(area.x.ticks, [&area](double tick) {
      const double rim = 1e-9 * (area.x.max - area.x.min);
      return tick < area.x.min - rim || tick > area.x.max + rim;
    });
  }
  area.y = make_scale(panel.y, ys, std::clamp(static_cast<int>(height / 26.0), 2, 8),
                      panel_place(index) + ", y");
  return area;
}

// Within the canvas's number range, whatever the data; the clip hides what is outside.
Point place_point(const PlotArea& area, double x, double y) {
  return {std::clamp(area.to_x(x), -1e5, 1e5), std::clamp(area.to_y(y), -1e5, 1e5)};
}

// Maximal runs [begin, end) in which every value is finite.
struct Run {
  std::size_t begin = 0;
  std::size_t end = 0;
};

std::vector<Run> finite_runs(const std::vector<double>& x, const std::vector<double>& a,
                             const std::vector<double>& b) {
  std::vector<Run> runs;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i]) || !std::isfinite(a[i]) || !std::isfinite(b[i])) continue;
    if (runs.empty() || runs.back().end != i) runs.push_back({i, i});
    runs.back().end = i + 1;
  }
  return runs;
}

void draw_band(Canvas& canvas, const PlotArea& area, const Curve& curve, const Color& color) {
  if (curve.band_low.empty()) return;
  for (const Run& run : finite_runs(curve.x, curve.band_low, curve.band_high)) {
    std::vector<Point> outline;
    for (std::size_t i = run.begin; i < run.end; ++i) {
      outline.push_back(place_point(area, curve.x[i], curve.band_high[i]));
    }
    for (std::size_t i = run.end; i-- > run.begin;) {
      outline.push_back(place_point(area, curve.x[i], curve.band_low[i]));
    }
    canvas.polygon(outline, with_alpha(color, 0.16));
  }
}

void draw_curve(Canvas& canvas, const PlotArea& area, const Curve& curve, const Color& color) {
  canvas.begin_group("curve");
  for (const Run& run : finite_runs(curve.x, curve.y, curve.y)) {
    std::vector<Point> points;
    for (std::size_t i = run.begin; i < run.end; ++i) {
      points.push_back(place_point(area, curve.x[i], curve.y[i]));
    }
    if (curve.line) {
      canvas.polyline(points, {.color = color, .width = 1.9, .dashed = curve.dashed});
    }
  }
  canvas.end_group();
}

// Markers on the axes' ends stay whole, those outside are left out.
void draw_markers(Canvas& canvas, const PlotArea& area, const Curve& curve, const Color& color) {
  for (const Run& run : finite_runs(curve.x, curve.y, curve.y)) {
    // A lone point has no line to be seen by.
    const bool lone = run.end - run.begin == 1;
    if (!curve.markers && curve.line && !lone) continue;
    for (std::size_t i = run.begin; i < run.end; ++i) {
      const bool inside = curve.x[i] >= area.x.min && curve.x[i] <= area.x.max &&
                          curve.y[i] >= area.y.min && curve.y[i] <= area.y.max;
      if (!inside) continue;
      canvas.circle(place_point(area, curve.x[i], curve.y[i]), 4.0, kWhite);
      canvas.circle(place_point(area, curve.x[i], curve.y[i]), 3.0, color);
    }
  }
}

void draw_spans(Canvas& canvas, const PlotArea& area, const ChartPanel& panel) {
  for (const ShadedSpan& span : panel.spans) {
    if (!std::isfinite(span.begin) || !std::isfinite(span.end)) continue;
    const double left = std::clamp(span.begin, area.x.min, area.x.max);
    const double right = std::clamp(span.end, area.x.min, area.x.max);
    if (left >= right) continue;
    const double x = area.to_x(left);
    const double width = area.to_x(right) - x;
    canvas.rectangle({x, area.box.y, width, area.box.height}, rgb(0xf5f6f8));
    canvas.text({x + 0.5 * width, area.box.y + kTickSize + 2.0},
                fit_text(span.label, kTickSize - 1.0, false, width - 4.0),
                {.size = kTickSize - 1.0, .anchor = Anchor::kMiddle});
  }
}

void draw_marks(Canvas& canvas, const PlotArea& area, const ChartPanel& panel) {
  for (const double mark : panel.marks_x) {
    if (!(mark >= area.x.min && mark <= area.x.max)) continue;
    const double x = area.to_x(mark);
    canvas.line({x, area.box.y}, {x, area.box.y + area.box.height},
                {.color = kSoftInk, .width = 0.9, .dashed = true});
  }
}

bool has_point(const ChartPanel& panel) {
  return std::any_of(panel.curves.begin(), panel.curves.end(), [](const Curve& curve) {
    return !finite_runs(curve.x, curve.y, curve.y).empty();
  });
}

void draw_panel(Canvas& canvas, const ChartPanel& panel, const PlotArea& area,
                const std::vector<std::string>& names) {
  const Box& box = area.box;
  canvas.begin_group("panel");
  if (!panel.title.empty()) {
    canvas.text({box.x, box.y - 8.0}, fit_text(panel.title, kPanelTitleSize, true, box.width),
                {.size = kPanelTitleSize, .color = kInk, .bold = true});
  }
  draw_spans(canvas, area, panel);
  draw_vertical_axis(canvas, area, panel.y.label);
  draw_horizontal_axis(canvas, area, panel.x.label);
  draw_marks(canvas, area, panel);
  canvas.begin_clip(box);
  for (const Curve& curve : panel.curves) draw_band(canvas, area, curve, color_of(names, curve));
  canvas.end_clip();
  constexpr double kEdge = 1.0;  // half of a line's width: one along the edge stays whole
  canvas.begin_clip(
      {box.x - kEdge, box.y - kEdge, box.width + 2.0 * kEdge, box.height + 2.0 * kEdge});
  for (const Curve& curve : panel.curves) draw_curve(canvas, area, curve, color_of(names, curve));
  canvas.end_clip();
  for (const Curve& curve : panel.curves) draw_markers(canvas, area, curve, color_of(names, curve));
  if (!has_point(panel)) {
    canvas.text({box.x + 0.5 * box.width, box.y + 0.5 * box.height}, "no data",
                {.size = kPanelTitleSize, .anchor = Anchor::kMiddle});
  }
  canvas.end_group();
}

void check_chart(const LineChart& chart, const ChartOptions& options) {
  throw_first_problem("line_chart", options.problems());
  if (chart.panels.empty()) {
    throw base::Error(base::ErrorKind::kUsage, "line_chart: no panel (give at least one)");
  }
  if (chart.columns < 0) {
    throw base::Error(
        base::ErrorKind::kUsage,
        "line_chart: columns = " + std::to_string(chart.columns) + " (must be at least 0)");
  }
  for (std::size_t p = 0; p < chart.panels.size(); ++p) {
    for (std::size_t c = 0; c < chart.panels[p].curves.size(); ++c) {
      check_curve(chart.panels[p].curves[c], p, c);
    }
  }
}

// The plot inside a panel's cell, once there is room for titles, ticks and labels.
Box plot_box(const ChartPanel& panel, const Box& cell, double left) {
  const double top = panel.title.empty() ? 8.0 : kPanelTitleSize + 12.0;
  const double bottom = panel.x.label.empty() ? 22.0 : 40.0;
  constexpr double kRight = 10.0;  // half of the last tick's label
  return {cell.x + left, cell.y + top, std::max(cell.width - left - kRight, 1.0),
          std::max(cell.height - top - bottom, 1.0)};
}

}  // namespace

void paint(Canvas& canvas, const LineChart& chart, const ChartOptions& options) {
  check_chart(chart, options);
  const std::vector<std::string> names = names_of(chart);
  const double width = options.width - 2.0 * kChartMargin;
  double top = draw_chart_title(canvas, chart.title, options.width);
  const auto legend = legend_of(chart, names);
  if (!legend.empty()) top += draw_legend(&canvas, legend, kChartMargin, top, width) + 6.0;
  const std::size_t count = chart.panels.size();
  const std::size_t columns =
      chart.columns == 0 ? count : std::min(count, static_cast<std::size_t>(chart.columns));
  const std::size_t rows = (count + columns - 1) / columns;
  const auto share = [](double room, double gap, std::size_t parts) {
    return (room - gap * static_cast<double>(parts - 1)) / static_cast<double>(parts);
  };
  const double cell_width = share(width, kPanelGapX, columns);
  const double cell_height = share(options.height - top - 8.0, kPanelGapY, rows);
  std::vector<PlotArea> areas;
  double left = 0.0;  // of every panel, so that plots are of one size and stand in line
  for (std::size_t p = 0; p < count; ++p) {
    areas.push_back(scales_of(chart.panels[p], p, cell_width, cell_height));
    const double label = chart.panels[p].y.label.empty() ? 0.0 : 18.0;
    left = std::max(left, label_room(areas.back().y) + label);
  }
  for (std::size_t p = 0; p < count; ++p) {
    const std::size_t column = p % columns;
    const std::size_t row = p / columns;
    const Box cell{kChartMargin + static_cast<double>(column) * (cell_width + kPanelGapX),
                   top + static_cast<double>(row) * (cell_height + kPanelGapY), cell_width,
                   cell_height};
    areas[p].box = plot_box(chart.panels[p], cell, left);
    draw_panel(canvas, chart.panels[p], areas[p], names);
  }
}

std::string line_chart(const LineChart& chart, const ChartOptions& options) {
  check_chart(chart, options);
  const auto canvas =
      make_canvas(options.format, options.width, options.height, options.pixel_ratio, "line_chart");
  paint(*canvas, chart, options);
  return canvas->finish();
}

}  // namespace laban::draw
