#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace laban::studio {

/// Random bytes of the system as hexadecimal digits, two a byte.
/// @throws Error{kIo} if the system has none.
[[nodiscard]] std::string random_hex(int bytes);

/// What a request says of who asks.
struct Credentials {
  std::string_view host;                   ///< header Host
  std::optional<std::string_view> origin;  ///< header Origin
  std::string_view token;                  ///< header X-Laban-Token, or of the page its query
};

/// Who may ask: the page that was opened with the token, and nobody else. Other users of the
/// machine lack the token; other pages in the same browser lack it too, and carry another Origin; a
/// name that somebody makes point to this machine is another Host.
class Access {
 public:
  explicit Access(std::string token) : token_(std::move(token)) {}

  /// Tells the port once it is known.
  void listen_on(unsigned short port);
  /// Why the request is refused; empty: it may ask.
  [[nodiscard]] std::string refusal(const Credentials& credentials) const;
  [[nodiscard]] const std::string& token() const noexcept { return token_; }
  /// "127.0.0.1:8080"
  [[nodiscard]] const std::string& host() const noexcept { return host_; }

 private:
  std::string token_;
  std::string host_;
};

}  // namespace laban::studio
