#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace laban::draw {

/// How often `part` occurs in `text`.
inline int count_of(std::string_view text, std::string_view part) {
  int count = 0;
  for (auto at = text.find(part); at != std::string_view::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

/// Big-endian 32-bit number at `offset`.
inline std::uint32_t big_endian(std::string_view bytes, std::size_t offset) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value = (value << 8U) | static_cast<unsigned char>(bytes.at(offset + i));
  }
  return value;
}

/// A PNG file's signature and, from its IHDR chunk, its size.
inline void expect_png(std::string_view bytes, std::uint32_t width, std::uint32_t height) {
  ASSERT_GT(bytes.size(), 33U);
  EXPECT_EQ(bytes.substr(0, 8), std::string_view("\x89PNG\r\n\x1a\n", 8));
  EXPECT_EQ(bytes.substr(12, 4), "IHDR");
  EXPECT_EQ(big_endian(bytes, 16), width);
  EXPECT_EQ(big_endian(bytes, 20), height);
}

/// Why `xml` is not well formed, empty if it is: a small checker of tags, attributes and entities,
/// enough for files without comments, CDATA or DOCTYPE.
inline std::string xml_fault(std::string_view xml) {
  std::vector<std::string> open;
  std::size_t roots = 0;
  std::size_t at = 0;
  const std::string_view header = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>";
  if (!xml.starts_with(header)) return "no XML declaration";
  at = header.size();
  while (at < xml.size()) {
    const char c = xml[at];
    if (c == '&') {
      bool known = false;
      for (const std::string_view name : {"&amp;", "&lt;", "&gt;", "&quot;"}) {
        known = known || xml.substr(at).starts_with(name);
      }
      if (!known) return "an unknown entity at " + std::to_string(at);
    }
    if (c != '<') {
      if (open.empty() && c != '\n') return "text outside of the root at " + std::to_string(at);
      if (static_cast<unsigned char>(c) < 32 && c != '\n') return "a control character";
      ++at;
      continue;
    }
    const std::size_t end = xml.find('>', at);
    if (end == std::string_view::npos) return "an open tag at " + std::to_string(at);
    std::string_view tag = xml.substr(at + 1, end - at - 1);
    at = end + 1;
    if (tag.find('<') != std::string_view::npos) return "'<' in a tag";
    if (tag.starts_with('/')) {
      if (open.empty() || open.back() != tag.substr(1)) return "a stray end: " + std::string(tag);
      open.pop_back();
      continue;
    }
    if (count_of(tag, "\"") % 2 != 0) return "an odd quote in " + std::string(tag);
    if (tag.find("nan") != std::string_view::npos || tag.find("inf\"") != std::string_view::npos) {
      return "a number that is not finite in " + std::string(tag);
    }
    if (open.empty()) ++roots;
    if (tag.ends_with('/')) continue;
    open.emplace_back(tag.substr(0, tag.find_first_of(" \n")));
  }
  if (!open.empty()) return "never closed: " + open.back();
  return roots == 1 ? "" : std::to_string(roots) + " roots";
}

}  // namespace laban::draw
