// make_phrase OUT_DIR: writes the embedded corpus, 60 BVH files (data/README.md).

#include <filesystem>
#include <fstream>
#include <iostream>

#include "laban/io/bvh.h"

#include "corpus.h"

namespace {

/// Of centimetres and degrees: so few that round-off, which may differ between processors, does not
/// reach the file, and that the corpus stays small.
constexpr int kDecimals = 4;

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_phrase OUT_DIR\n";
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  for (const laban::phrase::Fragment& fragment : laban::phrase::make_corpus()) {
    const std::filesystem::path path = folder / fragment.file_name;
    std::ofstream file(path, std::ios::binary);
    file << laban::io::write_bvh(fragment.clip, {.decimals = kDecimals}).text;
    file.close();
    if (!file) {
      std::cerr << "make_phrase: " << path.string() << ": could not be written\n";
      return 3;
    }
  }
  return 0;
}
