#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

#include "laban/draw/format.h"

namespace laban::draw {

/// Canvas coordinates: units from the top left corner, x to the right, y down.
using Point = Eigen::Vector2d;

/// sRGB, each part in [0, 1].
struct Color {
  double red = 0.0;
  double green = 0.0;
  double blue = 0.0;
  double alpha = 1.0;
};

/// 0xRRGGBB as a color.
[[nodiscard]] constexpr Color rgb(unsigned hex) {
  return {((hex >> 16U) & 255U) / 255.0, ((hex >> 8U) & 255U) / 255.0, (hex & 255U) / 255.0, 1.0};
}

/// `a` at amount 0, `b` at 1.
[[nodiscard]] Color mix(const Color& a, const Color& b, double amount);
[[nodiscard]] Color with_alpha(Color color, double alpha);

inline constexpr Color kWhite = rgb(0xffffff);
inline constexpr Color kInk = rgb(0x24292f);       ///< titles
inline constexpr Color kSoftInk = rgb(0x57606a);   ///< labels
inline constexpr Color kHairline = rgb(0xc3c9d0);  ///< axes, floors
inline constexpr Color kGrid = rgb(0xe8ebee);      ///< grids, spans

/// Color of series `index`: Okabe and Ito's palette, safe for the color-blind, then again.
[[nodiscard]] Color series_color(int index);

struct Stroke {
  Color color;
  double width = 1.0;
  bool dashed = false;
  bool round_caps = true;  ///< false where pieces of one line meet
};

enum class Anchor { kStart, kMiddle, kEnd };

struct TextStyle {
  double size = 11.0;  ///< of the font, units
  Color color = kSoftInk;
  Anchor anchor = Anchor::kStart;
  bool bold = false;
  bool upward = false;  ///< turned by a quarter: reads from below to above
};

struct Box {
  double x = 0.0;
  double y = 0.0;
  double width = 0.0;
  double height = 0.0;
};

/// A page that one drawing code fills, whatever the format: PNG by cairo, SVG by a writer of our
/// own, because cairo's turns texts into outlines that nobody can search or edit.
class Canvas {
 public:
  Canvas() = default;
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  virtual ~Canvas() = default;

  virtual void polyline(std::span<const Point> points, const Stroke& stroke) = 0;
  virtual void polygon(std::span<const Point> points, const Color& fill) = 0;
  virtual void circle(const Point& center, double radius, const Color& fill) = 0;
  /// Edges are not smoothed, so that neighbouring cells meet without a seam.
  virtual void rectangle(const Box& box, const Color& fill) = 0;
  /// The convex hull of two circles: a tapered bone.
  virtual void capsule(const Point& a, double radius_a, const Point& b, double radius_b,
                       const Color& fill) = 0;
  /// `at` is the baseline's start, middle or end.
  virtual void text(const Point& at, std::string_view text, const TextStyle& style) = 0;
  /// What is drawn until end_group() belongs to the SVG class `name`; no effect on a PNG.
  virtual void begin_group(std::string_view name) = 0;
  virtual void end_group() = 0;
  /// What is drawn until end_clip() shows inside `box` only.
  virtual void begin_clip(const Box& box) = 0;
  virtual void end_clip() = 0;
  /// The file's bytes; nothing may be drawn after.
  [[nodiscard]] virtual std::string finish() = 0;

  void line(const Point& a, const Point& b, const Stroke& stroke);
};

/// A white page. @throws Error{kUsage} naming `place` if a PNG's side exceeds 32767 pixels.
[[nodiscard]] std::unique_ptr<Canvas> make_canvas(Format format, double width, double height,
                                                  double pixel_ratio, std::string_view place);
[[nodiscard]] std::unique_ptr<Canvas> make_png_canvas(double width, double height,
                                                      double pixel_ratio);
[[nodiscard]] std::unique_ptr<Canvas> make_svg_canvas(double width, double height);

/// Width of a text in units, in the font that PNG pictures use.
[[nodiscard]] double text_width(std::string_view text, double size, bool bold = false);

/// The text, shortened by an ellipsis if it is wider than `width`.
[[nodiscard]] std::string fit_text(std::string_view text, double size, bool bold, double width);

/// Valid UTF-8 without control characters: what is neither becomes '?' or a space.
[[nodiscard]] std::string printable(std::string_view text);

/// A number with at most `decimals` decimals, without trailing zeros, whatever the locale.
[[nodiscard]] std::string short_number(double value, int decimals);
/// A number with exactly `decimals` decimals.
[[nodiscard]] std::string fixed_number(double value, int decimals);

}  // namespace laban::draw
