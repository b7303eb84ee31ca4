#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace laban::cli {

/// A pattern such as 'dataset-1_{content}_{style}_{take}' matched against a whole file name without
/// its ending. A name in braces takes at least one character, as few as the rest allows; all else
/// stands for itself.
class FilePattern {
 public:
  /// @throws Error{kUsage} for an unclosed brace, an empty or repeated name, or two names with
  ///         nothing between them.
  explicit FilePattern(const std::string& pattern);

  /// What each name took, or nothing if the stem does not match.
  [[nodiscard]] std::optional<std::map<std::string, std::string>> match(
      const std::string& stem) const;
  [[nodiscard]] bool has(const std::string& name) const;

 private:
  struct Piece {
    std::string name;     ///< takes text, then ..
    std::string literal;  ///< .. this; the first piece has no name
  };
  [[nodiscard]] bool match_from(std::size_t piece, std::size_t at, const std::string& stem,
                                std::map<std::string, std::string>& taken) const;
  std::vector<Piece> pieces_;
};

}  // namespace laban::cli
