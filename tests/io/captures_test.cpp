// Real captures, where LABAN_DATA names the folder that holds them.

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "laban/io/clip_file.h"
#include "laban/motion/forward_kinematics.h"
#include "support/clips.h"

namespace laban::io {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> bvh_files(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".bvh") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

struct Expected {
  std::string folder;
  bool translations = false;
  std::vector<double> rates_hz;
};

class CapturesTest : public ::testing::TestWithParam<Expected> {};

/// 31 joints is CMU's ASF skeleton in its own unit; the other rigs are in centimetres.
double expected_unit_m(const motion::Clip& clip) {
  return clip.joint_count() == 31 ? 0.05644 : 0.01;
}

void expect_round_trip(const motion::Clip& clip, double unit_m) {
  const std::string text = format_clip(clip, "bvh", {.unit_m = unit_m}).bytes;
  const motion::Clip again = parse_clip(text, "again.bvh", {.unit_m = unit_m}).clip;
  ASSERT_EQ(again.frame_count(), clip.frame_count());
  ASSERT_EQ(again.joint_count(), clip.joint_count());
  EXPECT_EQ(again.frame_rate_hz(), clip.frame_rate_hz());
  const Eigen::Matrix3Xd before = motion::joint_positions(clip);
  const Eigen::Matrix3Xd after = motion::joint_positions(again);
  EXPECT_LT((after - before).colwise().norm().maxCoeff(), 1e-6);
  for (int f = 0; f < clip.frame_count(); ++f) {
    for (int j = 0; j < clip.joint_count(); ++j) {
      ASSERT_THAT(again.rotation(f, j), test::IsNearRotation(clip.rotation(f, j), 1e-5));
    }
  }
}

TEST_P(CapturesTest, AreReadInTheirUnitAndKeptByARoundTrip) {
  const char* const data = std::getenv("LABAN_DATA");
  if (data == nullptr) GTEST_SKIP() << "LABAN_DATA is not set: no captures to read";
  const std::vector<fs::path> files = bvh_files(fs::path(data) / GetParam().folder);
  ASSERT_FALSE(files.empty());
  for (const fs::path& path : files) {
    SCOPED_TRACE(path.filename().string());
    const ClipFile file = read_clip(path);
    EXPECT_TRUE(file.warnings.empty());
    EXPECT_EQ(file.unit_m, expected_unit_m(file.clip));
    EXPECT_EQ(file.clip.has_translations(), GetParam().translations);
    EXPECT_THAT(GetParam().rates_hz, ::testing::Contains(file.clip.frame_rate_hz()));
    expect_round_trip(file.clip.slice(0, std::min(300, file.clip.frame_count())), file.unit_m);
  }
}

INSTANTIATE_TEST_SUITE_P(Folders, CapturesTest,
                         ::testing::Values(Expected{"bandai1", true, {30.0}},
                                           Expected{"cmu_dance", false, {120.0}},
                                           Expected{"cmu_clips", false, {30.0, 60.0, 120.0}}),
                         [](const auto& folder) { return folder.param.folder; });

}  // namespace
}  // namespace laban::io
