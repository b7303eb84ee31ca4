#include "captures.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>

#include "laban/io/bvh.h"
#include "laban/io/clip_file.h"

namespace laban::test {

std::optional<std::filesystem::path> captures_root() {
  const char* root = std::getenv("LABAN_DATA");
  if (root == nullptr) return std::nullopt;
  return root;
}

motion::Clip load_capture(const std::filesystem::path& path, int max_frames) {
  if (path.extension() == ".amc") {
    motion::Clip clip = io::read_clip(path).clip;
    return max_frames == 0 ? clip : clip.slice(0, std::min(max_frames, clip.frame_count()));
  }
  std::ifstream file(path);
  EXPECT_TRUE(file.good()) << path;
  std::string text;
  std::string line;
  int rows = -1;  // counted from the line after "Frame Time"
  while (std::getline(file, line) && (max_frames == 0 || rows < max_frames)) {
    text += line + "\n";
    if (rows >= 0) ++rows;
    if (line.find("Frame Time") != std::string::npos) rows = 0;
  }
  return io::read_bvh(text, path.filename().string()).clip;
}

}  // namespace laban::test
