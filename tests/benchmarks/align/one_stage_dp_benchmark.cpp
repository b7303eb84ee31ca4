// 60 s at 30 Hz against a database of S frames: ns a cell is the figure to compare. And the largest
// case promised, T 10 000 x S 50 000 in under 200 MB: the peak memory of the whole program.

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include "laban/align/one_stage_dp.h"
#include "laban/base/rng.h"

namespace laban::align {
namespace {

void BM_Segment(benchmark::State& state) {
  base::Rng rng(1);
  const auto random = [&](int frames) {
    Eigen::MatrixXd x(51, frames);
    for (Eigen::Index n = 0; n < x.size(); ++n) x(n) = rng.normal();
    return x;
  };
  std::vector<Eigen::MatrixXd> fragments;
  double frames = 0.0;
  for (int n = 0; n < state.range(0); ++n) {
    fragments.push_back(random(100 + rng.index(160)));
    frames += static_cast<double>(fragments.back().cols());
  }
  const Eigen::MatrixXd input = random(1800);
  for (auto _ : state) benchmark::DoNotOptimize(segment(input, fragments)->cost);
  state.counters["ns_per_cell"] =
      benchmark::Counter(1800.0 * frames * 1e-9, benchmark::Counter::kIsIterationInvariantRate |
                                                     benchmark::Counter::kInvert);
}
BENCHMARK(BM_Segment)->Arg(60)->Unit(benchmark::kMillisecond);

void BM_SegmentLongInputAgainstLargeDatabase(benchmark::State& state) {
  base::Rng rng(2);
  const auto random = [&](int frames) {
    Eigen::MatrixXd x(state.range(0), frames);
    for (Eigen::Index n = 0; n < x.size(); ++n) x(n) = rng.normal();
    return x;
  };
  std::vector<Eigen::MatrixXd> fragments;
  for (int n = 0; n < 250; ++n) fragments.push_back(random(200));
  const Eigen::MatrixXd input = random(10000);
  for (auto _ : state) benchmark::DoNotOptimize(segment(input, fragments)->cost);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["peak_megabytes"] = static_cast<double>(usage.ru_maxrss) / 1024.0;
  state.counters["ns_per_cell"] =
      benchmark::Counter(1e4 * 5e4 * 1e-9, benchmark::Counter::kIsIterationInvariantRate |
                                               benchmark::Counter::kInvert);
}
BENCHMARK(BM_SegmentLongInputAgainstLargeDatabase)
    ->Arg(20)
    ->Arg(63)
    ->Iterations(1)
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace laban::align
