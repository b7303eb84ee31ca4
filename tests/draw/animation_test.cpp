#include "laban/draw/animation.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "laban/base/error.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/resample.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::draw {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

motion::Clip person(int frames, unsigned seed = 1) {
  return motion::to_standard_clip(
      test::random_pose_matrix({.frames = frames, .seed = seed, .amplitude_rad = 0.3}));
}

/// What stands in the page's data element.
std::string data_text(const std::string& page) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const std::size_t from = page.find(begin) + begin.size();
  return page.substr(from, page.find("</script>", from) - from);
}

json data_of(const std::string& page) {
  return json::parse(data_text(page));
}

std::vector<unsigned> decoded(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned> bytes;
  unsigned group = 0, bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    group = group << 6U | static_cast<unsigned>(digits.find(c));
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes.push_back(group >> bits & 255U);
  }
  return bytes;
}

/// Position of a node at a frame, as the page's script decodes it.
Eigen::Vector3d position_in(const json& clip, const std::vector<unsigned>& bytes, int frame,
                            int node) {
  Eigen::Vector3d p;
  const auto at = static_cast<std::size_t>(frame * clip["nodes"].get<int>() + node) * 6;
  for (std::size_t k = 0; k < 3; ++k) {
    const unsigned level = bytes[at + 2 * k] | bytes[at + 2 * k + 1] << 8U;
    p[static_cast<Eigen::Index>(k)] =
        clip["low"][k].get<double>() + clip["step"][k].get<double>() * level;
  }
  return p;
}

template <typename Call>
std::string message_of(base::ErrorKind kind, const Call& call) {
  try {
    (void)call();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), kind);
    return error.what();
  }
  return "no error";
}

TEST(Animation, DataDecodeToForwardKinematics) {
  const motion::Clip clip = person(47);
  const AnimatedClip clips[] = {{clip, "walk", "a note", {}, {0.25}}};
  const json one = data_of(animation(clips))["clips"][0];
  EXPECT_EQ(one["title"], "walk");
  EXPECT_EQ(one["note"], "a note");
  EXPECT_EQ(one["frames"], 47);
  EXPECT_EQ(one["rate"], clip.frame_rate_hz());
  EXPECT_EQ(one["marks"], json({0.25}));
  EXPECT_FALSE(one.contains("contacts"));
  const auto bytes = decoded(one["positions"]);
  ASSERT_EQ(bytes.size(), 47U * one["nodes"].get<std::size_t>() * 6U);
  for (int f = 0; f < clip.frame_count(); ++f) {
    const auto pose = motion::forward_kinematics(clip, f);
    for (int j = 0; j < clip.joint_count(); ++j) {
      // Half a step of 1/65535 of the extent, which is below 4 m here.
      EXPECT_LT((position_in(one, bytes, f, j) - pose.positions.col(j)).cwiseAbs().maxCoeff(), 4e-5)
          << f << " " << j;
    }
  }
  for (const json& limb : one["limbs"]) {
    for (const json& bone : limb["bones"]) {
      EXPECT_LT(bone[0].get<int>(), one["nodes"].get<int>());
      EXPECT_GT(bone[2].get<double>(), 0.0);
    }
  }
}

TEST(Animation, MarksFeetWhereTheyTouchTheGround) {
  const motion::Clip clip = person(60);
  const motion::Humanoid humanoid = motion::find_humanoid(clip);
  const AnimatedClip clips[] = {{clip, "", "", humanoid, {}}};
  const json one = data_of(animation(clips))["clips"][0];
  const auto touching = decoded(one["contacts"]);
  const auto found = motion::find_foot_contacts(clip, humanoid).contacts;
  const auto paths = motion::foot_paths(clip, humanoid);
  const auto bytes = decoded(one["positions"]);
  ASSERT_EQ(touching.size(), 60U);
  for (int f = 0; f < 60; ++f) {
    for (int p = 0; p < motion::kFootPointCount; ++p) {
      EXPECT_EQ((touching[static_cast<std::size_t>(f)] >> static_cast<unsigned>(p) & 1U) == 1U,
                found.touches(static_cast<motion::FootPoint>(p), f));
      const int node = one["points"][static_cast<std::size_t>(p)];
      EXPECT_LT(
          (position_in(one, bytes, f, node) - paths.points[static_cast<std::size_t>(p)].col(f))
              .norm(),
          1e-4);
    }
  }
}

