// Writing 60 s at 120 Hz of 25 joints as GLB, whole and compact, and reading it back: megabytes of
// the file a second.

#include <cmath>

#include <benchmark/benchmark.h>

#include "laban/io/gltf.h"
#include "laban/math/rotation.h"

namespace laban::io {
namespace {

motion::Clip long_clip() {
  constexpr int kJoints = 25;
  constexpr int kFrames = 60 * 120;
  std::vector<motion::Joint> joints;
  for (int j = 0; j < kJoints; ++j) {
    joints.push_back({"joint" + std::to_string(j), j - 1, {0.0, 0.1, 0.0}, std::nullopt});
  }
  Eigen::Matrix3Xd root(3, kFrames);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < kFrames; ++f) {
    root.col(f) << 0.01 * f, 1.0, std::sin(0.01 * f);
    for (int j = 0; j < kJoints; ++j) {
      rotations.push_back(
          math::exp(Eigen::Vector3d(std::sin(0.02 * f + j), std::cos(0.03 * f), 0.1)));
    }
  }
  return {std::make_shared<const motion::Skeleton>(std::move(joints)), 120.0, std::move(root),
          std::move(rotations)};
}

void BM_WriteGlb(benchmark::State& state) {
  const motion::Clip clip = long_clip();
  GlbWriteOptions options;
  if (state.range(0) != 0) options.compact.emplace();
  std::size_t bytes = 0;
  for (auto _ : state) {
    const std::string glb = write_glb(clip, options);
    bytes = glb.size();
    benchmark::DoNotOptimize(glb.data());
  }
  state.counters["file_megabytes"] = static_cast<double>(bytes) * 1e-6;
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes));
}
BENCHMARK(BM_WriteGlb)->ArgName("compact")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

void BM_ReadGlb(benchmark::State& state) {
  const std::string glb = write_glb(long_clip());
  for (auto _ : state) {
    benchmark::DoNotOptimize(read_gltf(glb, "long.glb").clip.frame_count());
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(glb.size()));
}
BENCHMARK(BM_ReadGlb)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace laban::io
