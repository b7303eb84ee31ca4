// make_phrase OUT_DIR: writes the embedded corpus (data/README.md): 60 BVH files to OUT_DIR/phrase
// and OUT_DIR/take.bvh.

#include <filesystem>
#include <fstream>
#include <iostream>

#include "laban/io/bvh.h"

#include "corpus.h"
#include "take.h"

namespace {

/// Of centimetres and degrees: so few that round-off, which may differ between processors, does not
/// reach the file, and that the corpus stays small.
constexpr int kDecimals = 4;

bool write(const std::filesystem::path& path, const laban::motion::Clip& clip) {
  std::ofstream file(path, std::ios::binary);
  file << laban::io::write_bvh(clip, {.decimals = kDecimals}).text;
  file.close();
  if (!file) std::cerr << "make_phrase: " << path.string() << ": could not be written\n";
  return static_cast<bool>(file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_phrase OUT_DIR\n";
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::error_code error;
  std::filesystem::create_directories(folder / "phrase", error);
  for (const laban::phrase::Fragment& fragment : laban::phrase::make_corpus()) {
    if (!write(folder / "phrase" / fragment.file_name, fragment.clip)) return 3;
  }
  return write(folder / "take.bvh", laban::phrase::make_take()) ? 0 : 3;
}
