// Textons between given ends, 15 dimensions of 67 numbers, one thread: lengths of 68 and 172 frames
// are those that the paper gives times for. `factor` makes the factor anew, `cached` has it.
#include <benchmark/benchmark.h>

#include "laban/texture/texton_synthesis.h"

namespace {

using namespace laban;
using Eigen::MatrixXd;

constexpr int kDimension = 15;
constexpr int kRows = 67;

texture::Texton some_texton() {
  base::Rng rng(1);
  texture::Texton texton;
  texton.mean = texture::draw_noise(kRows, 1, 1.0, rng);
  texton.basis =
      MatrixXd(texture::draw_noise(kRows, kRows, 1.0, rng).householderQr().householderQ())
          .leftCols(kDimension);
  texton.dynamics.a1 = 1.95 * MatrixXd::Identity(kDimension, kDimension) +
                       texture::draw_noise(kDimension, kDimension, 0.005, rng);
  texton.dynamics.a2 = -0.96 * MatrixXd::Identity(kDimension, kDimension);
  texton.dynamics.offset = texture::draw_noise(kDimension, 1, 0.01, rng);
  texton.dynamics.covariance = 1e-4 * MatrixXd::Identity(kDimension, kDimension);
  return texton;
}

std::vector<texture::PinnedFrame> some_ends(const texture::Texton& texton, int length) {
  base::Rng rng(2);
  std::vector<texture::PinnedFrame> pins;
  for (const int frame : {0, 1, length - 2, length - 1}) {
    pins.push_back({frame, texton.mean + texture::draw_noise(kRows, 1, 0.1, rng)});
  }
  return pins;
}

void constrained(benchmark::State& state, bool cached) {
  const auto length = static_cast<int>(state.range(0));
  const std::vector<texture::Texton> textons{some_texton()};
  const auto pins = some_ends(textons[0], length);
  base::Rng rng(3);
  texture::TextonSynthesizer kept(textons);
  for (auto _ : state) {
    texture::TextonSynthesizer fresh(textons);
    texture::TextonSynthesizer& synthesizer = cached ? kept : fresh;
    benchmark::DoNotOptimize(synthesizer.synthesize(
        0, length, pins, texture::draw_noise(kDimension, length - 2, 1.0, rng)));
  }
}

void factor(benchmark::State& state) {
  constrained(state, false);
}
BENCHMARK(factor)->Arg(68)->Arg(172)->Unit(benchmark::kMillisecond);

void cached(benchmark::State& state) {
  constrained(state, true);
}
BENCHMARK(cached)->Arg(68)->Arg(172)->Unit(benchmark::kMillisecond);

// The paper's way: the dense least squares of the whole texton.
void dense(benchmark::State& state) {
  const auto length = static_cast<int>(state.range(0));
  const texture::Texton texton = some_texton();
  const Eigen::Index unknown = kDimension * (length - 4);
  MatrixXd a = MatrixXd::Zero(kDimension * (length - 2), kDimension * length);
  for (Eigen::Index t = 0; t < length - 2; ++t) {
    const Eigen::Index at = kDimension * t;
    a.block(at, at, kDimension, kDimension) = -texton.dynamics.a2;
    a.block(at, at + kDimension, kDimension, kDimension) = -texton.dynamics.a1;
    a.block(at, at + 2 * kDimension, kDimension, kDimension).setIdentity();
  }
  const MatrixXd columns = a.middleCols(2 * kDimension, unknown);
  const Eigen::VectorXd right = Eigen::VectorXd::Ones(a.rows());
  for (auto _ : state) {
    benchmark::DoNotOptimize(columns.householderQr().solve(right).eval());
  }
}
BENCHMARK(dense)->Arg(68)->Unit(benchmark::kMillisecond);

}  // namespace
