#include "access.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include <sys/random.h>

#include "laban/base/error.h"

namespace laban::studio {
namespace {

/// Takes as long whatever the first byte that differs.
bool same_secret(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned differing = 0;
  for (std::size_t n = 0; n < a.size(); ++n)
    differing |=
        static_cast<unsigned char>(a[n]) ^ static_cast<unsigned>(static_cast<unsigned char>(b[n]));
  return differing == 0;
}

}  // namespace

std::string random_hex(int bytes) {
  std::vector<unsigned char> random(static_cast<std::size_t>(bytes));
  if (::getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size())) {
    throw base::Error(base::ErrorKind::kIo,
                      std::string("the system gives no random numbers: ") + std::strerror(errno));
  }
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string hex;
  for (const unsigned char byte : random) {
    hex += kDigits[byte / 16];
    hex += kDigits[byte % 16];
  }
  return hex;
}

void Access::listen_on(unsigned short port) {
  host_ = "127.0.0.1:" + std::to_string(port);
}

std::string Access::refusal(const Credentials& credentials) const {
  if (credentials.host != host_) return "this address is not the studio's";
  if (credentials.origin && *credentials.origin != "http://" + host_)
    return "another page may not ask";
  if (!same_secret(credentials.token, token_))
    return "the token is missing or wrong; open the address that 'laban studio' printed";
  return {};
}

}  // namespace laban::studio
