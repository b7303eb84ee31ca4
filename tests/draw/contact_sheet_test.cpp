#include "laban/draw/contact_sheet.h"

#include <cmath>

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

#include "picture.h"

namespace laban::draw {
namespace {

motion::Clip person(int frames, unsigned seed = 1) {
  return motion::to_standard_clip(
      test::random_pose_matrix({.frames = frames, .seed = seed, .amplitude_rad = 0.3}));
}

// The same motion, every joint renamed.
template <typename Rename>
motion::Clip renamed(const motion::Clip& clip, const Rename& rename) {
  std::vector<motion::Joint> joints = clip.skeleton().joints();
  for (motion::Joint& joint : joints) joint.name = rename(joint.name);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < clip.frame_count(); ++f) {
    rotations.insert(rotations.end(), clip.rotations(f).begin(), clip.rotations(f).end());
  }
  return {std::make_shared<const motion::Skeleton>(std::move(joints)), clip.frame_rate_hz(),
          clip.root_positions(), std::move(rotations)};
}

// The same motion, turned about +Y and moved.
motion::Clip moved(const motion::Clip& clip, double yaw, const Eigen::Vector3d& by) {
  const Eigen::Quaterniond turn = math::yaw_rotation(yaw);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < clip.frame_count(); ++f) {
    for (int j = 0; j < clip.joint_count(); ++j) {
      rotations.push_back(j == 0 ? turn * clip.rotation(f, j) : clip.rotation(f, j));
    }
  }
  Eigen::Matrix3Xd root = turn.toRotationMatrix() * clip.root_positions();
  root.colwise() += by;
  return {clip.shared_skeleton(), clip.frame_rate_hz(), std::move(root), std::move(rotations)};
}

// The same motion below a root that stays at the origin, as in captures whose hips travel.
motion::Clip carried(const motion::Clip& clip, const std::string& root_name) {
  std::vector<motion::Joint> joints = {{.name = root_name}};
  for (motion::Joint joint : clip.skeleton().joints()) {
    ++joint.parent;
    joints.push_back(std::move(joint));
  }
  const Eigen::Index count = clip.joint_count() + 1;
  std::vector<Eigen::Quaterniond> rotations;
  Eigen::Matrix3Xd translations = Eigen::Matrix3Xd::Zero(3, clip.frame_count() * count);
  for (int f = 0; f < clip.frame_count(); ++f) {
    rotations.push_back(Eigen::Quaterniond::Identity());
    for (int j = 0; j < clip.joint_count(); ++j) {
      rotations.push_back(clip.rotation(f, j));
      translations.col(f * count + j + 1) = clip.translation(f, j);
    }
  }
  return {std::make_shared<const motion::Skeleton>(std::move(joints)), clip.frame_rate_hz(),
          Eigen::Matrix3Xd::Zero(3, clip.frame_count()), std::move(rotations),
          std::move(translations)};
}

std::string svg(std::vector<Strip> strips, ContactSheetOptions options = {}) {
  options.format = Format::kSvg;
  return contact_sheet(strips, options);
}

template <typename Call>
void expect_error(base::ErrorKind kind, const std::string& part, const Call& call) {
  try {
    (void)call();
    ADD_FAILURE() << "no error that says " << part;
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), kind);
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(ContactSheet, DrawsAsManyFiguresAsAsked) {
  for (const int count : {1, 2, 7, 12, 40}) {
    for (const Placement placement : {Placement::kSpread, Placement::kPanorama}) {
      SCOPED_TRACE(count);
      const std::string bytes =
          svg({{.clip = person(90)}}, {.pose_count = count, .placement = placement});
      EXPECT_EQ(xml_fault(bytes), "");
      EXPECT_EQ(count_of(bytes, "<g class=\"figure\">"), count);
    }
  }
}

TEST(ContactSheet, DrawsNoMorePosesThanFrames) {
  EXPECT_EQ(count_of(svg({{.clip = person(3)}}), "<g class=\"figure\">"), 3);
  EXPECT_EQ(count_of(svg({{.clip = person(1)}}), "<g class=\"figure\">"), 1);
}

