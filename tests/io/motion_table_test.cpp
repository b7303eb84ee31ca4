#include "laban/io/motion_table.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <set>

#include "laban/base/csv.h"
#include "laban/motion/forward_kinematics.h"
#include "support/clips.h"

namespace laban::io {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

MotionTable small_table() {
  MotionTable table{"test", 50.0, {"a_m", "b's \"x\"_rad"}, {}};
  table.values.resize(2, 3);
  table.values << 0.1, 1.0 / 3.0, -2.5, 1e-300, 4.0, 0.0;
  return table;
}

TEST(MotionTable, CsvNamesRateAndUnitsAndKeepsEveryBit) {
  const std::string text = format_csv(small_table());
  EXPECT_THAT(text, StartsWith("# laban: test, frame_rate_hz=50\n"));
  const auto rows = base::parse_csv(text.substr(text.find('\n') + 1), "x.csv");
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_THAT(rows[0].fields, ElementsAre("time_s", "a_m", "b's \"x\"_rad"));
  EXPECT_EQ(rows[2].fields[0], "0.02");
  EXPECT_EQ(std::stod(rows[2].fields[1]), 1.0 / 3.0);
  EXPECT_EQ(std::stod(rows[1].fields[2]), 1e-300);
}

TEST(MotionTable, NpyIsLaidOutAsItsFormatSays) {
  // https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html; tests/tools reads such
  // a file with numpy itself.
  const std::string bytes = format_npy(small_table());
  ASSERT_THAT(bytes, StartsWith(std::string("\x93NUMPY\x02\x00", 8)));
  std::uint32_t header_size = 0;
  std::memcpy(&header_size, bytes.data() + 8, sizeof header_size);
  EXPECT_EQ((12 + header_size) % 64, 0U);
  const std::string header = bytes.substr(12, header_size);
  EXPECT_EQ(header.back(), '\n');
  EXPECT_THAT(header, HasSubstr("(('frame_rate_hz=50', 'time_s'), '<f8')"));
  EXPECT_THAT(header, HasSubstr(R"(("b's \"x\"_rad", '<f8'))"));
  EXPECT_THAT(header, HasSubstr("'shape': (3,)"));
  ASSERT_EQ(bytes.size(), 12 + header_size + 3 * 3 * sizeof(double));
  std::array<double, 9> values{};
  std::memcpy(values.data(), bytes.data() + 12 + header_size, sizeof values);
  EXPECT_THAT(values, ElementsAre(0.0, 0.1, 1e-300, 0.02, 1.0 / 3.0, 4.0, 0.04, -2.5, 0.0));
}

TEST(MotionTable, PositionsAreThoseOfForwardKinematics) {
  const motion::Clip clip = test::random_clip();
  const MotionTable table = joint_position_table(clip);
  ASSERT_EQ(table.columns.size(), 15U);
  EXPECT_EQ(table.columns[4], clip.skeleton().joint(1).name + "_y_m");
  const Eigen::Matrix3Xd positions = motion::forward_kinematics(clip, 7).positions;
  EXPECT_EQ(table.values(4, 7), positions(1, 1));
  EXPECT_EQ(table.values(12, 7), positions(0, 4));
}

TEST(MotionTable, JointsOfOneNameHaveColumnsOfTheirOwn) {
  std::vector<motion::Joint> joints = {{"a", -1, {}, {}}, {"a", 0, {}, {}}, {"a_1", 1, {}, {}}};
  for (motion::Joint& joint : joints) joint.rest_offset.setZero();
  const motion::Clip clip(std::make_shared<const motion::Skeleton>(joints), 30.0,
                          Eigen::Matrix3Xd::Zero(3, 1),
                          std::vector<Eigen::Quaterniond>(3, Eigen::Quaterniond::Identity()));
  const std::vector<std::string> columns = joint_position_table(clip).columns;
  EXPECT_EQ(std::set<std::string>(columns.begin(), columns.end()).size(), 9U);
}

TEST(MotionTable, APoseTableIsThePoseMatrix) {
  const motion::PoseMatrix pose = test::random_pose_matrix();
  const MotionTable table = pose_table(pose);
  ASSERT_EQ(table.columns.size(), static_cast<std::size_t>(table.values.rows()));
  EXPECT_EQ(table.columns[0], "hips_x_rad");
  EXPECT_EQ(table.columns[63], "height_leg");
  EXPECT_EQ(table.values.col(9).head<63>(), pose.angles.col(9));
  EXPECT_EQ(table.values(63, 9), pose.height[9]);
  EXPECT_EQ(table.values.col(9).tail<3>(), pose.steps.col(9));
}

}  // namespace
}  // namespace laban::io
