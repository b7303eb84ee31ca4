#include "http.h"

#include <nlohmann/json.hpp>

namespace laban::studio {
namespace {

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  throw HttpError(400, "a broken escape in the address");
}

}  // namespace

Response error_response(unsigned status, const std::string& what) {
  // Messages may quote bytes of files that are no UTF-8.
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  return {status, "application/json",
          nlohmann::json{{"error", what}}.dump(-1, ' ', false, kReplace)};
}

std::string percent_decoded(const std::string& text) {
  std::string decoded;
  for (std::size_t n = 0; n < text.size(); ++n) {
    if (text[n] == '+') {
      decoded += ' ';
    } else if (text[n] != '%') {
      decoded += text[n];
    } else {
      if (n + 2 >= text.size()) throw HttpError(400, "a broken escape in the address");
      const int value = 16 * hex_digit(text[n + 1]) + hex_digit(text[n + 2]);
      decoded += static_cast<char>(static_cast<unsigned char>(value));
      n += 2;
    }
    if (decoded.back() == '\0') throw HttpError(400, "a zero byte in the address");
  }
  return decoded;
}

void parse_target(const std::string& target, Request& request) {
  if (!target.starts_with('/')) throw HttpError(400, "an address begins with '/'");
  const std::size_t mark = target.find('?');
  request.path = percent_decoded(target.substr(0, mark));
  if (mark == std::string::npos) return;
  std::string rest = target.substr(mark + 1);
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('&'), rest.size());
    const std::string pair = rest.substr(0, end);
    const std::size_t equals = std::min(pair.find('='), pair.size());
    const std::string value = equals < pair.size() ? pair.substr(equals + 1) : std::string();
    request.query[percent_decoded(pair.substr(0, equals))] = percent_decoded(value);
    rest.erase(0, end + 1);
  }
}

}  // namespace laban::studio
