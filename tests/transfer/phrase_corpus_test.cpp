// What must hold on whole corpora: the embedded one, and Bandai's captures if LABAN_DATA is set.

#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include "laban/io/clip_file.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/retarget.h"
#include "laban/transfer/style_corpus.h"

namespace laban::transfer {
namespace {

namespace fs = std::filesystem;

/// Clips of a folder whose names are {prefix}{content}_..: `skip` characters come before the
/// content.
std::vector<Fragment> read_fragments(const fs::path& folder, std::size_t skip) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".bvh") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<Fragment> fragments;
  for (const fs::path& path : paths) {
    const std::string stem = path.stem().string();
    const motion::Capture capture = motion::find_capture(io::read_clip(path).clip);
    fragments.push_back({stem, stem.substr(skip, stem.find('_', skip) - skip), "",
                         motion::to_pose_matrix(capture.clip, capture.humanoid), std::nullopt});
  }
  return fragments;
}

void expect_same(const motion::PoseMatrix& blend, const motion::PoseMatrix& parent) {
  ASSERT_EQ(blend.frame_count(), parent.frame_count());
  EXPECT_LT((blend.angles - parent.angles).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((blend.height - parent.height).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((motion::planar_path(blend) - motion::planar_path(parent)).cwiseAbs().maxCoeff(), 1e-9);
}

/// Ends of a pair are its parents; time runs strictly forward between and beyond them.
void check_pair(const motion::PoseMatrix& i, const motion::PoseMatrix& j) {
  const blend::BlendPair pair = align_pair(i, j);
  expect_same(blend::blend(pair, 0.0).pose, i);
  expect_same(blend::blend(pair, 1.0).pose, j);
  for (int n = 0; n <= 30; ++n) {
    const auto points = pair.warp().sample(-0.25 + 0.05 * n);
    for (std::size_t k = 1; k < points.size(); ++k) {
      ASSERT_GT(points[k].p, points[k - 1].p);
      ASSERT_GT(points[k].q, points[k - 1].q);
    }
  }
}

/// Checks all pairs of one content; returns how many were blendable.
int check_all_pairs(const std::vector<Fragment>& fragments) {
  int checked = 0;
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    for (std::size_t j = i + 1; j < fragments.size(); ++j) {
      if (fragments[i].content != fragments[j].content) continue;
      if (!align::blendable(fragments[i].pose.frame_count(), fragments[j].pose.frame_count()))
        continue;
      SCOPED_TRACE(fragments[i].name + " + " + fragments[j].name);
      check_pair(fragments[i].pose, fragments[j].pose);
      if (::testing::Test::HasFatalFailure()) return checked;
      ++checked;
    }
  }
  return checked;
}

TEST(PhraseCorpus, EveryPairBlendsExactlyAtItsEndsAndForwardInTime) {
  const auto fragments = read_fragments(LABAN_SOURCE_DIR "/data/phrase", 7);
  ASSERT_EQ(fragments.size(), 60U);
  EXPECT_EQ(check_all_pairs(fragments), 5 * 12 * 11 / 2);
}

TEST(BandaiCorpus, EveryPairBlendsExactlyAtItsEndsAndForwardInTime) {
  const char* data = std::getenv("LABAN_DATA");
  if (data == nullptr)
    GTEST_SKIP() << "LABAN_DATA is not set: pairs of real captures are not checked";
  EXPECT_GT(check_all_pairs(read_fragments(fs::path(data) / "bandai1", 10)), 800);
}

}  // namespace
}  // namespace laban::transfer
