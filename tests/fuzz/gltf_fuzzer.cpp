#include "laban/io/gltf.h"

#include "reader_check.h"

namespace {

// What was read from a hostile file is written back too, where that is soon done.
constexpr int kFewCells = 4096;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return laban::fuzz::check_reader(data, size, [](std::string_view bytes) {
    const laban::io::GltfFile file = laban::io::read_gltf(bytes, "fuzz.gltf");
    if (file.clip.frame_count() > kFewCells / file.clip.joint_count()) return;
    static_cast<void>(laban::io::write_glb(*file.asset, file.clip));
  });
}
