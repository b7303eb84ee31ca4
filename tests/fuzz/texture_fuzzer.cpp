#include "laban/texture/texture_file.h"

#include "reader_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return laban::fuzz::check_container_reader(data, size, [](std::string_view file) {
    static_cast<void>(laban::texture::read_texture(file, "fuzz.texture"));
  });
}
