#include "laban/io/gltf.h"

#include "reader_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return laban::fuzz::check_reader(data, size, [](std::string_view bytes) {
    static_cast<void>(laban::io::read_gltf(bytes, "fuzz.gltf"));
  });
}
