#pragma once

#include <map>
#include <regex>
#include <string>
#include <vector>

namespace laban::studies {

/// Fields of a name under a pattern such as "{content}_{performer}".
inline std::map<std::string, std::string> match(const std::string& pattern,
                                                const std::string& stem) {
  std::string expression;
  std::vector<std::string> fields;
  for (std::size_t at = 0; at < pattern.size(); ++at) {
    const std::size_t end = pattern[at] == '{' ? pattern.find('}', at) : std::string::npos;
    if (end == std::string::npos) {
      expression += std::string("[") + pattern[at] + "]";
      continue;
    }
    fields.push_back(pattern.substr(at + 1, end - at - 1));
    expression += "(.+?)";
    at = end;
  }
  std::map<std::string, std::string> found;
  std::smatch parts;
  if (!std::regex_match(stem, parts, std::regex(expression))) return found;
  for (std::size_t n = 0; n < fields.size(); ++n) {
    found[fields[n] == "style" ? "performer" : fields[n]] = parts[n + 1];
  }
  return found;
}

}  // namespace laban::studies
