#include "file_pattern.h"

#include <algorithm>

#include "laban/base/error.h"

namespace laban::cli {

FilePattern::FilePattern(const std::string& pattern) {
  const auto refuse = [&](const std::string& why) {
    throw base::Error(base::ErrorKind::kUsage, "--pattern '" + pattern + "': " + why);
  };
  pieces_.push_back({"", ""});
  for (std::size_t at = 0; at < pattern.size(); ++at) {
    if (pattern[at] != '{') {
      pieces_.back().literal += pattern[at];
      continue;
    }
    const std::size_t close = pattern.find('}', at);
    if (close == std::string::npos) refuse("a brace is not closed");
    const std::string name = pattern.substr(at + 1, close - at - 1);
    if (name.empty()) refuse("a name in braces is empty");
    if (has(name)) refuse("{" + name + "} stands in it twice");
    if (pieces_.size() > 1 && pieces_.back().literal.empty())
      refuse("two names need something between them");
    pieces_.push_back({name, ""});
    at = close;
  }
}

bool FilePattern::has(const std::string& name) const {
  return std::any_of(pieces_.begin(), pieces_.end(),
                     [&](const Piece& piece) { return piece.name == name; });
}

std::optional<std::map<std::string, std::string>> FilePattern::match(
    const std::string& stem) const {
  std::map<std::string, std::string> taken;
  const std::string& head = pieces_.front().literal;
  if (!stem.starts_with(head) || !match_from(1, head.size(), stem, taken)) return std::nullopt;
  return taken;
}

bool FilePattern::match_from(std::size_t piece, std::size_t at, const std::string& stem,
                             std::map<std::string, std::string>& taken) const {
  if (piece == pieces_.size()) return at == stem.size();
  const Piece& current = pieces_[piece];
  for (std::size_t end = at + 1; end <= stem.size(); ++end) {
    if (stem.compare(end, current.literal.size(), current.literal) != 0) continue;
    if (!match_from(piece + 1, end + current.literal.size(), stem, taken)) continue;
    taken[current.name] = stem.substr(at, end - at);
    return true;
  }
  return false;
}

}  // namespace laban::cli
