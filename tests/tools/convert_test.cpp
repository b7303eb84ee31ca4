#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "laban/base/error.h"
#include "laban/io/clip_file.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/retarget.h"
#include "support/clips.h"

#include "program.h"

namespace laban::test {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kTake = LABAN_SOURCE_DIR "/data/take.bvh";
const std::string kWalk = LABAN_SOURCE_DIR "/data/phrase/phrase_walk_p01.bvh";

class Convert : public ::testing::Test {
 protected:
  Convert() : folder_(fresh_folder()) {}
  /// Runs `laban convert ARGUMENTS -o out.bvh` and reads what it wrote.
  [[nodiscard]] motion::Clip converted(const std::string& arguments,
                                       const io::ReadOptions& reading = {}) const {
    const Outcome result = run_laban("convert " + arguments + " -o out.bvh --force", folder_);
    EXPECT_EQ(result.code, 0) << result.err;
    return io::read_clip(folder_ / "out.bvh", reading).clip;
  }
  fs::path folder_;
};

double largest_distance_m(const motion::Clip& a, const motion::Clip& b) {
  return (motion::joint_positions(a) - motion::joint_positions(b)).cwiseAbs().maxCoeff();
}

TEST_F(Convert, MirroringTwiceGivesTheClipBack) {
  const motion::Clip take = io::read_clip(kTake).clip;
  const motion::Clip once = converted(kTake + " --mirror");
  EXPECT_GT(largest_distance_m(once, take), 0.1);
  fs::rename(folder_ / "out.bvh", folder_ / "once.bvh");
  EXPECT_LT(largest_distance_m(converted("once.bvh --mirror"), take), 1e-6);
}

TEST_F(Convert, PlaysTheMotionOnAnotherRigInItsOwnProportions) {
  // The same rig with legs half as long: the pose stays, the travel shrinks with the legs.
  const io::ClipFile walk = io::read_clip(kWalk);
  std::vector<motion::Joint> joints = walk.clip.skeleton().joints();
  for (motion::Joint& joint : joints) {
    joint.rest_offset *= 0.5;
    joint.name = "mixamorig:" + joint.name;
  }
  const motion::Clip small(std::make_shared<const motion::Skeleton>(joints), 30.0,
                           Eigen::Matrix3Xd::Zero(3, 1),
                           {walk.clip.rotations(0).begin(), walk.clip.rotations(0).end()});
  io::write_clip(folder_ / "small.bvh", small, {.unit_m = 0.001});
  const motion::Clip played = converted(kWalk + " --to-rig small.bvh", {.unit_m = 0.001});
  const motion::PoseMatrix expected =
      motion::to_pose_matrix(walk.clip, motion::find_humanoid(walk.clip));
  const motion::Humanoid rig = motion::find_humanoid(played);
  const motion::PoseMatrix pose = motion::to_pose_matrix(played, rig);
  EXPECT_NEAR(pose.leg_length_m / expected.leg_length_m, 0.5, 1e-4);
  EXPECT_LT((pose.angles - expected.angles).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((pose.height - expected.height).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((pose.steps - expected.steps).cwiseAbs().maxCoeff(), 1e-4);
}

TEST_F(Convert, RootMotionGoesToAJointOfItsOwnOrAway) {
  const motion::Clip take = io::read_clip(kTake).clip;
  const motion::Clip with_root = converted(kTake + " --root-motion root-joint");
  ASSERT_EQ(with_root.joint_count(), take.joint_count() + 1);
  EXPECT_EQ(with_root.skeleton().joint(0).name, "root");
  EXPECT_NEAR(with_root.root_positions().row(1).cwiseAbs().maxCoeff(), 0.0, 1e-6);
  const motion::Clip still = converted(kTake + " --root-motion in-place");
  EXPECT_GT(take.root_positions().row(2).maxCoeff(), 1.0);
  EXPECT_LT(still.root_positions().row(2).cwiseAbs().maxCoeff(), 0.3);
}

TEST_F(Convert, WritesZUpForOtherProgramsAndReadsItBack) {
  const motion::Clip take = io::read_clip(kTake).clip;
  const motion::Clip as_it_stands = converted(kTake + " --up z", {.up_axis = motion::UpAxis::kY});
  // In the file, height is along z.
  EXPECT_NEAR(as_it_stands.root_positions()(2, 0), take.root_positions()(1, 0), 1e-6);
  EXPECT_LT(largest_distance_m(io::read_clip(folder_ / "out.bvh").clip, take), 1e-6);
  const Outcome told = run_laban("convert out.bvh -o again.bvh", folder_);
  EXPECT_THAT(told.err, HasSubstr("read with +z up, as the body stands; --input-up y if it lies"));
}

TEST_F(Convert, CutsAndResamples) {
  const motion::Clip cut = converted(kTake + " --begin 30 --end 91 --rate 30");
  EXPECT_EQ(cut.frame_count(), 31);
  EXPECT_EQ(cut.frame_rate_hz(), 30.0);
  const motion::Clip take = io::read_clip(kTake).clip;
  EXPECT_LT((cut.root_positions().col(1) - take.root_positions().col(32)).norm(), 1e-6);
}

TEST_F(Convert, SaysWhatItCannotDo) {
  const auto error_of = [&](const std::string& arguments, int code) {
    const Outcome result = run_laban("convert " + arguments, folder_);
    EXPECT_EQ(result.code, code) << result.err;
    EXPECT_THAT(files_in(folder_), IsEmpty());
    return result.err;
  };
  EXPECT_THAT(error_of(kTake + " -o out.fbx", 2), HasSubstr(".bvh"));
  EXPECT_THAT(error_of(kTake + " --data pose --root-motion in-place -o out.csv", 2),
              HasSubstr("--root-motion"));
  EXPECT_THAT(error_of(kTake + " --begin 40 --end 20 -o out.bvh", 2), HasSubstr("40"));
  EXPECT_THAT(error_of(kTake + " --to-rig nowhere.bvh -o out.bvh", 3), HasSubstr("nowhere.bvh"));
}

}  // namespace
}  // namespace laban::test
