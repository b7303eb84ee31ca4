#include <string>

#include "laban/base/sha256.h"
#include "laban/transfer/style_model.h"

#include "reader_check.h"

namespace {

constexpr std::size_t kDigestSize = 64;  // hexadecimal SHA-256 at the end of a container

}  // namespace

// No mutation keeps a checksum right, so it is put right here: a damaged file is refused by it, but
// one made to harm has it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < kDigestSize) return 0;
  std::string bytes(reinterpret_cast<const char*>(data), size - kDigestSize);
  bytes += laban::base::sha256_hex(bytes);
  return laban::fuzz::check_reader(
      reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), [](std::string_view file) {
        static_cast<void>(laban::transfer::read_style_model(file, "fuzz.laban"));
      });
}
