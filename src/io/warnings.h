#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/text_scanner.h"

namespace laban::io {

/// Warnings in the order of the file; each kind is said once, or a file of them would drown the
/// rest.
class Warnings {
 public:
  explicit Warnings(const TextScanner& scanner) : scanner_(scanner) {}

  /// @param kind  outlives the warnings: a literal.
  void add_once(std::string_view kind, std::size_t offset, const std::string& message) {
    if (std::find(kinds_.begin(), kinds_.end(), kind) != kinds_.end()) return;
    kinds_.push_back(kind);
    messages_.push_back(scanner_.message_at(offset, message));
  }
  [[nodiscard]] std::vector<std::string> take() { return std::move(messages_); }

 private:
  const TextScanner& scanner_;
  std::vector<std::string_view> kinds_;
  std::vector<std::string> messages_;
};

}  // namespace laban::io
