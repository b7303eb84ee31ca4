#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace laban::draw {

/// What a picture's bytes are.
enum class Format { kPng, kSvg };

/// The format that a file name's ending asks for (".png", ".svg", any case); nullopt for another.
[[nodiscard]] std::optional<Format> format_from_name(std::string_view file_name);

/// Size and format of a chart. Every picture of this module is the same bytes for the same input;
/// SVG bytes hold their texts as text, PNG bytes need a font ("DejaVu Sans", else any).
struct ChartOptions {
  Format format = Format::kPng;
  double width = 900.0;      ///< units (CSS pixels), 100 .. 10000
  double height = 420.0;     ///< units, 100 .. 10000
  double pixel_ratio = 2.0;  ///< PNG pixels a unit, 0.25 .. 8; no side over 32767 pixels

  /// Broken rules, each like "ChartOptions::width = 3 (must be 100 .. 10000)"; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

}  // namespace laban::draw
