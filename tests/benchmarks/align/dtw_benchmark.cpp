// One pair and all pairs of fragments, 63 dimensions: ns a cell is the figure to compare.

#include <benchmark/benchmark.h>

#include "laban/align/content_groups.h"
#include "laban/align/dtw.h"
#include "laban/base/rng.h"

namespace laban::align {
namespace {

Eigen::MatrixXd random_walk(int dimensions, int frames, base::Rng& rng) {
  Eigen::MatrixXd x(dimensions, frames);
  for (int f = 0; f < frames; ++f) {
    for (int d = 0; d < dimensions; ++d) x(d, f) = (f > 0 ? x(d, f - 1) : 0.0) + 0.1 * rng.normal();
  }
  return x;
}

void count_cells(benchmark::State& state, double cells) {
  state.counters["ns_per_cell"] = benchmark::Counter(
      cells * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void BM_Dtw(benchmark::State& state) {
  base::Rng rng(1);
  const int frames = static_cast<int>(state.range(0));
  const Eigen::MatrixXd x = random_walk(63, frames, rng);
  const Eigen::MatrixXd y = random_walk(63, frames, rng);
  for (auto _ : state) benchmark::DoNotOptimize(dtw(x, y).cost);
  count_cells(state, static_cast<double>(frames) * frames);
}
BENCHMARK(BM_Dtw)->Arg(150)->Arg(600)->Unit(benchmark::kMillisecond);

void BM_AllPairs(benchmark::State& state) {
  base::Rng rng(2);
  std::vector<Eigen::MatrixXd> fragments;
  for (int n = 0; n < 60; ++n) fragments.push_back(random_walk(51, 50 + rng.index(250), rng));
  double cells = 0.0;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    for (std::size_t j = i + 1; j < fragments.size(); ++j) {
      cells += static_cast<double>(fragments[i].cols() * fragments[j].cols());
    }
  }
  for (auto _ : state) benchmark::DoNotOptimize(all_pair_costs(fragments).cost.sum());
  count_cells(state, cells);
}
BENCHMARK(BM_AllPairs)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace laban::align
