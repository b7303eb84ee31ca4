// The map's sizes that matter: 65 x 65 nodes on 5000 poses of 57 numbers, one thread.
#include <benchmark/benchmark.h>

#include "laban/base/rng.h"
#include "laban/manifold/som.h"

namespace {

Eigen::MatrixXd random_samples(int rows, int columns) {
  laban::base::Rng rng(1);
  Eigen::MatrixXd x(rows, columns);
  for (double& value : x.reshaped()) value = rng.normal();
  return x;
}

void som_epoch(benchmark::State& state) {
  const Eigen::MatrixXd x = random_samples(57, 5000);
  laban::manifold::SomOptions options;
  options.epochs = 4;
  options.mending_rounds = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(laban::manifold::fit_som(x, options));
  }
  state.counters["ms_an_epoch"] = benchmark::Counter(
      4e-3, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(som_epoch)->Unit(benchmark::kMillisecond);

/// All of a map's learning, as asked for by default, on half as many samples as nodes.
void som_by_default(benchmark::State& state) {
  const Eigen::MatrixXd x = random_samples(57, 2000);
  for (auto _ : state) {
    benchmark::DoNotOptimize(laban::manifold::fit_som(x, {}));
  }
}
BENCHMARK(som_by_default)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
