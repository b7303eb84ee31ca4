#include <array>
#include <cmath>
#include <numbers>

#include <cairo.h>

#include "laban/base/error.h"

#include "draw/canvas.h"

namespace laban::draw {
namespace {

struct SurfaceDeleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct ContextDeleter {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
struct FontOptionsDeleter {
  void operator()(cairo_font_options_t* options) const { cairo_font_options_destroy(options); }
};
using Surface = std::unique_ptr<cairo_surface_t, SurfaceDeleter>;
using Context = std::unique_ptr<cairo_t, ContextDeleter>;

void check(cairo_status_t status) {
  if (status == CAIRO_STATUS_SUCCESS) return;
  throw base::Error(base::ErrorKind::kInternal,
                    std::string("cairo: ") + cairo_status_to_string(status));
}

// Unhinted and grey: the picture must not depend on the desktop's settings.
void set_font(cairo_t* context, double size, bool bold) {
  const std::unique_ptr<cairo_font_options_t, FontOptionsDeleter> options(
      cairo_font_options_create());
  cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(context, options.get());
  cairo_select_font_face(context, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, size);
}

double advance(cairo_t* context, const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  return extents.x_advance;
}

cairo_status_t append(void* closure, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

class PngCanvas final : public Canvas {
 public:
  PngCanvas(double width, double height, double pixel_ratio)
      : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24,
                                            static_cast<int>(std::ceil(width * pixel_ratio)),
                                            static_cast<int>(std::ceil(height * pixel_ratio)))),
        context_(cairo_create(surface_.get())) {
    check(cairo_surface_status(surface_.get()));
    cairo_set_source_rgb(context(), 1.0, 1.0, 1.0);
    cairo_paint(context());
    cairo_scale(context(), pixel_ratio, pixel_ratio);
    cairo_set_line_join(context(), CAIRO_LINE_JOIN_ROUND);
  }

  void polyline(std::span<const Point> points, const Stroke& stroke) override {
    if (points.size() < 2) return;
    trace(points);
    set_color(stroke.color);
    cairo_set_line_width(context(), stroke.width);
    cairo_set_line_cap(context(), stroke.round_caps && !stroke.dashed ? CAIRO_LINE_CAP_ROUND
                                                                      : CAIRO_LINE_CAP_BUTT);
    const std::array<double, 2> dash = {3.0 * stroke.width, 3.0 * stroke.width};
    cairo_set_dash(context(), dash.data(), stroke.dashed ? 2 : 0, 0.0);
    cairo_stroke(context());
  }

  void polygon(std::span<const Point> points, const Color& color) override {
    if (points.empty()) return;
    trace(points);
    cairo_close_path(context());
    fill(color);
  }

  void circle(const Point& center, double radius, const Color& color) override {
    cairo_new_path(context());
    cairo_arc(context(), center.x(), center.y(), radius, 0.0, 2.0 * std::numbers::pi);
    fill(color);
  }

  void rectangle(const Box& box, const Color& color) override {
    cairo_set_antialias(context(), CAIRO_ANTIALIAS_NONE);
    cairo_new_path(context());
    cairo_rectangle(context(), box.x, box.y, box.width, box.height);
    fill(color);
    cairo_set_antialias(context(), CAIRO_ANTIALIAS_DEFAULT);
  }

  void capsule(const Point& a, double radius_a, const Point& b, double radius_b,
               const Color& color) override {
    const double length = (b - a).norm();
    if (length <= std::abs(radius_a - radius_b) + 1e-9) {
      return circle(radius_a > radius_b ? a : b, std::max(radius_a, radius_b), color);
    }
    const double axis = std::atan2(b.y() - a.y(), b.x() - a.x());
    const double lean = std::acos((radius_a - radius_b) / length);
    cairo_new_path(context());
    cairo_arc(context(), b.x(), b.y(), radius_b, axis - lean, axis + lean);
    cairo_arc(context(), a.x(), a.y(), radius_a, axis + lean, axis - lean + 2.0 * std::numbers::pi);
    cairo_close_path(context());
    fill(color);
  }

  void text(const Point& at, std::string_view text, const TextStyle& style) override {
    const std::string clean = printable(text);
    set_font(context(), style.size, style.bold);
    set_color(style.color);
    const double share = style.anchor == Anchor::kStart    ? 0.0
                         : style.anchor == Anchor::kMiddle ? 0.5
                                                           : 1.0;
    const double shift = -share * advance(context(), clean);
    cairo_save(context());
    cairo_translate(context(), at.x(), at.y());
    if (style.upward) cairo_rotate(context(), -std::numbers::pi / 2.0);
    cairo_move_to(context(), shift, 0.0);
    cairo_show_text(context(), clean.c_str());
    cairo_restore(context());
  }

  void begin_group(std::string_view /*name*/) override {}
  void end_group() override {}

  void begin_clip(const Box& box) override {
    cairo_save(context());
    cairo_new_path(context());
    cairo_rectangle(context(), box.x, box.y, box.width, box.height);
    cairo_clip(context());
  }
  void end_clip() override { cairo_restore(context()); }

  std::string finish() override {
    check(cairo_status(context()));
    cairo_surface_flush(surface_.get());
    std::string bytes;
    check(cairo_surface_write_to_png_stream(surface_.get(), append, &bytes));
    return bytes;
  }

 private:
  [[nodiscard]] cairo_t* context() const { return context_.get(); }

  void set_color(const Color& color) {
    cairo_set_source_rgba(context(), color.red, color.green, color.blue, color.alpha);
  }

  void fill(const Color& color) {
    set_color(color);
    cairo_fill(context());
  }

  void trace(std::span<const Point> points) {
    cairo_new_path(context());
    for (const Point& point : points) cairo_line_to(context(), point.x(), point.y());
  }

  Surface surface_;
  Context context_;
};

}  // namespace

std::unique_ptr<Canvas> make_png_canvas(double width, double height, double pixel_ratio) {
  return std::make_unique<PngCanvas>(width, height, pixel_ratio);
}

double text_width(std::string_view text, double size, bool bold) {
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1));
  const Context context(cairo_create(surface.get()));
  set_font(context.get(), size, bold);
  return advance(context.get(), printable(text));
}

}  // namespace laban::draw
