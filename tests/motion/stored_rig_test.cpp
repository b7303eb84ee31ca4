#include "laban/motion/stored_rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::motion {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

StoredRig some_rig() {
  const Capture capture =
      find_capture(to_standard_clip(test::random_pose_matrix({.frames = 2, .amplitude_rad = 0.3})));
  return {capture.clip.slice(0, 1), capture.humanoid, FootFloor{0.02, 0.01}};
}

/// What reading a rig says that was broken between writing and reading.
template <typename Break>
std::string refusal(const Break& spoil) {
  base::Container container{"laban.test", 1, "{}", {}};
  StoredRigHeader header = save_rig(some_rig(), container);
  spoil(container, header);
  const PartReader reader(container, "x.test", "make it again");
  try {
    (void)load_rig(reader, header, 60.0);
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kFormat);
    return error.what();
  }
  return "";
}

TEST(StoredRig, ComesBackAsItWas) {
  const StoredRig rig = some_rig();
  base::Container container{"laban.test", 1, "{}", {}};
  const StoredRigHeader header = save_rig(rig, container);
  const StoredRig back = load_rig(PartReader(container, "x", "mend"), header, 60.0);
  base::Container again{"laban.test", 1, "{}", {}};
  EXPECT_EQ(save_rig(back, again).joints, header.joints);
  ASSERT_EQ(again.arrays.size(), container.arrays.size());
  for (const auto& [name, array] : container.arrays) {
    EXPECT_EQ(again.arrays.at(name).values, array.values) << name;
  }
  ASSERT_TRUE(back.floor.has_value());
  EXPECT_EQ(back.floor->toe_m, 0.01);
}

TEST(StoredRig, EveryRuleIsToldWithTheFileAndTheMend) {
  const auto told = [](const std::string& text, const std::string& part) {
    EXPECT_THAT(text, StartsWith("x.test: "));
    EXPECT_THAT(text, HasSubstr(part));
    EXPECT_THAT(text, ::testing::EndsWith("; make it again"));
  };
  told(refusal([](auto& container, auto&) { container.arrays["rig.stance"].values[0] += 0.1; }),
       "length 1");
  told(refusal([](auto& container, auto&) { container.arrays["rig.mapped"].values[0] = 1e4; }),
       "does not have");
  told(refusal([](auto& container, auto&) { container.arrays["rig.parents"].values[1] = 0.5; }),
       "out of range");
  told(refusal([](auto& container, auto&) { container.arrays["rig.offsets"].values[4] = 1e10; }),
       "beyond all measure");
  told(refusal([](auto&, auto& header) { header.joints.pop_back(); }), "does not fit");
  told(refusal([](auto&, auto& header) { header.leg_length_m = 0.0; }), "leg length");
  told(refusal([](auto&, auto& header) { header.floor_m = {1e30, 0.0}; }), "floor");
}

}  // namespace
}  // namespace laban::motion
