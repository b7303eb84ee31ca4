#include <cmath>

#include "draw/canvas.h"

namespace laban::draw {
namespace {

constexpr int kDecimals = 2;  // of coordinates: a hundredth of a unit cannot be seen

std::string svg_number(double value) {
  return short_number(value, kDecimals);
}

// One allocation, and none of g++ 12's false overflow warnings on "literal" + std::string.
std::string joined(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) text += part;
  return text;
}

std::string pair(const Point& point) {
  return joined({svg_number(point.x()), ",", svg_number(point.y())});
}

std::string hex(const Color& color) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text = "#";
  for (const double part : {color.red, color.green, color.blue}) {
    const auto level = static_cast<std::size_t>(std::lround(std::clamp(part, 0.0, 1.0) * 255.0));
    text += kDigits[level / 16];
    text += kDigits[level % 16];
  }
  return text;
}

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : printable(text)) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string attribute(std::string_view name, std::string_view value) {
  return joined({" ", name, "=\"", value, "\""});
}

std::string fill_of(const Color& color) {
  if (color.alpha >= 1.0) return attribute("fill", hex(color));
  return joined(
      {attribute("fill", hex(color)), attribute("fill-opacity", svg_number(color.alpha))});
}

std::string points_of(std::span<const Point> points) {
  std::string text;
  for (const Point& point : points) {
    if (!text.empty()) text += ' ';
    text += pair(point);
  }
  return text;
}

class SvgCanvas final : public Canvas {
 public:
  SvgCanvas(double width, double height) {
    const std::string w = svg_number(width);
    const std::string h = svg_number(height);
    put({"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\"",
         attribute("width", w), attribute("height", h),
         attribute("viewBox", joined({"0 0 ", w, " ", h})),
         " font-family=\"DejaVu Sans, Verdana, Helvetica, sans-serif\">\n"});
    rectangle({0.0, 0.0, width, height}, kWhite);
  }

  void polyline(std::span<const Point> points, const Stroke& stroke) override {
    if (points.size() < 2) return;
    put({"<polyline", attribute("points", points_of(points)), " fill=\"none\"",
         attribute("stroke", hex(stroke.color)),
         attribute("stroke-width", svg_number(stroke.width)), " stroke-linejoin=\"round\""});
    if (stroke.color.alpha < 1.0)
      put({attribute("stroke-opacity", svg_number(stroke.color.alpha))});
    if (stroke.round_caps && !stroke.dashed) put({" stroke-linecap=\"round\""});
    const std::string dash = svg_number(3.0 * stroke.width);
    if (stroke.dashed) put({attribute("stroke-dasharray", joined({dash, " ", dash}))});
    put({"/>\n"});
  }

  void polygon(std::span<const Point> points, const Color& fill) override {
    put({"<polygon", attribute("points", points_of(points)), fill_of(fill), "/>\n"});
  }

  void circle(const Point& center, double radius, const Color& fill) override {
    put({"<circle", attribute("cx", svg_number(center.x())),
         attribute("cy", svg_number(center.y())), attribute("r", svg_number(radius)), fill_of(fill),
         "/>\n"});
  }

  void rectangle(const Box& box, const Color& fill) override {
    put({"<rect", attribute("x", svg_number(box.x)), attribute("y", svg_number(box.y)),
         attribute("width", svg_number(box.width)), attribute("height", svg_number(box.height)),
         fill_of(fill), " shape-rendering=\"crispEdges\"/>\n"});
  }

  void capsule(const Point& a, double radius_a, const Point& b, double radius_b,
               const Color& fill) override {
    const double length = (b - a).norm();
    if (length <= std::abs(radius_a - radius_b) + 1e-9) {
      return circle(radius_a > radius_b ? a : b, std::max(radius_a, radius_b), fill);
    }
    // The outer tangents touch both circles where the normal leans by acos((ra - rb) / length).
    const double axis = std::atan2(b.y() - a.y(), b.x() - a.x());
    const double lean = std::acos((radius_a - radius_b) / length);
    const auto on = [](const Point& c, double r, double angle) {
      return pair(Point(c.x() + r * std::cos(angle), c.y() + r * std::sin(angle)));
    };
    // The larger circle shows more than half of itself.
    const auto arc = [](double r, bool large, const std::string& to) {
      return joined({"A", svg_number(r), " ", svg_number(r), " 0 ", large ? "1" : "0", " 1 ", to});
    };
    const std::string path =
        joined({"M", on(b, radius_b, axis - lean),
                arc(radius_b, radius_b > radius_a, on(b, radius_b, axis + lean)), "L",
                on(a, radius_a, axis + lean),
                arc(radius_a, radius_a > radius_b, on(a, radius_a, axis - lean)), "Z"});
    put({"<path", attribute("d", path), fill_of(fill), "/>\n"});
  }

  void text(const Point& at, std::string_view text, const TextStyle& style) override {
    const std::string x = svg_number(at.x());
    const std::string y = svg_number(at.y());
    put({"<text", attribute("x", x), attribute("y", y),
         attribute("font-size", svg_number(style.size)), fill_of(style.color)});
    if (style.anchor == Anchor::kMiddle) put({" text-anchor=\"middle\""});
    if (style.anchor == Anchor::kEnd) put({" text-anchor=\"end\""});
    if (style.bold) put({" font-weight=\"bold\""});
    if (style.upward) put({attribute("transform", joined({"rotate(-90 ", x, " ", y, ")"}))});
    put({">", escaped(text), "</text>\n"});
  }

  void begin_group(std::string_view name) override {
    put({"<g", attribute("class", escaped(name)), ">\n"});
  }
  void end_group() override { put({"</g>\n"}); }

  // A nested svg element clips to its own size and, unlike clipPath, needs no id.
  void begin_clip(const Box& box) override {
    const std::string x = svg_number(box.x);
    const std::string y = svg_number(box.y);
    const std::string w = svg_number(box.width);
    const std::string h = svg_number(box.height);
    put({"<svg", attribute("x", x), attribute("y", y), attribute("width", w),
         attribute("height", h), attribute("viewBox", joined({x, " ", y, " ", w, " ", h})),
         " overflow=\"hidden\">\n"});
  }
  void end_clip() override { put({"</svg>\n"}); }

  std::string finish() override {
    put({"</svg>\n"});
    return std::move(out_);
  }

 private:
  void put(std::initializer_list<std::string_view> parts) {
    for (const std::string_view part : parts) out_ += part;
  }

  std::string out_;
};

}  // namespace

std::unique_ptr<Canvas> make_svg_canvas(double width, double height) {
  return std::make_unique<SvgCanvas>(width, height);
}

}  // namespace laban::draw
