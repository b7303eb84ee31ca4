#include "laban/draw/bar_chart.h"

#include <cmath>

#include "draw/axes.h"
#include "draw/options.h"

namespace laban::draw {
namespace {

constexpr double kGroupShare = 0.82;  // of a group's width that its bars fill

void check_sizes(const BarChart& chart, const BarSeries& series) {
  const auto groups = chart.groups.size();
  const auto fits = [groups](const std::vector<double>& values) {
    return values.empty() || values.size() == groups;
  };
  const bool sizes =
      series.values.size() == groups && fits(series.errors) && fits(series.references);
  if (!sizes) {
    throw base::Error(base::ErrorKind::kData,
                      "bar_chart: series '" + series.name + "' has " +
                          std::to_string(series.values.size()) + " values, " +
                          std::to_string(series.errors.size()) + " errors and " +
                          std::to_string(series.references.size()) + " references for " +
                          std::to_string(groups) + " groups (one a group)");
  }
  for (const double error : series.errors) {
    if (!(error < 0.0)) continue;
    throw base::Error(base::ErrorKind::kData, "bar_chart: series '" + series.name +
                                                  "' has the error " + short_number(error, 6) +
                                                  " (must be at least 0)");
  }
}

void check_chart(const BarChart& chart, const ChartOptions& options) {
  throw_first_problem("bar_chart", options.problems());
  if (chart.groups.empty() || chart.series.empty()) {
    throw base::Error(base::ErrorKind::kUsage,
                      "bar_chart: " + std::to_string(chart.groups.size()) + " groups and " +
                          std::to_string(chart.series.size()) + " series (at least one of each)");
  }
  for (const BarSeries& series : chart.series) check_sizes(chart, series);
}

double error_at(const BarSeries& series, std::size_t group) {
  const bool known = !series.errors.empty() && std::isfinite(series.errors[group]);
  return known ? series.errors[group] : 0.0;
}

std::vector<double> heights_of(const BarChart& chart) {
  std::vector<double> heights = {0.0};
  for (const BarSeries& series : chart.series) {
    for (std::size_t g = 0; g < chart.groups.size(); ++g) {
      heights.push_back(series.values[g] + error_at(series, g));
      heights.push_back(series.values[g] - error_at(series, g));
      if (!series.references.empty()) heights.push_back(series.references[g]);
    }
  }
  return heights;
}

std::vector<LegendEntry> legend_of(const BarChart& chart) {
  std::vector<LegendEntry> entries;
  bool references = false;
  for (std::size_t s = 0; s < chart.series.size(); ++s) {
    entries.push_back({chart.series[s].name, series_color(static_cast<int>(s)), Swatch::kBox});
    references = references || !chart.series[s].references.empty();
  }
  if (references) {
    entries.push_back({chart.reference_name.empty() ? "reference" : chart.reference_name, kInk,
                       Swatch::kDiamond});
  }
  return entries;
}

double place(const PlotArea& area, double value) {
  return area.to_y(std::clamp(value, area.y.min, area.y.max));
}

// Where the value is written: beyond the error bar, and beyond the diamond if that is in the way.
double value_baseline(const PlotArea& area, const BarSeries& series, std::size_t group,
                      double size) {
  const double value = series.values[group];
  const double error = error_at(series, group);
  if (value < 0.0) return place(area, value - error) + size + 2.0;
  const double baseline = place(area, value + error) - 4.0;
  if (series.references.empty() || !std::isfinite(series.references[group])) return baseline;
  constexpr double kDiamond = 6.0;
  const double diamond = place(area, series.references[group]);
  const bool free = diamond - kDiamond > baseline || diamond + kDiamond < baseline - size;
  return free ? baseline : diamond - kDiamond - 2.0;
}

// The bar of one series in one group, with its center and width in units.
void draw_bar(Canvas& canvas, const PlotArea& area, const BarSeries& series, std::size_t group,
              const Color& color, double center, double width, bool show_value) {
  const double value = series.values[group];
  if (!std::isfinite(value)) return;
  canvas.begin_group("bar");
  const double base = place(area, 0.0);
  const double tip = place(area, value);
  canvas.rectangle({center - 0.5 * width, std::min(base, tip), width, std::abs(base - tip)}, color);
  const double error = error_at(series, group);
  const double high = place(area, value + error);
  const double low = place(area, value - error);
  if (error > 0.0) {
    const Stroke stroke{.color = kInk, .width = 1.0};
    const double cap = std::min(4.0, 0.25 * width);
    canvas.line({center, low}, {center, high}, stroke);
    canvas.line({center - cap, low}, {center + cap, low}, stroke);
    canvas.line({center - cap, high}, {center + cap, high}, stroke);
  }
  const std::string text = fixed_number(value, std::max(2, area.y.decimals));
  const double size = kTickSize - 1.0;
  if (show_value && text_width(text, size) <= width + 6.0) {
    canvas.text({center, value_baseline(area, series, group, size)}, text,
                {.size = size, .anchor = Anchor::kMiddle});
  }
  canvas.end_group();
}

void draw_reference(Canvas& canvas, const PlotArea& area, const BarSeries& series,
                    std::size_t group, double center) {
  if (series.references.empty() || !std::isfinite(series.references[group])) return;
  const Point at(center, place(area, series.references[group]));
  draw_diamond(canvas, at, 5.5, kWhite);
  draw_diamond(canvas, at, 4.2, kInk);
}

void draw_group(Canvas& canvas, const PlotArea& area, const BarChart& chart, std::size_t group) {
  const double slot = area.box.width / static_cast<double>(chart.groups.size());
  const double left = area.box.x + slot * static_cast<double>(group);
  const double pitch = kGroupShare * slot / static_cast<double>(chart.series.size());
  const double first = left + 0.5 * (1.0 - kGroupShare) * slot + 0.5 * pitch;
  // One bar alone, or two, need not fill the page.
  const double width = std::min(0.86 * pitch, 64.0);
  for (std::size_t s = 0; s < chart.series.size(); ++s) {
    const double center = first + pitch * static_cast<double>(s);
    draw_bar(canvas, area, chart.series[s], group, series_color(static_cast<int>(s)), center, width,
             chart.show_values);
    draw_reference(canvas, area, chart.series[s], group, center);
  }
  canvas.text({left + 0.5 * slot, area.box.y + area.box.height + 18.0},
              fit_text(chart.groups[group], kPanelTitleSize, true, slot - 4.0),
              {.size = kPanelTitleSize, .color = kInk, .anchor = Anchor::kMiddle, .bold = true});
}

}  // namespace

std::string bar_chart(const BarChart& chart, const ChartOptions& options) {
  check_chart(chart, options);
  PlotArea area;
  area.y = make_scale(chart.y, heights_of(chart), 7, "bar_chart, y");
  const auto canvas =
      make_canvas(options.format, options.width, options.height, options.pixel_ratio, "bar_chart");
  double top = draw_chart_title(*canvas, chart.title, options.width);
  top += draw_legend(canvas.get(), legend_of(chart), kChartMargin, top,
                     options.width - 2.0 * kChartMargin) +
         14.0;
  const double left = kChartMargin + label_room(area.y) + (chart.y.label.empty() ? 0.0 : 18.0);
  area.box = {left, top, std::max(options.width - left - kChartMargin, 1.0),
              std::max(options.height - top - 34.0, 1.0)};
  draw_vertical_axis(*canvas, area, chart.y.label);
  for (std::size_t g = 0; g < chart.groups.size(); ++g) draw_group(*canvas, area, chart, g);
  const double base = place(area, 0.0);
  canvas->line({area.box.x, base}, {area.box.x + area.box.width, base}, {.color = kSoftInk});
  return canvas->finish();
}

}  // namespace laban::draw
