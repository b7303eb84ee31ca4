#include "access.h"

#include <set>

#include <gtest/gtest.h>

namespace laban::studio {
namespace {

Access access() {
  Access access("secret");
  access.listen_on(8080);
  return access;
}

TEST(Access, LetsInThePageThatWasOpenedWithTheToken) {
  EXPECT_EQ(access().refusal({"127.0.0.1:8080", "http://127.0.0.1:8080", "secret"}), "");
  EXPECT_EQ(access().refusal({"127.0.0.1:8080", std::nullopt, "secret"}), "");
}

TEST(Access, RefusesOtherHostsOriginsAndTokens) {
  const auto refused = [](const Credentials& credentials) {
    EXPECT_NE(access().refusal(credentials), "")
        << credentials.host << " " << credentials.origin.value_or("-") << " " << credentials.token;
  };
  for (const char* host : {"", "localhost:8080", "127.0.0.1", "127.0.0.1:80", "127.0.0.1:8080.evil",
                           "evil.example:8080", "127.0.0.1:8080 "}) {
    refused({host, std::nullopt, "secret"});
  }
  for (const char* origin : {"", "null", "http://127.0.0.1", "https://127.0.0.1:8080",
                             "http://127.0.0.1:8080/", "http://127.0.0.1:80800"}) {
    refused({"127.0.0.1:8080", origin, "secret"});
  }
  for (const char* token : {"", "secre", "secret ", "Secret", "secretsecret"})
    refused({"127.0.0.1:8080", std::nullopt, token});
}

TEST(RandomHex, IsLongAndNeverTheSame) {
  std::set<std::string> seen;
  for (int n = 0; n < 100; ++n) {
    const std::string hex = random_hex(16);
    EXPECT_EQ(hex.size(), 32U);
    EXPECT_EQ(hex.find_first_not_of("0123456789abcdef"), std::string::npos);
    seen.insert(hex);
  }
  EXPECT_EQ(seen.size(), 100U);
}

}  // namespace
}  // namespace laban::studio