TEST(ContactSheet, TimesAreEqualStepsOverTheLongestClip) {
  const std::vector<Strip> strips = {{.clip = person(61)}, {.clip = person(121)}};  // 60 Hz: 1, 2 s
  const auto times = contact_sheet_times(strips, 5);
  ASSERT_EQ(times.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(times[i], 0.5 * static_cast<double>(i), 1e-12);
}

TEST(ContactSheet, AShorterClipLeavesItsLastCellsEmpty) {
  // Times 0, 0.5 .. 2 s: the clip of 1 s has the first three.
  const std::string bytes =
      svg({{.clip = person(61)}, {.clip = person(121)}}, {.pose_count = 5, .trajectories = false});
  EXPECT_EQ(count_of(bytes, "<g class=\"figure\">"), 3 + 5);
  EXPECT_EQ(count_of(bytes, ">1.50 s<"), 1);
  EXPECT_EQ(count_of(bytes, ">1.00 s<"), 2);
}

TEST(ContactSheet, HoldsItsTextsAsText) {
  const std::string bytes = svg({{.clip = person(61), .title = "input <a & b>", .note = "60 Hz"}},
                                {.title = "Walk, \"sudden\"", .pose_count = 3});
  EXPECT_EQ(xml_fault(bytes), "");
  for (const std::string_view text :
       {">input &lt;a &amp; b&gt;<", ">60 Hz<", ">Walk, &quot;sudden&quot;<", ">0.00 s<",
        ">0.50 s<", ">1.00 s<", ">left<", ">right<"}) {
    EXPECT_EQ(count_of(bytes, text), 1) << text;
  }
}

TEST(ContactSheet, SurvivesTextsThatAreNotUtf8) {
  const std::vector<Strip> strips = {{.clip = person(5), .title = "caf\xe9 \x01 \xf0\x9f"}};
  EXPECT_EQ(xml_fault(svg(strips)), "");
  EXPECT_EQ(count_of(svg(strips),
                     ">caf?   ?"
                     "?<"),
            1);
  EXPECT_NO_THROW((void)contact_sheet(strips));
}

TEST(ContactSheet, PngHasTheWidthAskedTimesThePixelRatio) {
  const std::vector<Strip> strips = {{.clip = person(61), .title = "a"}};
  const std::string bytes = contact_sheet(strips, {.width = 640.0, .pixel_ratio = 1.5});
  expect_png(bytes, 960, big_endian(bytes, 20));
  EXPECT_GT(big_endian(bytes, 20), 100U);
}

TEST(ContactSheet, SameInputSameBytes) {
  for (const Format format : {Format::kPng, Format::kSvg}) {
    const std::vector<Strip> strips = {{.clip = person(61), .title = "a", .marks_s = {0.4}}};
    EXPECT_EQ(contact_sheet(strips, {.format = format}), contact_sheet(strips, {.format = format}));
  }
}

// The camera follows the character, so where it stands and faces in the capture volume is nothing.
TEST(ContactSheet, DoesNotDependOnWhereTheCaptureFacedAndStood) {
  const motion::Clip clip = person(61);
  const auto texts = [](const motion::Clip& any) {
    return svg({{.clip = any}}, {.pose_count = 4});
  };
  const std::string there = texts(moved(clip, 2.1, {3.0, 0.4, -7.0}));
  const std::string here = texts(clip);
  // Rounding may move a coordinate by a hundredth: compare the drawing's structure and size.
  EXPECT_EQ(count_of(here, "<path"), count_of(there, "<path"));
  EXPECT_EQ(here.substr(0, here.find("font-family")), there.substr(0, there.find("font-family")));
  const auto first_head = [](const std::string& bytes) {
    const auto at = bytes.find("cx=\"", bytes.find("class=\"figure\""));
    return std::stod(bytes.substr(at + 4, 8));
  };
  EXPECT_NEAR(first_head(here), first_head(there), 0.02);
}

TEST(ContactSheet, TellsSidesByAnyRigsNames) {
  const motion::Clip clip = person(31);
  const auto blues = [](const motion::Clip& any) {
    return count_of(svg({{.clip = any}}, {.trajectories = false}), "#0072b2");
  };
  const int expected = blues(clip);
  EXPECT_GT(expected, 80);  // 12 figures, two limbs of several bones
  const auto restyled = [](const std::string& left, const std::string& right, bool after) {
    return [=](const std::string& name) {
      for (const bool is_left : {true, false}) {
        const std::string side = is_left ? "left_" : "right_";
        if (!name.starts_with(side)) continue;
        const std::string rest = name.substr(side.size());
        const std::string& mark = is_left ? left : right;
        return after ? rest + mark : mark + rest;
      }
      return name;
    };
  };
  EXPECT_EQ(blues(renamed(clip, restyled("Left", "Right", false))), expected);
  EXPECT_EQ(blues(renamed(clip, restyled("mixamorig:Left", "mixamorig:Right", false))), expected);
  EXPECT_EQ(blues(renamed(clip, restyled(".L", ".R", true))), expected);
  EXPECT_EQ(blues(renamed(clip, restyled("l", "r", false))), expected);  // lthigh beside rthigh
  EXPECT_EQ(blues(renamed(clip, [](const std::string&) { return std::string("j"); })), expected)
      << "nameless joints are told by x at rest";
}

TEST(ContactSheet, NamesWinOverTheRestPose) {
  const motion::Clip clip = person(31);
  for (const auto& [left, right] : std::vector<std::pair<std::string, std::string>>{
           {"Left", "Right"}, {"l", "r"}, {"L", "R"}, {"lf_", "rf_"}}) {
    const auto named = [&](const std::string& for_left, const std::string& for_right) {
      return svg({{.clip = renamed(clip, [&](const std::string& name) {
                     if (name.starts_with("left_")) return for_left + name.substr(5);
                     return name.starts_with("right_") ? for_right + name.substr(6) : name;
                   })}});
    };
    EXPECT_NE(named(left, right), named(right, left)) << left;
  }
}

TEST(ContactSheet, LeavesOutARootThatOnlyCarriesTheBody) {
  const motion::Clip clip = person(31);
  EXPECT_EQ(svg({{.clip = carried(clip, "joint_Root")}}), svg({{.clip = clip}}));
  EXPECT_EQ(svg({{.clip = carried(clip, "top")}}), svg({{.clip = clip}}));
}

TEST(ContactSheet, DrawsAHeadForEachPoseIfAJointIsNamedSo) {
  const motion::Clip clip = person(31);
  const auto circles = [](const motion::Clip& any) {
    return count_of(svg({{.clip = any}}, {.pose_count = 6, .trajectories = false}), "<circle");
  };
  const auto plain = [](const std::string& name) { return name == "head" ? "top" : name; };
  // The head and its white rim; bones seen end on are circles too, in both.
  EXPECT_EQ(circles(clip) - circles(renamed(clip, plain)), 2 * 6);
}

TEST(ContactSheet, MarksOnlyTimesInsideTheClip) {
  const std::string bytes = svg({{.clip = person(61), .marks_s = {0.25, 0.75, 7.0, -1.0, NAN}}});
  EXPECT_EQ(count_of(bytes, "stroke-dasharray"), 2);
}

TEST(ContactSheet, DrawsDegenerateClips) {
  motion::PoseMatrix still = test::random_pose_matrix({.frames = 20, .amplitude_rad = 0.0});
  still.steps.setZero();
  const std::vector<motion::Clip> clips = {person(1),
                                           person(2),
                                           test::random_clip({.joints = 1, .frames = 1}),
                                           test::random_clip({.joints = 1, .frames = 50}),
                                           test::random_clip({.joints = 2}),
                                           test::random_clip({.joints = 60}),
                                           motion::to_standard_clip(still),
                                           moved(person(30), 0.3, {9e5, -9e5, 9e5})};
  for (std::size_t i = 0; i < clips.size(); ++i) {
    for (const View view : {View::kThreeQuarter, View::kFront, View::kSide}) {
      for (const Placement placement : {Placement::kSpread, Placement::kPanorama}) {
        SCOPED_TRACE(i);
        const ContactSheetOptions options{.view = view, .placement = placement};
        EXPECT_EQ(xml_fault(svg({{.clip = clips[i]}}, options)), "");
      }
    }
    const std::vector<Strip> strips = {{.clip = clips[i]}};
    EXPECT_NO_THROW((void)contact_sheet(strips, {.pixel_ratio = 0.5}));
  }
}

TEST(ContactSheet, RefusesWhatItCannotDraw) {
  using base::ErrorKind;
  const std::vector<Strip> one = {{.clip = person(9)}};
  expect_error(ErrorKind::kUsage, "no strip", [] { return contact_sheet({}); });
  expect_error(ErrorKind::kUsage, "pose_count = 0 (must be 1 .. 200)",
               [&] { return contact_sheet(one, {.pose_count = 0}); });
  expect_error(ErrorKind::kUsage, "width = 1 (must be 200 .. 10000)",
               [&] { return contact_sheet(one, {.width = 1.0}); });
  expect_error(ErrorKind::kUsage, "pixel_ratio = nan",
               [&] { return contact_sheet(one, {.pixel_ratio = NAN}); });
  expect_error(ErrorKind::kUsage, "pixels long (at most 32767)",
               [&] { return contact_sheet(one, {.width = 9000.0, .pixel_ratio = 8.0}); });
  const std::vector<Strip> far = {{.clip = person(9)},
                                  {.clip = moved(person(9), 0.0, {2e6, 0.0, 0.0})}};
  expect_error(ErrorKind::kData, "strip 1, frame 0: a joint lies further than 1e6 m",
               [&] { return contact_sheet(far); });
}

TEST(Format, FollowsTheFileNamesEnding) {
  EXPECT_EQ(format_from_name("a/b.PNG"), Format::kPng);
  EXPECT_EQ(format_from_name("b.svg"), Format::kSvg);
  EXPECT_EQ(format_from_name("b.jpg"), std::nullopt);
  EXPECT_EQ(format_from_name(""), std::nullopt);
}

}  // namespace
}  // namespace laban::draw
