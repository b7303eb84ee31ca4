#include "laban/draw/format.h"

#include "draw/options.h"

namespace laban::draw {

std::optional<Format> format_from_name(std::string_view file_name) {
  const auto ends_with = [file_name](std::string_view ending) {
    if (file_name.size() < ending.size()) return false;
    const std::string_view tail = file_name.substr(file_name.size() - ending.size());
    return std::equal(tail.begin(), tail.end(), ending.begin(), [](char a, char b) {
      return (a >= 'A' && a <= 'Z' ? static_cast<char>(a - 'A' + 'a') : a) == b;
    });
  };
  if (ends_with(".png")) return Format::kPng;
  if (ends_with(".svg")) return Format::kSvg;
  return std::nullopt;
}

std::vector<std::string> ChartOptions::problems() const {
  std::vector<std::string> found;
  check_range(found, "ChartOptions::width", width, 100.0, 10000.0);
  check_range(found, "ChartOptions::height", height, 100.0, 10000.0);
  check_range(found, "ChartOptions::pixel_ratio", pixel_ratio, 0.25, 8.0);
  return found;
}

void check_range(std::vector<std::string>& problems, std::string_view name, double value,
                 double low, double high) {
  if (value >= low && value <= high) return;
  problems.push_back(std::string(name) + " = " + short_number(value, 6) + " (must be " +
                     short_number(low, 6) + " .. " + short_number(high, 6) + ")");
}

void throw_first_problem(std::string_view place, const std::vector<std::string>& problems) {
  if (problems.empty()) return;
  throw base::Error(base::ErrorKind::kUsage, std::string(place) + ": " + problems.front());
}

}  // namespace laban::draw
