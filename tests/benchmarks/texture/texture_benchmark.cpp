// Learning of motion textures at the size of [Li02]: 60 rows, 15 states, 246 textons.

#include <limits>

#include <benchmark/benchmark.h>

#include "laban/texture/learn_texture.h"
#include "laban/texture/semi_markov_search.h"

#include "samples.h"
#include "texture/term_table.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kRows = 60;
constexpr int kStates = 15;
constexpr int kTakeFrames = 900;

/// Textons and some motion for them to explain: what it is does not change the work.
struct Scene {
  MatrixXd observations;
  FloatObservations y;
  std::vector<Take> takes;
  std::vector<Texton> textons;
  LogTransitions transitions;
  std::vector<int> is_new;

  Scene(int frames, int textons_wanted) : Scene(frames, textons_wanted, base::Rng(1)) {}

 private:
  Scene(int frames, int textons_wanted, base::Rng rng)
      : observations(test::normal_matrix(kRows, frames, rng)),
        y(observations),
        transitions(chain(textons_wanted)),
        is_new(static_cast<std::size_t>(textons_wanted), -1) {
    for (int begin = 0; begin < frames; begin += kTakeFrames)
      takes.push_back({"", begin, std::min(kTakeFrames, frames - begin), 0, 1.0});
    for (int i = 0; i < textons_wanted; ++i) {
      Texton texton = test::known_texton(kRows, kStates, rng);
      texton.start_mean = Eigen::VectorXd::Zero(2 * kStates);
      texton.start_covariance = MatrixXd::Identity(2 * kStates, 2 * kStates);
      textons.push_back(std::move(texton));
    }
  }
  /// Each texton goes on to the next two.
  static MatrixXd chain(int textons) {
    MatrixXd matrix = MatrixXd::Zero(textons, textons);
    for (int i = 0; i < textons; ++i) {
      matrix(i, (i + 1) % textons) += 0.5;
      matrix(i, (i + 2) % textons) += 0.5;
    }
    return matrix;
  }
};

/// Likelihood terms and search of one E-step on one thread.
void search_round(const Scene& scene) {
  TermTable table(scene.y, scene.takes, 1);
  table.set_textons(scene.textons, scene.is_new);
  for (const Take& take : scene.takes) {
    benchmark::DoNotOptimize(
        search_segments(take.length, 60, scene.transitions, table.source(take)));
  }
}

void BM_SearchRound(benchmark::State& state) {
  const Scene scene(static_cast<int>(state.range(0)), 246);
  for (auto _ : state) search_round(scene);
  state.SetComplexityN(state.range(0));
}
BENCHMARK(BM_SearchRound)
    ->Arg(6750)
    ->Arg(13500)
    ->Arg(27000)
    ->Arg(54000)
    ->Complexity(benchmark::oN)
    ->Unit(benchmark::kMillisecond);

// The M-step of the same round: every texton fitted anew to 200 frames.
void BM_FitRound(benchmark::State& state) {
  const Scene scene(54000, 1);
  for (auto _ : state) {
    for (int i = 0; i < 246; ++i) {
      const Segment segment{200 * i, 200, 0};
      benchmark::DoNotOptimize(fit_texton(scene.observations, {&segment, 1}));
    }
  }
}
BENCHMARK(BM_FitRound)->Unit(benchmark::kMillisecond);

/// [Li02, App. A] as it is printed (its slip in b mended), prefix sums of the terms being given.
double appendix_a(const TermBlock& terms, const LogTransitions& transitions, int min_frames) {
  constexpr double kNever = -std::numeric_limits<double>::infinity();
  const auto frames = static_cast<int>(terms.step.cols());
  const auto textons = static_cast<int>(terms.step.rows());
  MatrixXd sums = MatrixXd::Zero(textons, frames);
  for (int t = 2; t < frames; ++t) sums.col(t) = sums.col(t - 1) + terms.step.col(t);
  std::vector<double> before(static_cast<std::size_t>(frames) + 1, kNever);
  std::vector<int> label(before.size(), -1);
  before[0] = 0.0;
  double best = kNever;
  for (int n = 1; n <= frames / min_frames; ++n) {
    std::vector<double> now(before.size(), kNever);
    std::vector<int> now_label(before.size(), -1);
    for (int t = n * min_frames; t <= frames; ++t) {
      const auto to = static_cast<std::size_t>(t);
      for (int b = (n - 1) * min_frames; b <= t - min_frames; ++b) {
        const auto from = static_cast<std::size_t>(b);
        if (before[from] == kNever) continue;
        for (int i = 0; i < textons; ++i) {
          const double arrival = n == 1 ? 0.0 : transitions.at(label[from], i);
          const double value =
              before[from] + arrival + terms.start(i, b) + sums(i, t - 1) - sums(i, b + 1);
          if (value > now[to]) {
            now[to] = value;
            now_label[to] = i;
          }
        }
      }
    }
    best = std::max(best, now.back());
    before = std::move(now);
    label = std::move(now_label);
  }
  return best;
}

constexpr int kFewTextons = 30;

// One take of 900 frames, 30 textons, terms given: the paper's recursion and ours.
void BM_AppendixA(benchmark::State& state) {
  const Scene scene(kTakeFrames, kFewTextons);
  TermTable table(scene.y, scene.takes, 1);
  table.set_textons(scene.textons, scene.is_new);
  TermBlock terms;
  table.source(scene.takes.front())(0, kTakeFrames, terms);
  for (auto _ : state) benchmark::DoNotOptimize(appendix_a(terms, scene.transitions, 60));
}
BENCHMARK(BM_AppendixA)->Unit(benchmark::kMillisecond);

void BM_SearchOneTake(benchmark::State& state) {
  const Scene scene(kTakeFrames, kFewTextons);
  TermTable table(scene.y, scene.takes, 1);
  table.set_textons(scene.textons, scene.is_new);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        search_segments(kTakeFrames, 60, scene.transitions, table.source(scene.takes.front())));
  }
}
BENCHMARK(BM_SearchOneTake)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace laban::texture
