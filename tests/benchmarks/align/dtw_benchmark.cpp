// One pair and all pairs of fragments, 63 dimensions: ns a cell is the figure to compare.

#include <cmath>
#include <limits>

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

/// 60 fragments of 50 to 300 frames, 51 dimensions.
std::vector<Eigen::MatrixXd> sixty_fragments() {
  base::Rng rng(2);
  std::vector<Eigen::MatrixXd> fragments;
  for (int n = 0; n < 60; ++n) fragments.push_back(random_walk(51, 50 + rng.index(251), rng));
  return fragments;
}

double pair_cells(const std::vector<Eigen::MatrixXd>& fragments) {
  double cells = 0.0;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    for (std::size_t j = i + 1; j < fragments.size(); ++j) {
      cells += static_cast<double>(fragments[i].cols() * fragments[j].cols());
    }
  }
  return cells;
}

/// The recursion as METHODS 1.1 writes it: distances by a loop over the features, one row of sums.
double plain_dtw(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  const auto m = static_cast<std::size_t>(y.cols());
  std::vector<double> row(m, std::numeric_limits<double>::infinity());
  for (Eigen::Index p = 0; p < x.cols(); ++p) {
    double diagonal = p == 0 ? 0.0 : std::numeric_limits<double>::infinity();
    double left = std::numeric_limits<double>::infinity();
    const double* frame_p = x.data() + p * x.rows();
    for (std::size_t q = 0; q < m; ++q) {
      const double* frame_q = y.data() + static_cast<Eigen::Index>(q) * y.rows();
      double distance = 0.0;
      for (Eigen::Index k = 0; k < x.rows(); ++k) {
        const double difference = frame_p[k] - frame_q[k];
        distance += difference * difference;
      }
      const double above = row[q];
      left = distance + std::min(diagonal, std::min(above, left));
      row[q] = left;
      diagonal = above;
    }
  }
  return row.back();
}

void BM_AllPairsPlainLoop(benchmark::State& state) {
  const auto fragments = sixty_fragments();
  for (auto _ : state) {
    double sum = 0.0;
    for (std::size_t i = 0; i < fragments.size(); ++i) {
      for (std::size_t j = i + 1; j < fragments.size(); ++j) {
        sum += plain_dtw(fragments[i], fragments[j]);
      }
    }
    benchmark::DoNotOptimize(sum);
  }
  count_cells(state, pair_cells(fragments));
}
BENCHMARK(BM_AllPairsPlainLoop)->Unit(benchmark::kMillisecond);

/// By threads; `largest_error` is that of a mean cost against the plain loop's, in mean cells.
void BM_AllPairs(benchmark::State& state) {
  const auto fragments = sixty_fragments();
  const int threads = static_cast<int>(state.range(0));
  PairCosts costs;
  for (auto _ : state) {
    costs = all_pair_costs(fragments, threads);
    benchmark::DoNotOptimize(costs.cost.data());
  }
  double largest_error = 0.0;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    for (std::size_t j = i + 1; j < fragments.size(); ++j) {
      const double plain = plain_dtw(fragments[i], fragments[j]);
      const double cost = costs.cost(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      largest_error = std::max(largest_error, std::abs(cost - plain) / plain);
    }
  }
  state.counters["largest_error"] = largest_error;
  count_cells(state, pair_cells(fragments));
}
BENCHMARK(BM_AllPairs)
    ->Arg(1)
    ->Arg(2)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace laban::align
