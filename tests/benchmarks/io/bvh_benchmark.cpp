// A BVH file of 100 MB, 43 joints at six decimals, from disk into a Clip: bytes a second and the
// memory that takes, as a multiple of the clip it makes. The file is in the page cache.

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <benchmark/benchmark.h>
#include <unistd.h>

#include "laban/base/rng.h"
#include "laban/io/clip_file.h"

namespace laban::io {
namespace {

namespace fs = std::filesystem;

constexpr int kJoints = 43;
constexpr std::size_t kFileSize = 100'000'000;

void append_fixed(std::string& text, double value) {
  char digits[40];
  const auto [last, status] =
      std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed, 6);
  text.append(digits, last);
  text += ' ';
}

std::string hierarchy() {
  std::string text = "HIERARCHY\n";
  for (int j = 0; j < kJoints; ++j) {
    text += j == 0 ? "ROOT " : "JOINT ";
    text += "joint" + std::to_string(j) + " {\nOFFSET 0.100000 2.500000 0.000000\n" +
            (j == 0 ? "CHANNELS 6 Xposition Yposition Zposition" : "CHANNELS 3") +
            " Zrotation Yrotation Xrotation\n";
    // A chain of short limbs, five joints each, from the root.
    if (j % 5 == 0 && j > 0) text += std::string(5, '}');
  }
  text += "End Site { OFFSET 0 1 0 }\n";
  const auto open = static_cast<std::size_t>(std::count(text.begin(), text.end(), '{') -
                                             std::count(text.begin(), text.end(), '}'));
  return text + std::string(open, '}') + "\n";
}

/// Angles that wander as a walker's do: most within a right angle, some past half a turn.
std::string rows(std::size_t size, int& row_count) {
  constexpr int kColumns = 3 * kJoints + 3;
  base::Rng rng(1);
  std::vector<double> values(kColumns);
  for (double& value : values) value = 40.0 * rng.normal();
  std::string text;
  text.reserve(size + 4096);
  for (row_count = 0; text.size() < size; ++row_count) {
    for (double& value : values) {
      value = 0.999 * value + 2.0 * rng.normal();
      append_fixed(text, value);
    }
    text.back() = '\n';
  }
  return text;
}

/// Written once, removed at the end.
class BenchmarkFile {
 public:
  BenchmarkFile()
      : path_(fs::temp_directory_path() /
              ("laban_bvh_benchmark_" + std::to_string(::getpid()) + ".bvh")) {
    int row_count = 0;
    const std::string motion = rows(kFileSize, row_count);
    std::ofstream(path_, std::ios::binary)
        << hierarchy() << "MOTION\nFrames: " << row_count << "\nFrame Time: 0.008333\n"
        << motion;
  }
  BenchmarkFile(const BenchmarkFile&) = delete;
  BenchmarkFile& operator=(const BenchmarkFile&) = delete;
  ~BenchmarkFile() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  [[nodiscard]] const fs::path& path() const noexcept { return path_; }

 private:
  fs::path path_;
};

const fs::path& benchmark_file() {
  static const BenchmarkFile file;
  return file.path();
}

/// A line of /proc/self/status, bytes.
double status_bytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key)) return 1024.0 * std::atof(line.c_str() + key.size());
  }
  return 0.0;
}

/// Makes the peak of the resident memory start anew.
void forget_peak() {
  std::ofstream("/proc/self/clear_refs") << "5";
}

double bytes_of(const motion::Clip& clip) {
  const double cells = static_cast<double>(clip.frame_count()) * clip.joint_count();
  return cells * (sizeof(Eigen::Quaterniond) + (clip.has_translations() ? 24.0 : 0.0)) +
         24.0 * clip.frame_count();
}

void BM_ReadClip(benchmark::State& state) {
  const fs::path& path = benchmark_file();
  double peak = 0.0;
  for (auto _ : state) {
    forget_peak();
    const double before = status_bytes("VmRSS:");
    const ClipFile file = read_clip(path);
    peak = (status_bytes("VmHWM:") - before) / bytes_of(file.clip);
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(fs::file_size(path)));
  state.counters["peak_per_clip"] = peak;
}
BENCHMARK(BM_ReadClip)->Unit(benchmark::kMillisecond)->Iterations(5);

}  // namespace
}  // namespace laban::io
