// The 5 nearest of N fragments, windows of 1 to 3 s of the dances in $LABAN_DATA/cmu_dance at 60
// Hz: joint angles, 63 dimensions. Queries come from takes that no fragment comes from.
//
// BM_Nearest's `pruned` is the share of cells never computed, `mismatches` the neighbours that the
// full search names otherwise; its time beside BM_NearestByFullMatrix's is the figure to compare.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>

#include <benchmark/benchmark.h>

#include "laban/align/content_metric.h"
#include "laban/align/nearest_fragments.h"
#include "laban/base/rng.h"
#include "laban/io/clip_file.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/pose_matrix.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"

namespace laban::align {
namespace {

constexpr double kRateHz = 60.0;
constexpr int kQueryCount = 10;
constexpr int kNeighborCount = 5;

std::filesystem::path dances() {
  const char* data = std::getenv("LABAN_DATA");
  return data == nullptr ? "" : std::filesystem::path(data) / "cmu_dance";
}

/// Joint angles of every take of at least 3 s, on common branches.
std::vector<Eigen::MatrixXd> read_takes() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(dances())) {
    if (io::is_motion_file(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Eigen::MatrixXd> takes;
  for (const auto& file : files) {
    motion::Capture capture = motion::find_capture(io::read_clip(file).clip);
    capture.clip = motion::resample(capture.clip, kRateHz);
    Eigen::MatrixXd angles = motion::to_pose_matrix(capture.clip, capture.humanoid).angles;
    if (angles.cols() < 180) continue;
    if (takes.empty()) {
      takes.push_back(std::move(angles));
    } else {
      takes.push_back(on_branch_of(angles, takes[0].col(0)));
    }
  }
  return takes;
}

Eigen::MatrixXd random_window(const Eigen::MatrixXd& take, base::Rng& rng) {
  const int frames = 60 + rng.index(121);
  return take.middleCols(rng.index(static_cast<int>(take.cols()) - frames + 1), frames);
}

/// Every fifth take is for queries alone.
struct Windows {
  std::vector<Eigen::MatrixXd> fragments;
  std::vector<Eigen::MatrixXd> queries;
};

Windows read_windows(int count) {
  static const std::vector<Eigen::MatrixXd> takes = read_takes();
  base::Rng rng(1);
  std::vector<const Eigen::MatrixXd*> for_queries;
  std::vector<const Eigen::MatrixXd*> for_fragments;
  for (std::size_t n = 0; n < takes.size(); ++n) {
    (n % 5 == 4 ? for_queries : for_fragments).push_back(&takes[n]);
  }
  const auto any_of = [&](const std::vector<const Eigen::MatrixXd*>& some) {
    return random_window(*some[static_cast<std::size_t>(rng.index(static_cast<int>(some.size())))],
                         rng);
  };
  Windows windows;
  for (int n = 0; n < kQueryCount; ++n) windows.queries.push_back(any_of(for_queries));
  for (int n = 0; n < count; ++n) windows.fragments.push_back(any_of(for_fragments));
  return windows;
}

void search(benchmark::State& state, bool prune) {
  if (!std::filesystem::exists(dances())) {
    state.SkipWithError("needs $LABAN_DATA/cmu_dance");
    return;
  }
  const Windows windows = read_windows(static_cast<int>(state.range(0)));
  const FragmentIndex index(windows.fragments);
  for (auto _ : state) {
    for (const Eigen::MatrixXd& query : windows.queries) {
      benchmark::DoNotOptimize(
          index.nearest(query, kNeighborCount, {}, {.prune = prune}).pruned_share);
    }
  }
  state.SetItemsProcessed(state.iterations() * kQueryCount);
  if (!prune) return;
  double pruned = 0.0;
  int mismatches = 0;
  for (const Eigen::MatrixXd& query : windows.queries) {
    const NearestFragments found = index.nearest(query, kNeighborCount);
    const NearestFragments full = index.nearest(query, kNeighborCount, {}, {.prune = false});
    pruned += found.pruned_share / kQueryCount;
    for (std::size_t n = 0; n < kNeighborCount; ++n) {
      mismatches += found.neighbors[n].fragment != full.neighbors[n].fragment ? 1 : 0;
    }
  }
  state.counters["pruned"] = pruned;
  state.counters["mismatches"] = mismatches;
}

void BM_NearestByFullMatrix(benchmark::State& state) {
  search(state, false);
}
BENCHMARK(BM_NearestByFullMatrix)->Arg(300)->Arg(10000)->Unit(benchmark::kMillisecond);

void BM_Nearest(benchmark::State& state) {
  search(state, true);
}
BENCHMARK(BM_Nearest)->Arg(300)->Arg(10000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace laban::align
