// Style transfer of 10 s at 60 Hz with the embedded model, one thread.

#include <cmath>
#include <numbers>

#include <benchmark/benchmark.h>

#include "laban/base/atomic_file.h"
#include "laban/io/clip_file.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/transfer/apply_style.h"
#include "laban/transfer/styled_clip.h"

namespace laban::transfer {
namespace {

const StyleModel& model() {
  static const StyleModel read =
      read_style_model(base::read_file(LABAN_DEFAULT_MODEL), "phrase.laban");
  return read;
}

motion::PoseMatrix ten_seconds() {
  const motion::Capture capture =
      motion::find_capture(io::read_clip(LABAN_SOURCE_DIR "/data/take.bvh").clip);
  return motion::to_pose_matrix(capture.clip, capture.humanoid).slice(0, 600);
}

EffortTarget target() {
  return {{-2.0, 1.5, 2.0}, {1.0, 1.0, 1.0, 1.0}};
}

// All of it: segmentation, search, synthesis, joins, measuring. The argument is
// ApplyOptions::rounds.
void BM_ApplyStyle(benchmark::State& state) {
  const motion::PoseMatrix input = ten_seconds();
  ApplyOptions options;
  options.rounds = static_cast<int>(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(apply_style(model(), input, target(), options));
}
BENCHMARK(BM_ApplyStyle)->Arg(0)->Arg(kRounds)->Unit(benchmark::kMillisecond);

// A new target on an already segmented clip: search, synthesis, joins, measuring. Targets go round
// a circle, as a slider's do; what is known of the fragments after the first round is remembered.
// Arguments are ApplyOptions::tries and rounds: 1 and 0 while the slider moves.
void BM_Restyle(benchmark::State& state) {
  ApplyOptions options;
  options.tries = static_cast<int>(state.range(0));
  options.rounds = static_cast<int>(state.range(1));
  constexpr int kTargets = 16;
  const SegmentedInput segmented = segment_input(model(), ten_seconds());
  PlayMemory memory(model());
  const auto ask = [&](int n) {
    const double turn = 2.0 * std::numbers::pi * n / kTargets;
    const EffortTarget asked{{2.0 * std::cos(turn), 1.5 * std::sin(turn), 2.0 * std::sin(turn)},
                             {1.0, 1.0, 1.0, 1.0}};
    return restyle(memory, segmented, {asked, {}, std::nullopt}, options);
  };
  for (int n = 0; n < kTargets; ++n) benchmark::DoNotOptimize(ask(n));
  int n = 0;
  for (auto _ : state) benchmark::DoNotOptimize(ask(n++ % kTargets));
}
BENCHMARK(BM_Restyle)
    ->Args({1, 0})
    ->Args({kTries, 0})
    ->Args({kTries, kRounds})
    ->Unit(benchmark::kMillisecond);

// Its parts, of one snippet.
void BM_PlayChoice(benchmark::State& state) {
  const BlendChoice choice = search_blend(model(), 0, target());
  for (auto _ : state) benchmark::DoNotOptimize(play_choice(model(), choice));
}
BENCHMARK(BM_PlayChoice)->Unit(benchmark::kMillisecond);

// Onto the rig of the clip, feet held.
void BM_PlayStyle(benchmark::State& state) {
  const motion::Capture capture =
      motion::find_capture(io::read_clip(LABAN_SOURCE_DIR "/data/take.bvh").clip);
  const AppliedStyle applied = apply_style(model(), ten_seconds(), target());
  for (auto _ : state) benchmark::DoNotOptimize(play_style(model(), applied, capture));
}
BENCHMARK(BM_PlayStyle)->Unit(benchmark::kMillisecond);

// Segmentation alone: BM_ApplyStyle less this is search and synthesis.
void BM_SegmentInput(benchmark::State& state) {
  const motion::PoseMatrix input = ten_seconds();
  for (auto _ : state) benchmark::DoNotOptimize(align::segment_input(input, model().database));
}
BENCHMARK(BM_SegmentInput)->Unit(benchmark::kMillisecond);

// The search for one snippet: K = 10 neighbours, 45 pairs.
void BM_SearchBlend(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(search_blend(model(), 0, target()));
}
BENCHMARK(BM_SearchBlend)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace laban::transfer
