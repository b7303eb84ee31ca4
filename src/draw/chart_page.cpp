#include "laban/draw/chart_page.h"

#include <vector>

#include "laban/base/error.h"

#include "draw/charts.h"
#include "draw/options.h"

namespace laban::draw {
namespace {

/// Draws on another canvas, shifted.
class ShiftedCanvas : public Canvas {
 public:
  ShiftedCanvas(Canvas& canvas, const Point& shift) : canvas_(canvas), shift_(shift) {}

  void polyline(std::span<const Point> points, const Stroke& stroke) override {
    canvas_.polyline(shifted(points), stroke);
  }
  void polygon(std::span<const Point> points, const Color& fill) override {
    canvas_.polygon(shifted(points), fill);
  }
  void circle(const Point& center, double radius, const Color& fill) override {
    canvas_.circle(center + shift_, radius, fill);
  }
  void rectangle(const Box& box, const Color& fill) override {
    canvas_.rectangle(shifted(box), fill);
  }
  void capsule(const Point& a, double radius_a, const Point& b, double radius_b,
               const Color& fill) override {
    canvas_.capsule(a + shift_, radius_a, b + shift_, radius_b, fill);
  }
  void text(const Point& at, std::string_view text, const TextStyle& style) override {
    canvas_.text(at + shift_, text, style);
  }
  void begin_group(std::string_view name) override { canvas_.begin_group(name); }
  void end_group() override { canvas_.end_group(); }
  void begin_clip(const Box& box) override { canvas_.begin_clip(shifted(box)); }
  void end_clip() override { canvas_.end_clip(); }
  std::string finish() override { return canvas_.finish(); }

 private:
  [[nodiscard]] std::vector<Point> shifted(std::span<const Point> points) const {
    std::vector<Point> moved(points.begin(), points.end());
    for (Point& point : moved) point += shift_;
    return moved;
  }
  [[nodiscard]] Box shifted(const Box& box) const {
    return {box.x + shift_.x(), box.y + shift_.y(), box.width, box.height};
  }

  Canvas& canvas_;
  Point shift_;
};

}  // namespace

std::string chart_page(std::span<const ChartTile> tiles, const ChartOptions& options) {
  throw_first_problem("chart_page", options.problems());
  if (tiles.empty()) throw base::Error(base::ErrorKind::kUsage, "chart_page: no chart");
  const auto canvas =
      make_canvas(options.format, options.width, options.height, options.pixel_ratio, "chart_page");
  for (const ChartTile& tile : tiles) {
    ShiftedCanvas shifted(*canvas, {tile.x, tile.y});
    ChartOptions own = options;
    own.width = tile.width;
    own.height = tile.height;
    std::visit([&](const auto& chart) { paint(shifted, chart, own); }, tile.chart);
  }
  return canvas->finish();
}

}  // namespace laban::draw
