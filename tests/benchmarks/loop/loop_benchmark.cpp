// One seam of 50 frames x 60 joints, Poisson smoothing of 100 frames x 60 rows, and 1700 frames of
// a kick: of $LABAN_DATA where it is set (the paper's 209 frames), else of the embedded corpus.

#include <cstdlib>
#include <filesystem>

#include <benchmark/benchmark.h>

#include "laban/base/rng.h"
#include "laban/io/clip_file.h"
#include "laban/loop/endless_loop.h"
#include "laban/loop/graph_cut_seam.h"
#include "laban/loop/poisson.h"

namespace laban::loop {
namespace {

constexpr int kRows = 60;

/// A tree of limbs of five joints each.
std::vector<int> limbs() {
  std::vector<int> parents = {-1};
  for (int r = 1; r < kRows; ++r) parents.push_back(r % 5 == 1 ? 0 : r - 1);
  return parents;
}

std::vector<Eigen::MatrixXd> random_rows(int frames, base::Rng& rng) {
  std::vector<Eigen::MatrixXd> rows(kRows, Eigen::MatrixXd(4, frames));
  for (Eigen::MatrixXd& row : rows) {
    for (int t = 0; t < frames; ++t) {
      for (int c = 0; c < 4; ++c) row(c, t) = (t > 0 ? row(c, t - 1) : 0.0) + 0.1 * rng.normal();
      row.col(t).normalize();
    }
  }
  return rows;
}

/// Costs of the graph and its minimum cut.
void BM_Seam(benchmark::State& state) {
  base::Rng rng(1);
  const int frames = static_cast<int>(state.range(0));
  const auto a = random_rows(frames, rng);
  const auto b = random_rows(frames, rng);
  const auto metric = static_cast<SeamMetric>(state.range(1));
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        minimum_seam(seam_costs(a, b, limbs(), Eigen::VectorXd::Ones(kRows), metric, 12)).cost);
  }
}
BENCHMARK(BM_Seam)->Args({50, 0})->Args({50, 1})->Unit(benchmark::kMicrosecond);

/// The grid set up and solved for one channel of 60 rows, as for a new length; then solved alone.
void BM_Poisson(benchmark::State& state) {
  base::Rng rng(2);
  Eigen::MatrixXd right(kRows, state.range(0));
  for (Eigen::Index n = 0; n < right.size(); ++n) right(n) = rng.normal();
  for (auto _ : state) {
    const PoissonGrid grid(limbs(), static_cast<int>(state.range(0)), 0.01);
    benchmark::DoNotOptimize(grid.solve(right).data());
  }
}
BENCHMARK(BM_Poisson)->Arg(100)->Arg(300)->Unit(benchmark::kMicrosecond);

void BM_PoissonSolveOnly(benchmark::State& state) {
  base::Rng rng(2);
  Eigen::MatrixXd right(kRows, state.range(0));
  for (Eigen::Index n = 0; n < right.size(); ++n) right(n) = rng.normal();
  const PoissonGrid grid(limbs(), static_cast<int>(state.range(0)), 0.01);
  for (auto _ : state) benchmark::DoNotOptimize(grid.solve(right).data());
}
BENCHMARK(BM_PoissonSolveOnly)->Arg(100)->Arg(300)->Unit(benchmark::kMicrosecond);

/// All three channels of rotations, as a seam smooths them: one grid, one stacked right side.
void BM_PoissonOfRotations(benchmark::State& state) {
  base::Rng rng(2);
  Eigen::MatrixXd right(3 * kRows, state.range(0));
  for (Eigen::Index n = 0; n < right.size(); ++n) right(n) = rng.normal();
  for (auto _ : state) {
    const PoissonGrid grid(limbs(), static_cast<int>(state.range(0)), 0.01);
    benchmark::DoNotOptimize(grid.solve(right).data());
  }
}
BENCHMARK(BM_PoissonOfRotations)->Arg(100)->Unit(benchmark::kMicrosecond);

motion::Capture kick() {
  const char* data = std::getenv("LABAN_DATA");
  const std::filesystem::path captured =
      data == nullptr
          ? ""
          : std::filesystem::path(data) / "cmu_clips/kungfu_135_07_one_kick_209f_60fps.bvh";
  const std::filesystem::path embedded =
      std::filesystem::path(LABAN_SOURCE_DIR) / "data/phrase/phrase_kick_p01.bvh";
  return motion::find_capture(
      io::read_clip(std::filesystem::exists(captured) ? captured : embedded).clip);
}

/// From the capture to 1700 frames: turning points, seams, playback, feet.
void BM_Synthesize1700Frames(benchmark::State& state) {
  const motion::Capture capture = kick();
  for (auto _ : state) {
    LoopOptions options;
    options.hold_feet = state.range(0) != 0;
    benchmark::DoNotOptimize(EndlessLoop(capture, options).next(1700).source_frames.data());
  }
}
BENCHMARK(BM_Synthesize1700Frames)->ArgName("feet")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace laban::loop
