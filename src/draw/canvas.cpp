#include "draw/canvas.h"

#include <array>
#include <charconv>
#include <cmath>

#include "laban/base/error.h"

namespace laban::draw {
namespace {

// Largest side of a cairo image.
constexpr double kMaxPixels = 32767.0;

// Bytes of the UTF-8 sequence that `text` begins with, 0 if it is not valid.
std::size_t sequence_length(std::string_view text) {
  const auto byte = [text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  std::size_t length = 0;
  if (byte(0) < 0x80U) return 1;
  if (byte(0) >= 0xc2U && byte(0) <= 0xdfU) length = 2;
  if (byte(0) >= 0xe0U && byte(0) <= 0xefU) length = 3;
  if (byte(0) >= 0xf0U && byte(0) <= 0xf4U) length = 4;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0U) != 0x80U) return 0;
  }
  const bool overlong =
      (byte(0) == 0xe0U && byte(1) < 0xa0U) || (byte(0) == 0xf0U && byte(1) < 0x90U);
  const bool surrogate = byte(0) == 0xedU && byte(1) >= 0xa0U;
  const bool too_large = byte(0) == 0xf4U && byte(1) >= 0x90U;
  // U+FFFE and U+FFFF are not characters of XML.
  const bool not_xml = byte(0) == 0xefU && byte(1) == 0xbfU && byte(2) >= 0xbeU;
  return overlong || surrogate || too_large || not_xml ? 0 : length;
}

}  // namespace

Color mix(const Color& a, const Color& b, double amount) {
  const auto between = [amount](double from, double to) { return from + (to - from) * amount; };
  return {between(a.red, b.red), between(a.green, b.green), between(a.blue, b.blue),
          between(a.alpha, b.alpha)};
}

Color with_alpha(Color color, double alpha) {
  color.alpha = alpha;
  return color;
}

Color series_color(int index) {
  constexpr std::array<Color, 7> kPalette = {rgb(0x0072b2), rgb(0xd55e00), rgb(0x009e73),
                                             rgb(0xcc79a7), rgb(0x56b4e9), rgb(0xe69f00),
                                             rgb(0x4d4d4d)};
  return kPalette[static_cast<std::size_t>(index) % kPalette.size()];
}

void Canvas::line(const Point& a, const Point& b, const Stroke& stroke) {
  const std::array<Point, 2> ends = {a, b};
  polyline(ends, stroke);
}

std::unique_ptr<Canvas> make_canvas(Format format, double width, double height, double pixel_ratio,
                                    std::string_view place) {
  if (format == Format::kSvg) return make_svg_canvas(width, height);
  const double side = std::max(width, height) * pixel_ratio;
  if (side > kMaxPixels) {
    throw base::Error(base::ErrorKind::kUsage,
                      std::string(place) + ": the picture would be " + fixed_number(side, 0) +
                          " pixels long (at most 32767): lower pixel_ratio, draw less, or ask for "
                          "SVG");
  }
  return make_png_canvas(width, height, pixel_ratio);
}

std::string fit_text(std::string_view text, double size, bool bold, double width) {
  std::string fitted = printable(text);
  if (text_width(fitted, size, bold) <= width) return fitted;
  while (!fitted.empty()) {
    // A whole character goes: its continuation bytes and its first.
    while (!fitted.empty() && (static_cast<unsigned char>(fitted.back()) & 0xc0U) == 0x80U) {
      fitted.pop_back();
    }
    if (!fitted.empty()) fitted.pop_back();
    const std::string shortened = fitted + "\u2026";
    if (text_width(shortened, size, bold) <= width) return shortened;
  }
  return fitted;
}

std::string printable(std::string_view text) {
  std::string clean;
  while (!text.empty()) {
    const std::size_t length = sequence_length(text);
    const auto first = static_cast<unsigned char>(text.front());
    if (length == 0) {
      clean += '?';
    } else if (first < 0x20U || first == 0x7fU) {
      clean += ' ';
    } else {
      clean += text.substr(0, length);
    }
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return clean;
}

std::string fixed_number(double value, int decimals) {
  std::array<char, 400> buffer{};  // the largest double has 309 digits
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::fixed, decimals)
                       .ptr;
  std::string text(buffer.data(), end);
  const bool zero = text.find_first_not_of("-0.") == std::string::npos;
  return zero && text.front() == '-' ? text.substr(1) : text;
}

std::string short_number(double value, int decimals) {
  std::string text = fixed_number(value, decimals);
  if (text.find('.') == std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace laban::draw
