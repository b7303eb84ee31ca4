// 60 s at 30 Hz against a database of S frames: ns a cell is the figure to compare. And the largest
// case promised, T 10 000 x S 50 000 in under 200 MB: the peak memory of the whole program.

#include <limits>
#include <utility>

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include "laban/align/one_stage_dp.h"
#include "laban/base/rng.h"

namespace laban::align {
namespace {

struct Problem {
  Eigen::MatrixXd input;
  std::vector<Eigen::MatrixXd> fragments;
  double cells = 0.0;
};

/// 51 dimensions, fragments of 100 to 259 frames until they have `frames` together.
Problem random_problem(int input_frames, int frames) {
  base::Rng rng(1);
  const auto random = [&](int count) {
    Eigen::MatrixXd x(51, count);
    for (Eigen::Index n = 0; n < x.size(); ++n) x(n) = rng.normal();
    return x;
  };
  Problem problem{random(input_frames), {}};
  double sum = 0.0;
  while (sum < frames) {
    problem.fragments.push_back(random(100 + rng.index(160)));
    sum += static_cast<double>(problem.fragments.back().cols());
  }
  problem.cells = sum * input_frames;
  return problem;
}

void count_cells(benchmark::State& state, double cells) {
  state.counters["ns_per_cell"] = benchmark::Counter(
      cells * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// The recursion as METHODS 1.5 writes it: distances by a loop over the features, a fragment's
/// cells one after the other, each with the frame at which its snippet began.
class PlainOneStage {
 public:
  explicit PlainOneStage(const Problem& problem) : problem_(problem) {
    for (const Eigen::MatrixXd& fragment : problem.fragments) {
      cells_.emplace_back(static_cast<std::size_t>(fragment.cols()));
    }
  }

  /// The snippets' ends and fragments, from the last on.
  [[nodiscard]] std::vector<std::pair<int, int>> run() {
    const auto count = static_cast<int>(problem_.input.cols());
    std::vector<Cell> best(static_cast<std::size_t>(count));
    std::vector<int> fragment(static_cast<std::size_t>(count));
    double before = 0.0;
    for (int p = 0; p < count; ++p) {
      const auto frame = static_cast<std::size_t>(p);
      for (std::size_t i = 0; i < cells_.size(); ++i) {
        advance(p, i, {before, p});
        if (!(cells_[i].back().cost < best[frame].cost)) continue;
        best[frame] = cells_[i].back();
        fragment[frame] = static_cast<int>(i);
      }
      before = best[frame].cost;
    }
    std::vector<std::pair<int, int>> snippets;
    for (int end = count; end > 0; end = best[static_cast<std::size_t>(end - 1)].entry) {
      snippets.emplace_back(end, fragment[static_cast<std::size_t>(end - 1)]);
    }
    return snippets;
  }

 private:
  struct Cell {
    double cost = std::numeric_limits<double>::infinity();
    int entry = 0;
  };

  void advance(int p, std::size_t i, const Cell& entering) {
    const Eigen::MatrixXd& fragment = problem_.fragments[i];
    const double* input = problem_.input.data() + p * fragment.rows();
    Cell diagonal;
    Cell left = entering;
    for (std::size_t q = 0; q < cells_[i].size(); ++q) {
      const double* frame = fragment.data() + static_cast<Eigen::Index>(q) * fragment.rows();
      double distance = 0.0;
      for (Eigen::Index k = 0; k < fragment.rows(); ++k) {
        distance += (input[k] - frame[k]) * (input[k] - frame[k]);
      }
      const Cell above = cells_[i][q];
      Cell cell = diagonal;
      if (above.cost < cell.cost) cell = above;
      if (left.cost < cell.cost) cell = left;
      left = {cell.cost + distance, cell.entry};
      cells_[i][q] = left;
      diagonal = above;
    }
  }

  const Problem& problem_;
  std::vector<std::vector<Cell>> cells_;  // of the previous input frame
};

void BM_SegmentPlainLoop(benchmark::State& state) {
  const Problem problem = random_problem(1800, static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(PlainOneStage(problem).run().size());
  count_cells(state, problem.cells);
}
BENCHMARK(BM_SegmentPlainLoop)->Arg(10000)->Unit(benchmark::kMillisecond);

/// `same_as_plain` is 1 if the plain loop cuts the same snippets (looked at where it is quick).
void BM_Segment(benchmark::State& state) {
  const Problem problem =
      random_problem(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  std::optional<Segmentation> found;
  for (auto _ : state) {
    found = segment(problem.input, problem.fragments);
    benchmark::DoNotOptimize(found->cost);
  }
  count_cells(state, problem.cells);
  if (state.range(1) > 10000) return;
  std::vector<std::pair<int, int>> snippets;
  for (const Snippet& snippet : found->snippets) {
    snippets.emplace(snippets.begin(), snippet.end, snippet.fragment);
  }
  state.counters["same_as_plain"] = snippets == PlainOneStage(problem).run() ? 1.0 : 0.0;
}
BENCHMARK(BM_Segment)
    ->Args({1800, 10000})
    ->Args({900, 10000})
    ->Args({1800, 5000})
    ->Args({1800, 170000})
    ->Unit(benchmark::kMillisecond);

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
