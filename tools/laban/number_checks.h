#pragma once

#include <cmath>
#include <string>

#include <CLI/CLI.hpp>

namespace laban::cli {

// CLI11's own checks of these print the largest number there is as the other bound, 300 digits.

/// Checks that an option's value is a finite number that `holds`; `rule` follows "must be".
template <typename Rule>
[[nodiscard]] CLI::Validator number_that(const Rule& holds, const std::string& rule,
                                         const std::string& name) {
  return {[holds, rule](const std::string& text) {
            double value = 0.0;
            const bool is_number = CLI::detail::lexical_cast(text, value);
            if (is_number && std::isfinite(value) && holds(value)) return std::string();
            return text + " (must be " + rule + ")";
          },
          name};
}

/// A finite number above 0.
[[nodiscard]] inline CLI::Validator positive_number() {
  return number_that([](double value) { return value > 0.0; }, "a number above 0", "POSITIVE");
}

/// A finite number, 0 or above.
[[nodiscard]] inline CLI::Validator number_from_0() {
  return number_that([](double value) { return value >= 0.0; }, "0 or a number above it",
                     "NONNEGATIVE");
}

}  // namespace laban::cli
