#include "io/text_scanner.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "laban/base/error.h"

namespace laban::io {
TextScanner::TextScanner(std::string_view text, std::string_view name) : text_(text), name_(name) {
  if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF")) {
    fail_at(0, "the text is UTF-16; save it as UTF-8");
  }
  if (text_.starts_with("\xEF\xBB\xBF")) offset_ = 3;
}

void TextScanner::skip_space() noexcept {
  while (!at_end() && (is_blank(text_[offset_]) || is_line_end(text_[offset_]))) ++offset_;
}

std::string_view TextScanner::word() {
  skip_space();
  const std::size_t begin = offset_;
  if (is_brace(peek())) {
    ++offset_;
  } else {
    while (!at_end() && !ends_word(text_[offset_])) ++offset_;
  }
  return text_.substr(begin, offset_ - begin);
}

std::string_view TextScanner::rest_of_line() {
  skip_blanks();
  const std::size_t begin = offset_;
  while (!at_end() && !is_line_end(text_[offset_]) && !is_brace(text_[offset_])) ++offset_;
  std::size_t end = offset_;
  while (end > begin && is_blank(text_[end - 1])) --end;
  return text_.substr(begin, end - begin);
}

bool TextScanner::accept_label(std::string_view label) {
  const std::size_t begin = offset_;
  skip_space();
  for (const char c : label) {
    if (c == ' ') {
      skip_blanks();
    } else if (to_lower(peek()) == to_lower(c)) {
      ++offset_;
    } else {
      offset_ = begin;
      return false;
    }
  }
  skip_blanks();
  if (peek() == ':') ++offset_;
  return true;
}

double TextScanner::any_number() {
  const std::size_t begin = offset_;
  const char* const end = text_.data() + text_.size();
  const char* first = text_.data() + begin;
  // from_chars knows no plus sign.
  if (first != end && *first == '+' && first + 1 != end && first[1] != '-') ++first;
  double value = 0.0;
  const auto [last, status] = std::from_chars(first, end, value);
  const bool ended = last == end || ends_word(*last);
  if (status == std::errc::result_out_of_range && ended) {
    // 1e-400 is zero, 1e400 is not a number of a capture; from_chars leaves `value` as it was.
    const std::string_view digits(first, static_cast<std::size_t>(last - first));
    value = digits.find("e-") != digits.npos || digits.find("E-") != digits.npos ? 0.0 : HUGE_VAL;
  } else if (status != std::errc() || !ended) {
    fail_number(begin);
  }
  if (!(std::abs(value) <= kLargestNumber)) fail_number(begin);
  offset_ = static_cast<std::size_t>(last - text_.data());
  return value;
}

void TextScanner::fail_number(std::size_t begin) const {
  std::size_t end = begin;
  while (end < text_.size() && !ends_word(text_[end])) ++end;
  const std::string_view found = text_.substr(begin, end - begin);
  if (found.empty()) fail_at(begin, "expected a number, found " + quoted(text_.substr(begin, 1)));
  const bool may_be_number = std::all_of(found.begin(), found.end(), [](char c) {
    return (c >= '0' && c <= '9') || c == ',' || c == '.' || c == '-' || c == '+' ||
           to_lower(c) == 'e';
  });
  if (may_be_number && found.find(',') != found.npos) {
    fail_at(begin, quoted(found) + " has a decimal comma; write it with a point");
  }
  double value = 0.0;
  const auto result = std::from_chars(found.data(), found.data() + found.size(), value);
  if (result.ptr == found.data() + found.size()) {
    fail_at(begin, quoted(found) + " is not a finite number up to 1e30; mend or remove the frame");
  }
  fail_at(begin, "expected a number, found " + quoted(found));
}

std::string TextScanner::message_at(std::size_t offset, const std::string& message) const {
  const std::string_view before = text_.substr(0, std::min(offset, text_.size()));
  std::size_t line = 1;
  std::size_t line_begin = before.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const bool crlf = before[i] == '\r' && i + 1 < text_.size() && text_[i + 1] == '\n';
    if (!is_line_end(before[i]) || crlf) continue;
    ++line;
    line_begin = i + 1;
  }
  // Bytes of the form 10xxxxxx continue a character of UTF-8.
  const auto column =
      1 + std::count_if(before.begin() + static_cast<std::ptrdiff_t>(line_begin), before.end(),
                        [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; });
  return std::string(name_) + ':' + std::to_string(line) + ':' + std::to_string(column) + ": " +
         message;
}

void TextScanner::fail_at(std::size_t offset, const std::string& message) const {
  throw base::Error(base::ErrorKind::kFormat, message_at(offset, message));
}

bool equal_but_for_case(std::string_view a, std::string_view b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) {
           return to_lower(x) == to_lower(y);
         });
}

std::string quoted(std::string_view text) {
  if (text.empty()) return "nothing";
  constexpr std::size_t kLongest = 40;
  std::string shown = "'";
  for (const char c : text.substr(0, kLongest)) {
    shown += static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? '?' : c;
  }
  return shown + (text.size() > kLongest ? "...'" : "'");
}

}  // namespace laban::io
