#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace laban::io {

[[nodiscard]] constexpr bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}

[[nodiscard]] constexpr bool is_line_end(char c) {
  return c == '\n' || c == '\r';
}

[[nodiscard]] constexpr bool is_brace(char c) {
  return c == '{' || c == '}';
}

[[nodiscard]] constexpr bool ends_word(char c) {
  return is_blank(c) || is_line_end(c) || is_brace(c);
}

[[nodiscard]] constexpr char to_lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

[[nodiscard]] constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Digits of a number's whole part or fraction: their value (wrapped around beyond 19 digits) and
/// where they end.
struct Digits {
  std::uint64_t value = 0;
  const char* last = nullptr;
};

/// Goes on with `before`.
[[nodiscard]] inline Digits read_digits(const char* at, const char* end, std::uint64_t before) {
  for (; at != end && is_digit(*at); ++at) before = 10 * before + static_cast<unsigned>(*at - '0');
  return {before, at};
}

inline constexpr std::array<double, 23> kPowersOfTen = {
    1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/// A number of plain decimals and where it ends; `last` is null if it is none that is exact here.
struct Decimal {
  double value = 0.0;
  const char* last = nullptr;
};

/// Reads [-]digits[.digits][e[-]digits] with at most 15 digits and a power of ten within 10^+-22,
/// faster than std::from_chars: whole number and power of ten are then exact doubles,
/// so their product or quotient is correctly rounded.
[[nodiscard]] inline Decimal read_short_decimal(const char* first, const char* end) {
  const char* at = first;
  const bool negative = at != end && *at == '-';
  if (negative) ++at;
  const Digits whole = read_digits(at, end, 0);
  std::ptrdiff_t digit_count = whole.last - at;
  std::uint64_t digits = whole.value;
  at = whole.last;
  std::ptrdiff_t power = 0;
  if (at != end && *at == '.') {
    ++at;
    const Digits fraction = read_digits(at, end, digits);
    power = at - fraction.last;
    digit_count -= power;
    digits = fraction.value;
    at = fraction.last;
  }
  if (at != end && to_lower(*at) == 'e') {
    const bool below_one = ++at != end && *at == '-';
    if (below_one) ++at;
    const char* const exponent = at;
    std::ptrdiff_t value = 0;
    for (; at != end && is_digit(*at) && at - exponent < 3; ++at) value = 10 * value + (*at - '0');
    if (at == exponent) return {};
    power += below_one ? -value : value;
  }
  const bool is_exact = digit_count >= 1 && digit_count <= 15 &&  // more may have wrapped around
                        power >= -22 && power <= 22;
  if (!is_exact || (at != end && !ends_word(*at))) return {};
  const double scale = kPowersOfTen[static_cast<std::size_t>(std::abs(power))];
  const auto digits_value = static_cast<double>(static_cast<std::int64_t>(digits));
  const double value = power < 0 ? digits_value / scale : digits_value * scale;
  return {negative ? -value : value, at};
}

}  // namespace laban::io
