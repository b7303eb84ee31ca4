#include "laban/io/asf_amc.h"

#include "reader_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return laban::fuzz::check_reader(data, size, [](std::string_view bytes) {
    const laban::io::AsfFile file = laban::io::read_asf(bytes, "fuzz.asf");
    static_cast<void>(laban::io::rest_clip(file));
  });
}
