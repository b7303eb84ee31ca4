#include "draw/axes.h"

#include <array>
#include <charconv>
#include <cmath>

#include "laban/base/error.h"

namespace laban::draw {
namespace {

constexpr double kLegendLine = 18.0;

// The smallest step of 1, 2 or 5 times a power of ten that gives at most `most_ticks` steps.
double nice_step(double span, int most_ticks) {
  const double rough = span / most_ticks;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

int decimals_of(double step) {
  return std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
}

void check_ends(const Axis& axis, std::string_view place) {
  const bool finite =
      (!axis.min || std::isfinite(*axis.min)) && (!axis.max || std::isfinite(*axis.max));
  const bool ordered = !axis.min || !axis.max || *axis.min < *axis.max;
  if (finite && ordered) return;
  throw base::Error(base::ErrorKind::kUsage,
                    std::string(place) + ": an axis from " +
                        (axis.min ? short_number(*axis.min, 6) : "the data") + " to " +
                        (axis.max ? short_number(*axis.max, 6) : "the data") +
                        " (ends must be finite, the first less than the second)");
}

void draw_swatch(Canvas& canvas, const LegendEntry& entry, double x, double y) {
  const Point middle(x + 9.0, y);
  switch (entry.swatch) {
    case Swatch::kLine:
    case Swatch::kDashedLine:
      canvas.line(
          {x, y}, {x + 18.0, y},
          {.color = entry.color, .width = 2.2, .dashed = entry.swatch == Swatch::kDashedLine});
      return;
    case Swatch::kDot:
      canvas.circle(middle, 3.2, entry.color);
      return;
    case Swatch::kBox:
      canvas.rectangle({x + 4.0, y - 5.0, 10.0, 10.0}, entry.color);
      return;
    case Swatch::kDiamond:
      draw_diamond(canvas, middle, 4.5, entry.color);
      return;
  }
}

}  // namespace

Scale make_scale(const Axis& axis, std::span<const double> values, int most_ticks,
                 std::string_view place) {
  check_ends(axis, place);
  // Far inside the range of doubles, so that sums and spans stay finite.
  constexpr double kLargest = 1e300;
  double low = kLargest;
  double high = -kLargest;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    low = std::min(low, std::clamp(value, -kLargest, kLargest));
    high = std::max(high, std::clamp(value, -kLargest, kLargest));
  }
  if (low > high) {
    low = 0.0;
    high = 1.0;
  }
  if (axis.min) low = *axis.min;
  if (axis.max) high = *axis.max;
  // Data on one value, or on the wrong side of an end that was set.
  const double pad = std::max(0.5, 0.1 * std::abs(low));
  if (high <= low && axis.max) low = high - pad;
  if (high <= low) high = low + pad;
  Scale scale{low, high, {}, 0};
  const double step = nice_step(high - low, most_ticks);
  scale.decimals = decimals_of(step);
  if (!axis.min) scale.min = std::floor(low / step + 1e-9) * step;
  if (!axis.max) scale.max = std::ceil(high / step - 1e-9) * step;
  const double first = std::ceil(scale.min / step - 1e-9);
  const double last = std::floor(scale.max / step + 1e-9);
  const int count = static_cast<int>(std::min(last - first, 100.0));
  for (int i = 0; i <= count; ++i) scale.ticks.push_back((first + i) * step);
  return scale;
}

std::string tick_label(const Scale& scale, double tick) {
  std::string text;
  if (std::abs(tick) >= 1e6 || (tick != 0.0 && scale.decimals >= 7)) {
    std::array<char, 40> buffer{};
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), tick,
                                   std::chars_format::scientific, 1)
                         .ptr;
    text.assign(buffer.data(), end);
  } else {
    text = fixed_number(tick, scale.decimals);
  }
  if (text.front() == '-') text.replace(0, 1, "\u2212");
  return text;
}

double label_room(const Scale& scale) {
  double room = 0.0;
  for (const double tick : scale.ticks) {
    room = std::max(room, text_width(tick_label(scale, tick), kTickSize));
  }
  return room + 8.0;
}

void draw_vertical_axis(Canvas& canvas, const PlotArea& area, const std::string& label) {
  const Box& box = area.box;
  for (const double tick : area.y.ticks) {
    const double y = area.to_y(tick);
    const bool zero = std::abs(tick) < 1e-9 * (area.y.max - area.y.min);
    canvas.line({box.x, y}, {box.x + box.width, y}, {.color = zero ? kHairline : kGrid});
    canvas.text({box.x - 7.0, y + 0.36 * kTickSize}, tick_label(area.y, tick),
                {.size = kTickSize, .anchor = Anchor::kEnd});
  }
  if (label.empty()) return;
  canvas.text({box.x - label_room(area.y) - 7.0, box.y + 0.5 * box.height},
              fit_text(label, kTickSize + 0.5, false, box.height),
              {.size = kTickSize + 0.5, .anchor = Anchor::kMiddle, .upward = true});
}

void draw_horizontal_axis(Canvas& canvas, const PlotArea& area, const std::string& label) {
  const Box& box = area.box;
  const double floor = box.y + box.height;
  canvas.line({box.x, floor}, {box.x + box.width, floor}, {.color = kHairline});
  for (const double tick : area.x.ticks) {
    const double x = area.to_x(tick);
    canvas.line({x, floor}, {x, floor + 4.0}, {.color = kHairline});
    canvas.text({x, floor + 7.0 + kTickSize}, tick_label(area.x, tick),
                {.size = kTickSize, .anchor = Anchor::kMiddle});
  }
  if (label.empty()) return;
  canvas.text({box.x + 0.5 * box.width, floor + 12.0 + 2.0 * kTickSize + 1.0},
              fit_text(label, kTickSize + 0.5, false, box.width),
              {.size = kTickSize + 0.5, .anchor = Anchor::kMiddle});
}

double draw_legend(Canvas* canvas, const std::vector<LegendEntry>& entries, double x, double y,
                   double width) {
  if (entries.empty()) return 0.0;
  double at = x;
  double line = y;
  for (const LegendEntry& entry : entries) {
    const std::string name = fit_text(entry.name, 11.0, false, width - 24.0);
    const double needed = 24.0 + text_width(name, 11.0);
    if (at > x && at + needed > x + width) {
      at = x;
      line += kLegendLine;
    }
    if (canvas != nullptr) {
      draw_swatch(*canvas, entry, at, line + 6.0);
      canvas->text({at + 24.0, line + 10.0}, name, {.size = 11.0});
    }
    at += needed + 20.0;
  }
  return line - y + kLegendLine;
}

double draw_chart_title(Canvas& canvas, const std::string& title, double width) {
  if (title.empty()) return kChartMargin - 4.0;
  canvas.text({kChartMargin, kChartMargin + kChartTitleSize - 3.0},
              fit_text(title, kChartTitleSize, true, width - 2.0 * kChartMargin),
              {.size = kChartTitleSize, .color = kInk, .bold = true});
  return kChartMargin + kChartTitleSize + 10.0;
}

void draw_diamond(Canvas& canvas, const Point& center, double radius, const Color& fill) {
  const std::array<Point, 4> corners = {center + Point(0.0, -radius), center + Point(radius, 0.0),
                                        center + Point(0.0, radius), center + Point(-radius, 0.0)};
  canvas.polygon(corners, fill);
}

}  // namespace laban::draw
