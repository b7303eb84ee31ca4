#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>

#include "io/short_decimal.h"

namespace laban::io {

/// No capture has a larger number: it is damage, and its square would not be finite for long.
inline constexpr double kLargestNumber = 1e30;

/// Walks over the text of a motion file and says where it is wrong. Locale-free; opens no file and
/// keeps views only, so the text must outlive it.
class TextScanner {
 public:
  /// Begins after a byte-order mark, if there is one.
  /// @throws Error{kFormat} if the text is UTF-16.
  TextScanner(std::string_view text, std::string_view name);

  [[nodiscard]] std::size_t offset() const noexcept { return offset_; }
  [[nodiscard]] bool at_end() const noexcept { return offset_ == text_.size(); }
  /// The next character; '\0' at the end.
  [[nodiscard]] char peek() const noexcept { return at_end() ? '\0' : text_[offset_]; }
  void skip() noexcept { ++offset_; }
  /// Goes back to an offset.
  void seek(std::size_t offset) noexcept { offset_ = offset; }

  /// Skips spaces and tabs.
  void skip_blanks() noexcept {
    while (!at_end() && is_blank(text_[offset_])) ++offset_;
  }
  /// Skips spaces, tabs and line ends.
  void skip_space() noexcept;

  /// The next word, after space: up to the next space or brace; a brace is a word. Empty at the
  /// end.
  [[nodiscard]] std::string_view word();
  /// The rest of the line up to a brace, without the blanks around it.
  [[nodiscard]] std::string_view rest_of_line();
  /// Skips `label` if it comes next: any case, any blanks where it has a space, blanks and a colon
  /// after it. Otherwise stays and returns false.
  [[nodiscard]] bool accept_label(std::string_view label);
  /// The finite number at this very place: decimal or scientific, ".5", "5." and "+5" too. It must
  /// end at space, a brace or the end.
  [[nodiscard]] double number() {
    // Inline: a capture is millions of short decimals.
    const char* const text = text_.data();
    const Decimal decimal = read_short_decimal(text + offset_, text + text_.size());
    if (decimal.last == nullptr || !(std::abs(decimal.value) <= kLargestNumber)) {
      return any_number();
    }
    offset_ = static_cast<std::size_t>(decimal.last - text);
    return decimal.value;
  }

  /// What was read between two offsets.
  [[nodiscard]] std::string_view text_between(std::size_t begin, std::size_t end) const {
    return text_.substr(begin, end - begin);
  }

  /// "name:line:column: message", 1-based; a column is a character of UTF-8.
  [[nodiscard]] std::string message_at(std::size_t offset, const std::string& message) const;
  /// @throws Error{kFormat} with message_at.
  [[noreturn]] void fail_at(std::size_t offset, const std::string& message) const;

 private:
  /// What number() does not know as a short decimal.
  [[nodiscard]] double any_number();
  [[noreturn]] void fail_number(std::size_t begin) const;

  std::string_view text_;
  std::string_view name_;
  std::size_t offset_ = 0;
};

/// True if two ASCII words are equal but for their case.
[[nodiscard]] bool equal_but_for_case(std::string_view a, std::string_view b);

/// A piece of a file as a message may show it: in quotes, cut to 40 bytes, control bytes as '?'.
[[nodiscard]] std::string quoted(std::string_view text);

}  // namespace laban::io
