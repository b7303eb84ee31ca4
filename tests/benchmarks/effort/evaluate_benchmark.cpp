// Table 1's protocol at its own size: 105 blends of 13 features, 85 to train and 20 to test on,
// three factors, tenfold cross-validation on a grid of 8 x 8. An iteration is 10 runs; the paper's
// 500 take 50 times as long.

#include <benchmark/benchmark.h>

#include "laban/base/rng.h"
#include "laban/effort/evaluation.h"

namespace {

using namespace laban;

effort::StyleSamples blends_of_paper() {
  base::Rng rng(1);
  effort::StyleSamples samples;
  samples.features.resize(effort::feature_count(3), 105);
  for (double& value : samples.features.reshaped()) value = rng.uniform(-3.0, 3.0);
  for (double& alpha : samples.features.row(12)) alpha = rng.uniform(-0.25, 1.25);
  samples.labels = effort::linear_interpolation(samples.features);
  for (double& label : samples.labels.reshaped()) label += 0.5 * rng.normal();
  return samples;
}

void evaluate(benchmark::State& state, std::vector<effort::RegressorKind> models, int threads) {
  const effort::StyleSamples samples = blends_of_paper();
  effort::EvaluationOptions options;
  options.runs = 10;
  options.models = std::move(models);
  options.threads = threads;
  options.grid.relative_widths = {0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 4.0, 8.0};
  options.grid.loss_weights = {0.01, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0, 1e3};
  options.grid.svr_relative_widths = options.grid.relative_widths;
  options.grid.svr_loss_weights = {0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0};
  options.grid.svr_epsilons = {0.1};
  for (auto _ : state) benchmark::DoNotOptimize(effort::evaluate(samples, options));
}

BENCHMARK_CAPTURE(evaluate, both_kernel_ridges_one_thread,
                  {effort::RegressorKind::kKernelRidge,
                   effort::RegressorKind::kResidualKernelRidge},
                  1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(evaluate, svr_two_threads, {effort::RegressorKind::kSupportVector}, 2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