TEST(Animation, HostileTextsStayTexts) {
  const std::string hostile =
      "</script><script>alert(1)</script><!-- {{data}} \"\\ \x01 \xff &amp;";
  const AnimatedClip clips[] = {{person(3), hostile, hostile, {}, {}}};
  const std::string page = animation(clips);
  EXPECT_THAT(page, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(page, HasSubstr("<title>&lt;/script&gt;&lt;script&gt;alert(1)"));
  EXPECT_EQ(data_text(page).find('<'), std::string::npos);
  const std::string title = data_of(page)["clips"][0]["title"];
  EXPECT_THAT(title, StartsWith("</script><script>alert(1)</script><!-- {{data}} \"\\ "));
  // Nothing is asked of a network.
  for (const char* part : {"http:", "https:", "src=", "url(", "import"}) {
    EXPECT_THAT(page, Not(HasSubstr(part))) << part;
  }
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
}

TEST(Animation, AMinuteStaysBelowTwoMegabytesWhateverItsRate) {
  const motion::Clip clip = person(7201);  // 60 Hz: told to be 120
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < clip.frame_count(); ++f) {
    rotations.insert(rotations.end(), clip.rotations(f).begin(), clip.rotations(f).end());
  }
  const AnimatedClip clips[] = {
      {motion::Clip(clip.shared_skeleton(), 120.0, clip.root_positions(), std::move(rotations)),
       "",
       "",
       {},
       {}}};
  const std::string page = animation(clips);
  EXPECT_LT(page.size(), 2'000'000U);
  EXPECT_EQ(data_of(page)["clips"][0]["rate"], 60.0);
  EXPECT_EQ(data_of(page)["clips"][0]["frames"], 3601);
}

TEST(Animation, PairsMomentsOfTwoClips) {
  const AnimatedClip clips[] = {{person(31), "in", "", {}, {}}, {person(3), "out", "", {}, {}}};
  const json data = data_of(animation(clips, {.source_frames = {0.0, 15.0, 30.0}}));
  EXPECT_EQ(data["moments"], json({0.0, 0.25, 0.5}));  // seconds of the first, at 60 Hz
  EXPECT_FALSE(data_of(animation(clips)).contains("moments"));
  EXPECT_THAT(message_of(base::ErrorKind::kData,
                         [&] {
                           return animation(clips, {.source_frames = {0.0, 1.0}});
                         }),
              HasSubstr("source_frames must be one a frame of the last clip"));
}

TEST(Animation, DrawsALoneJointAndRefusesNoClipOrTooMany) {
  const auto skeleton =
      std::make_shared<const motion::Skeleton>(std::vector<motion::Joint>{{.name = "dot"}});
  const motion::Clip dot(skeleton, 30.0, Eigen::Matrix3Xd::Zero(3, 1),
                         {Eigen::Quaterniond::Identity()});
  const std::vector<AnimatedClip> clips(5, AnimatedClip{dot, "", "", {}, {}});
  const json one = data_of(animation(std::span(clips).first(4)))["clips"][3];
  EXPECT_EQ(one["limbs"][0]["bones"].size(), 1U);
  EXPECT_THAT(message_of(base::ErrorKind::kUsage, [&] { return animation(clips); }),
              HasSubstr("5 clips (must be 1 .. 4)"));
  EXPECT_THAT(message_of(base::ErrorKind::kUsage, [&] { return animation({}); }),
              HasSubstr("0 clips"));
  EXPECT_THAT(
      message_of(base::ErrorKind::kUsage,
                 [&] { return animation(std::span(clips).first(1), {.max_frame_rate_hz = 0.0}); }),
      HasSubstr("max_frame_rate_hz = 0 (must be > 0)"));
}

}  // namespace
}  // namespace laban::draw
