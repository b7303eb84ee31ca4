#include "laban/io/bvh.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <locale>
#include <numbers>
#include <sstream>

#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "laban/motion/forward_kinematics.h"
#include "support/clips.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;
using base::Rng;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kRadian = 180.0 / std::numbers::pi;

std::string file_text(const std::string& name) {
  std::ifstream file(LABAN_SOURCE_DIR "/tests/io/bvh/" + name, std::ios::binary);
  EXPECT_TRUE(file) << name;
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string with_line_ends(const std::string& text, std::string_view line_end) {
  std::string result;
  for (const char c : text) {
    if (c == '\n') {
      result += line_end;
    } else {
      result += c;
    }
  }
  return result;
}

/// The error that reading `text` ends in.
std::string error_of(std::string_view text, const BvhReadOptions& options = {}) {
  try {
    const BvhFile file = read_bvh(text, "x.bvh", options);
    ADD_FAILURE() << "read without an error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), options.problems().empty() ? ErrorKind::kFormat : ErrorKind::kUsage);
    return error.what();
  }
  return {};
}

void expect_same_motion(const motion::Clip& clip, const motion::Clip& expected) {
  ASSERT_EQ(clip.joint_count(), expected.joint_count());
  ASSERT_EQ(clip.frame_count(), expected.frame_count());
  EXPECT_EQ(clip.frame_rate_hz(), expected.frame_rate_hz());
  for (int f = 0; f < clip.frame_count(); ++f) {
    for (int j = 0; j < clip.joint_count(); ++j) {
      EXPECT_THAT(clip.rotation(f, j), test::IsNearRotation(expected.rotation(f, j), 1e-9));
      EXPECT_EQ(clip.translation(f, j), expected.translation(f, j));
    }
  }
}

struct Case {
  std::string file;
  std::string message;
};

// One fault a file; all but the wrong files are made from good.bvh.
const std::vector<Case> kBrokenFiles = {
    {"nan", "20:3: 'nan' is not a finite number up to 1e30; mend or remove the frame"},
    {"infinity", "20:3: '-inf' is not a finite number up to 1e30; mend or remove the frame"},
    {"beyond_1e30", "20:3: '1e31' is not a finite number up to 1e30; mend or remove the frame"},
    {"beyond_1e30_in_many_digits",
     "20:3: '100000000e23' is not a finite number up to 1e30; mend or remove the frame"},
    {"decimal_comma", "20:19: '7,5' has a decimal comma; write it with a point"},
    {"word_in_row", "20:19: expected a number, found 'seven'"},
    {"two_points", "20:19: expected a number, found '7.5.1'"},
    {"short_row", "20:22: expected 9 channel values, found 8"},
    {"short_first_row", "19:20: expected 9 channel values, found 8"},
    {"long_row", "20:25: expected 9 channel values, found 10"},
    {"split_row", "20:10: expected 9 channel values, found 4"},
    {"cut_in_first_row", "19:10: expected 9 channel values, found 4"},
    {"cut_in_row", "20:9: expected 9 channel values, found 4"},
    {"frame_time_zero",
     "18:13: Frame Time must be greater than 0; give the frame rate (--fps) instead"},
    {"frame_time_negative",
     "18:13: Frame Time must be greater than 0; give the frame rate (--fps) instead"},
    {"frame_time_comma", "18:13: '0,0333333' has a decimal comma; write it with a point"},
    {"no_frame_time",
     "18:1: expected 'Frame Time:' and the seconds between two frames; give the frame rate "
     "(--fps) if the file has none"},
    {"frames_beyond_counting", "17:9: Frames must be at most 2147483647; give the number of rows"},
    {"no_frames", "17:1: expected 'Frames:' and the number of frames after MOTION"},
    {"no_rows", "17:1: there is no row of values, so no motion"},
    {"no_motion", "16:1: the file ends before MOTION; it is cut short or has no motion"},
    {"cut_in_hierarchy", "6:3: this block is never closed; a '}' is missing"},
    {"brace_missing", "2:1: this block is never closed; a '}' is missing"},
    {"brace_extra", "16:1: expected ROOT or MOTION, found '}'"},
    {"no_opening_brace", "3:3: expected '{', found 'OFFSET'"},
    {"no_name", "6:3: the joint has no name; write one after JOINT or ROOT"},
    {"no_offset", "6:3: joint 'Chest' has no OFFSET"},
    {"two_offsets", "9:5: a second OFFSET in one block"},
    {"short_offset", "9:5: expected a number, found 'CHANNELS'"},
    {"two_channels", "10:5: a second CHANNELS in one joint"},
    {"unknown_channel",
     "9:16: expected a channel such as Zrotation or Xposition, found 'Wrotation'"},
    {"channel_twice", "9:26: channel 'zrotation' is given twice"},
    {"too_few_channels", "10:5: expected a channel such as Zrotation or Xposition, found 'End'"},
    {"ten_channels", "9:5: CHANNELS must be a number from 0 to 9, then as many names"},
    {"end_site_channels", "12:21: an End Site cannot have channels; make it a JOINT"},
    {"joint_in_end_site", "12:7: expected OFFSET or '}' in an End Site, found 'JOINT'"},
    {"root_in_joint", "6:3: ROOT inside another joint; a '}' before it is missing"},
    {"unknown_word", "10:5: expected OFFSET, CHANNELS, JOINT, End Site or '}', found 'LIMITS'"},
    {"no_root", "2:1: there is no ROOT before MOTION"},
    {"no_channels", "6:1: no joint has CHANNELS, so there is no motion to read"},
    {"not_bvh", "1:1: a BVH file begins with HIERARCHY, found '; FBX 7.3.0 project file'"},
    {"empty", "1:1: a BVH file begins with HIERARCHY, found nothing"},
    {"utf16", "1:1: the text is UTF-16; save it as UTF-8"},
};

TEST(ReadBvh, NamesTheFaultThePlaceAndTheMend) {
  for (const Case& broken : kBrokenFiles) {
    SCOPED_TRACE(broken.file);
    const std::string text = file_text(broken.file + ".bvh");
    EXPECT_EQ(error_of(text), "x.bvh:" + broken.message);
    EXPECT_EQ(error_of(with_line_ends(text, "\r\n")), "x.bvh:" + broken.message);
    EXPECT_EQ(error_of(with_line_ends(text, "\r")), "x.bvh:" + broken.message);
  }
}

TEST(ReadBvh, CountsColumnsInCharacters) {
  const std::string named = replaced(file_text("good.bvh"), "ROOT Hips\n{", "ROOT h\xC3\xA9 } {");
  EXPECT_EQ(error_of("\xEF\xBB\xBF" + named), "x.bvh:2:9: expected '{', found '}'");
}

TEST(ReadBvh, ReadsWhatTheFileSays) {
  const BvhFile file = read_bvh(file_text("good.bvh"), "good.bvh", {.unit_m = 0.01});
  const motion::Skeleton& skeleton = file.clip.skeleton();
  ASSERT_EQ(skeleton.joint_count(), 2);
  EXPECT_EQ(skeleton.joint(1).name, "Chest");
  EXPECT_EQ(skeleton.joint(1).parent, 0);
  EXPECT_EQ(skeleton.joint(1).rest_offset, Eigen::Vector3d(0.0, 0.2, 0.0));
  EXPECT_EQ(skeleton.joint(1).end_site, Eigen::Vector3d(0.0, 0.1, 0.0));
  EXPECT_FALSE(skeleton.joint(0).end_site.has_value());
  ASSERT_EQ(file.clip.frame_count(), 2);
  EXPECT_EQ(file.clip.frame_rate_hz(), 30.0);
  EXPECT_EQ(file.clip.root_positions().col(1), Eigen::Vector3d(0.01, 0.91, 0.02));
  EXPECT_FALSE(file.clip.has_translations());
  // Zrotation 6, Xrotation 7.5, Yrotation 8, in this order.
  const Eigen::Quaterniond expected = Eigen::AngleAxisd(6.0 / kRadian, Eigen::Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(7.5 / kRadian, Eigen::Vector3d::UnitX()) *
                                      Eigen::AngleAxisd(8.0 / kRadian, Eigen::Vector3d::UnitY());
  EXPECT_THAT(file.clip.rotation(1, 1), test::IsNearRotation(expected, 1e-12));
  EXPECT_FALSE(file.unit_guessed);
  EXPECT_THAT(file.warnings, IsEmpty());
}

TEST(ReadBvh, ReadsTheSameMotionInEveryDress) {
  const std::string good = file_text("good.bvh");
  const std::vector<std::pair<std::string, std::string>> dresses = {
      {"CRLF", with_line_ends(good, "\r\n")},
      {"CR", with_line_ends(good, "\r")},
      {"tabs", replaced(replaced(good, "    OFFSET 0 20 0", "\t\tOFFSET\t0\t20  0\t"), "0 90 0",
                        "\t0\t90 \t0")},
      {"byte-order mark", "\xEF\xBB\xBF" + good},
      {"blank lines", "\n \n" + with_line_ends(good, "\n\n \n") + "\n\t\n"},
      {"two spaces", replaced(good, "1 91 2 11", " 1  91   2 11")},
      {"no line end at the end", good.substr(0, good.size() - 1)},
      {"lower case", replaced(replaced(good, "HIERARCHY", "hierarchy"), "Zrotation", "ZROTATION")},
      {"end site in capitals", replaced(good, "End Site", "END SITE")},
      {"end site named", replaced(good, "End Site", "End Site Head top")},
      {"end", replaced(good, "End Site", "End")},
      {"end site with channels 0", replaced(good, "OFFSET 0 10 0", "OFFSET 0 10 0 CHANNELS 0")},
      {"braces on the line", replaced(replaced(good, "ROOT Hips\n{", "ROOT Hips {"),
                                      "      OFFSET 0 10 0\n    }", "OFFSET 0 10 0}")},
      {"scientific", replaced(replaced(good, "7.5 8", "7.5e+00 8E0"), "91 2", "9.1e1 +2")},
      {"no leading zero", replaced(replaced(good, "0.0333333", ".0333333"), "7.5", "75.e-1")},
      {"far too small", replaced(good, "0 90 0", "1e-400 90 -0")},
      {"frames and time without a colon",
       replaced(replaced(good, "Frames:", "Frames\t"), "Frame Time:", "frame  time :")},
      {"wrapped rows", replaced(replaced(good, "30 5 6 7", "30\n5 6 7"), "1 91 2 ", "1 91 2\n\n")},
  };
  const motion::Clip expected = read_bvh(good, "good", {.unit_m = 0.01}).clip;
  for (const auto& dress : dresses) {
    SCOPED_TRACE(dress.first);
    const BvhFile file = read_bvh(dress.second, "x", {.unit_m = 0.01});
    expect_same_motion(file.clip, expected);
    EXPECT_THAT(file.warnings, IsEmpty());
  }
}

TEST(ReadBvh, KeepsNamesWithSpacesAndColons) {
  const std::string text =
      replaced(file_text("good.bvh"), "JOINT Chest", "JOINT rig: left  chest \t");
  EXPECT_EQ(read_bvh(text, "x").clip.skeleton().joint(1).name, "rig: left  chest");
}

/// Rotation about one axis, degrees.
Eigen::Quaterniond turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees / kRadian, axis));
}

TEST(ReadBvh, ReadsAnyOrderOfChannelsJointByJoint) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const BvhFile file = read_bvh(file_text("mixed_orders.bvh"), "x", {.unit_m = 0.01});
  EXPECT_THAT(file.warnings, IsEmpty());
  std::vector<std::string> names;
  for (const motion::Joint& joint : file.clip.skeleton().joints()) names.push_back(joint.name);
  // A name may hold a colon, begin with "end" or be there twice.
  EXPECT_THAT(names, ElementsAre("mixamorig:Hips", "Legend", "end_effector", "Legend", "end"));
  EXPECT_EQ(file.clip.skeleton().find("Legend"), 1);
  EXPECT_EQ(file.clip.frame_rate_hz(), 120.0);
  // Positions stand for the OFFSET: the height is not counted twice.
  EXPECT_TRUE(file.clip.root_positions().col(0).isApprox(Eigen::Vector3d(0.0, 0.95, 0.0), 1e-15));
  EXPECT_TRUE(
      file.clip.root_positions().col(1).isApprox(Eigen::Vector3d(0.05, 0.965, -0.1), 1e-15));
  EXPECT_TRUE(file.clip.translation(1, 3).isApprox(Eigen::Vector3d(-0.11, -0.06, 0.01), 1e-15));
  EXPECT_TRUE(file.clip.translation(1, 4).isApprox(Eigen::Vector3d(0.0, -0.4, 0.0), 1e-15));
  const std::vector<Eigen::Quaterniond> expected = {
      turn(10, z) * turn(20, y) * turn(30, x), turn(40, x) * turn(50, z) * turn(60, y),
      turn(70, y) * turn(80, z), turn(-15, y) * turn(25, z) * turn(35, x), turn(45, x)};
  for (int j = 0; j < 5; ++j) {
    EXPECT_THAT(file.clip.rotation(1, j),
                test::IsNearRotation(expected[static_cast<std::size_t>(j)], 1e-12));
  }
}

TEST(ReadBvh, TurnsByAnyAngleAsPreciselyAsSineAndCosineDo) {
  Rng rng(11);
  std::vector<double> degrees = {0, 1e-300, 90, -90, 180, -180, 270, 359.9999999, 360, 540, 1e12};
  for (int i = 0; i < 20000; ++i) degrees.push_back(rng.uniform(-800.0, 800.0));
  for (int i = 0; i < 2000; ++i) degrees.push_back(std::pow(10.0, rng.uniform(-20.0, 30.0)));
  std::ostringstream text;
  text.precision(17);
  text << "HIERARCHY\nROOT a { OFFSET 0 0 0 CHANNELS 1 Xrotation }\nMOTION\nFrames: "
       << degrees.size() << "\nFrame Time: 1\n";
  for (const double angle : degrees) text << angle << '\n';
  const motion::Clip clip = read_bvh(text.str(), "x", {.unit_m = 1.0}).clip;
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    const long double half = std::remainder(static_cast<long double>(degrees[i]), 720.0L) *
                             (std::numbers::pi_v<long double> / 360.0L);
    const Eigen::Quaterniond& q = clip.rotation(static_cast<int>(i), 0);
    // The clip may have turned the quaternion's sign.
    const double sign = q.w() * std::cos(half) + q.x() * std::sin(half) < 0.0 ? -1.0 : 1.0;
    ASSERT_NEAR(q.x(), sign * static_cast<double>(std::sin(half)), 4e-16) << degrees[i];
    ASSERT_NEAR(q.w(), sign * static_cast<double>(std::cos(half)), 4e-16) << degrees[i];
    ASSERT_EQ(q.y(), 0.0);
  }
}

/// A number in one of the ways that exporters write them: 1 to 20 digits, with or without a point
/// and an exponent.
std::string random_number_text(Rng& rng) {
  std::string text = rng.index(2) == 0 ? "-" : "";
  const int digits = 1 + rng.index(20);
  const int point = rng.index(digits + 2);
  for (int i = 0; i < digits; ++i) {
    if (i == point) text += '.';
    text += static_cast<char>('0' + rng.index(10));
  }
  const int form = rng.index(3);
  if (form == 1) text.append("e").append(std::to_string(rng.index(10)));
  if (form == 2) text.append("E-").append(std::to_string(rng.index(40)));
  return text;
}

TEST(ReadBvh, ReadsEveryNumberToTheNearestDouble) {
  Rng rng(8);
  std::vector<double> expected;
  std::string text =
      "HIERARCHY\nROOT a { OFFSET 0 0 0 CHANNELS 1 Xposition }\n"
      "MOTION\nFrames: 20000\nFrame Time: 1\n";
  for (int i = 0; i < 20000; ++i) {
    const std::string number = random_number_text(rng);
    expected.push_back(std::strtod(number.c_str(), nullptr));
    text += number + '\n';
  }
  const motion::Clip clip = read_bvh(text, "x", {.unit_m = 1.0}).clip;
  for (int i = 0; i < 20000; ++i) {
    ASSERT_EQ(clip.root_positions()(0, i), expected[static_cast<std::size_t>(i)]);
  }
}

TEST(ReadBvh, TakesALeafWithoutAnEndSite) {
  const std::string text =
      replaced(file_text("good.bvh"), "    End Site\n    {\n      OFFSET 0 10 0\n    }\n", "");
  EXPECT_FALSE(read_bvh(text, "x").clip.skeleton().joint(1).end_site.has_value());
}

TEST(ReadBvh, TakesTheRowsWhenFramesSaysOtherwise) {
  for (const std::string frames : {"1", "3", "2000000000", "1e9", "-1", "1.5"}) {
    SCOPED_TRACE(frames);
    const BvhFile file =
        read_bvh(replaced(file_text("good.bvh"), "Frames: 2", "Frames: " + frames), "x.bvh");
    EXPECT_EQ(file.clip.frame_count(), 2);
    EXPECT_THAT(file.warnings, ElementsAre("x.bvh:17:1: Frames says " + frames +
                                           ", but there are 2 rows of values; these are read"));
  }
}

TEST(ReadBvh, ReadsTheFirstOfSeveralRoots) {
  const std::string prop =
      "ROOT Prop\n{\nOFFSET 5 5 5\nCHANNELS 1 Xposition\n}\n"
      "ROOT Ball\n{\nOFFSET 5 5 5\nCHANNELS 1 Xposition\n}\n";
  std::string text = replaced(file_text("good.bvh"), "MOTION", prop + "MOTION");
  text = replaced(replaced(text, "5 6 7\n", "5 6 7 100 7\n"), "6 7.5 8\n", "6 7.5 8 100 7\n");
  const BvhFile file = read_bvh(text, "x.bvh", {.unit_m = 0.01});
  expect_same_motion(file.clip, read_bvh(file_text("good.bvh"), "x", {.unit_m = 0.01}).clip);
  EXPECT_THAT(
      file.warnings,
      ElementsAre(
          "x.bvh:16:1: a further ROOT and all below it are ignored; only the first is read"));
}

TEST(ReadBvh, ReadsScaleChannelsAndIgnoresThem) {
  std::string text = replaced(file_text("good.bvh"), "CHANNELS 3 Zrotation Xrotation Yrotation",
                              "CHANNELS 9 Xposition Yposition Zposition Zrotation Xrotation "
                              "Yrotation Xscale Yscale Zscale");
  text = replaced(text, "30 5 6 7", "30 0 20 0 5 6 7 1 1 1");
  text = replaced(text, "31 6 7.5 8", "31 0 20 0 6 7.5 8 1 2 3");
  const BvhFile file = read_bvh(text, "x.bvh", {.unit_m = 0.01});
  expect_same_motion(file.clip, read_bvh(file_text("good.bvh"), "x", {.unit_m = 0.01}).clip);
  EXPECT_THAT(file.warnings, ElementsAre("x.bvh:9:76: scale channels are ignored"));
}

TEST(ReadBvh, IgnoresAnEndSiteBesideAJoint) {
  const BvhFile file = read_bvh(
      replaced(file_text("good.bvh"), "  JOINT", "  End Site { OFFSET 1 1 1 }\n  JOINT"), "x.bvh");
  EXPECT_FALSE(file.clip.skeleton().joint(0).end_site.has_value());
  EXPECT_THAT(file.warnings, ElementsAre("x.bvh:2:1: joint 'Hips' has both a child joint and an "
                                         "end site; the end site is ignored"));
}

TEST(ReadBvh, SnapsTheFrameRateOnlyWhereFrameTimeIsRounded) {
  struct Rate {
    std::string frame_time;
    double rate_hz = 0.0;
  };
  const std::vector<Rate> rates = {
      {"0.0333333", 30.0},
      {".0083333", 120.0},
      {".0083", 120.0},
      {"0.00833333", 120.0},
      {"0.0166667", 60.0},
      {"0.016667", 60.0},
      {"8.33333e-03", 120.0},
      {"0.0417", 24.0},
      {"0.00714286", 140.0},
      {"0.008333333333333333", 120.0},
      {"0.0083333333333333349", 120.0},  // the double after 1 / 120
      {"1", 1.0},
      {"0.01", 100.0},
      {"2.5", 0.4},
      {"0.007", 1 / 0.007},
      {"0.0084", 1 / 0.0084},
      {"0.0333667", 1 / 0.0333667},  // 29.97 Hz
      {"0.0417083", 1 / 0.0417083},  // 23.976 Hz
      {"0.03", 1 / 0.03},            // two decimals say too little: 33.3, neither 33 nor 30
  };
  for (const Rate& rate : rates) {
    SCOPED_TRACE(rate.frame_time);
    const std::string text = replaced(file_text("good.bvh"), "0.0333333", rate.frame_time);
    EXPECT_EQ(read_bvh(text, "x").clip.frame_rate_hz(), rate.rate_hz);
  }
}

TEST(ReadBvh, TakesTheCallersFrameRateWhateverTheFileSays) {
  for (const std::string file :
       {"good", "frame_time_zero", "frame_time_negative", "no_frame_time", "frame_time_comma"}) {
    SCOPED_TRACE(file);
    EXPECT_EQ(read_bvh(file_text(file + ".bvh"), "x", {.frame_rate_hz = 50.0}).clip.frame_rate_hz(),
              50.0);
  }
}

TEST(ReadBvh, RefusesOptionsWithoutSense) {
  const std::string good = file_text("good.bvh");
  EXPECT_THAT(error_of(good, {.unit_m = 0.0}), HasSubstr("BvhReadOptions::unit_m = 0.0"));
  EXPECT_THAT(error_of(good, {.frame_rate_hz = std::nan("")}),
              HasSubstr("BvhReadOptions::frame_rate_hz = nan"));
}

/// An adult's rest skeleton in units of `unit_m`: legs, a spine and arms; a root far below the
/// hips must not count.
std::string adult(double unit_m) {
  std::ostringstream text;
  const auto joint = [&](const char* name, double x_m, double y_m) {
    text << (std::string_view(name) == "Root" ? "ROOT " : "JOINT ") << name << " { OFFSET "
         << x_m / unit_m << ' ' << y_m / unit_m << " 0 CHANNELS 1 Xrotation ";
  };
  text << "HIERARCHY ";
  joint("Root", 0, 0);
  joint("Hips", 0, 0.95);
  joint("Thigh", 0.1, 0);
  joint("Shin", 0, -0.45);
  text << "End Site { OFFSET 0 " << -0.4 / unit_m << " 0 } } } ";
  joint("Chest", 0, 0.4);
  joint("UpperArm", 0.2, 0.1);
  joint("Forearm", 0.28, 0);
  text << "End Site { OFFSET " << 0.25 / unit_m << " 0 0 } } } } } } "
       << "MOTION Frames: 1 Frame Time: 0.01\n0 0 0 0 0 0 0\n";
  return text.str();
}

TEST(ReadBvh, GuessesTheUnitFromTheReach) {
  for (const double unit_m : {1.0, 0.01, 0.001, 0.0254, 0.05644}) {
    SCOPED_TRACE(unit_m);
    const BvhFile file = read_bvh(adult(unit_m), "x");
    EXPECT_EQ(file.unit_m, unit_m);
    EXPECT_TRUE(file.unit_guessed);
    EXPECT_NEAR(file.clip.skeleton().joint(1).rest_offset.y(), 0.95, 1e-5);  // 6 digits printed
  }
}

TEST(ReadBvh, TakesCentimetresForASkeletonWithoutSize) {
  std::string text = replaced(file_text("good.bvh"), "OFFSET 0 20 0", "OFFSET 0 0 0");
  const BvhFile file = read_bvh(replaced(text, "OFFSET 0 10 0", "OFFSET 0 0 0"), "x.bvh");
  EXPECT_EQ(file.unit_m, 0.01);
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("no size to guess its unit from")));
}

std::string chain(int depth, std::string_view channels) {
  std::string text = "HIERARCHY\n";
  for (int i = 0; i < depth; ++i) {
    text += (i == 0 ? "ROOT a{OFFSET 0 1 0 " : "JOINT a{OFFSET 0 1 0 ") + std::string(channels);
  }
  return text + std::string(static_cast<std::size_t>(depth), '}');
}

TEST(ReadBvh, ReadsTheDeepestChainAndRefusesADeeperOne) {
  const std::string motion = "\nMOTION\nFrames: 1\nFrame Time: 1\n";
  const std::string channels = "CHANNELS 1 Xrotation\n";
  std::string row;
  for (int i = 0; i < kMaxBvhDepth; ++i) row += "0 ";
  EXPECT_EQ(read_bvh(chain(kMaxBvhDepth, channels) + motion + row, "x").clip.joint_count(),
            kMaxBvhDepth);
  EXPECT_EQ(error_of(chain(kMaxBvhDepth + 1, channels) + motion + row),
            "x.bvh:10002:1: joints are nested more than 10000 deep");
}

TEST(ReadBvh, RefusesMoreJointsThanItSays) {
  std::string text = "HIERARCHY\nROOT a{OFFSET 0 0 0 CHANNELS 1 Xrotation\n";
  for (int i = 0; i < kMaxBvhJoints; ++i) text += "JOINT b{OFFSET 0 0 0}\n";
  EXPECT_EQ(error_of(text + "}\nMOTION\n"),
            "x.bvh:100002:1: more than 100000 joints, the most that are read");
}

TEST(ReadBvh, RefusesJointsWithoutChannelsThatWouldFillMemory) {
  std::string text = "HIERARCHY\nROOT a{OFFSET 0 0 0 CHANNELS 1 Xrotation\n";
  for (int i = 0; i < 5000; ++i) text += "JOINT b{OFFSET 0 0 0}\n";
  text += "}\nMOTION\nFrames: 5000\nFrame Time: 1\n";
  for (int i = 0; i < 5000; ++i) text += "0\n";
  EXPECT_THAT(error_of(text),
              HasSubstr(": the motion takes more memory than is read from a file of "
                        "this size; remove the joints without channels"));
}

TEST(ReadBvh, SaysEachKindOfWarningOnce) {
  std::string text = "HIERARCHY\nROOT a{OFFSET 0 0 0 CHANNELS 1 Xscale\n";
  for (int i = 0; i < 100; ++i) text += "End Site{OFFSET 0 1 0}\n";
  for (int i = 0; i < 100; ++i) text += "JOINT b{OFFSET 0 0 0 CHANNELS 1 Xscale}\n";
  text += "}\nMOTION\nFrames: 1\nFrame Time: 1\n";
  for (int i = 0; i < 101; ++i) text += "1 ";
  EXPECT_THAT(read_bvh(text, "x", {.unit_m = 1.0}).warnings,
              SizeIs(3));  // scale, several end sites, inner end site
}

class CommaPoint : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\1"; }
};

TEST(Bvh, DoesNotDependOnTheLocale) {
  const std::string text = file_text("good.bvh");
  const BvhFile before = read_bvh(text, "x");
  const std::string written = write_bvh(before.clip).text;
  const std::locale old = std::locale::global(std::locale(std::locale(), new CommaPoint));
  const BvhFile after = read_bvh(text, "x");
  const std::string written_after = write_bvh(after.clip).text;
  std::locale::global(old);
  expect_same_motion(after.clip, before.clip);
  EXPECT_EQ(written_after, written);
}

// ---- An independent reading: 4 x 4 matrices, a channel at a time.

struct RandomFile {
  std::string text;
  std::vector<Eigen::Vector3d> positions;  // frame-major, file units
};

Eigen::Matrix4d channel_matrix(const std::string& name, double value) {
  Eigen::Affine3d m = Eigen::Affine3d::Identity();
  const Eigen::Vector3d axis = Eigen::Vector3d::Unit(name[0] - 'X');
  m.rotate(Eigen::AngleAxisd(value / kRadian, axis));
  return m.matrix();
}

/// A random tree of `joints` whose channels come in `order`, with positions if `six`, and the joint
/// positions that matrices give for it.
RandomFile random_file(const std::string& order, bool six, Rng& rng) {
  constexpr int kJoints = 6;
  constexpr int kFrames = 3;
  const std::array<int, kJoints> parents = {-1, 0, 1, 1, 0, 4};  // depth first
  std::vector<std::string> channels;
  if (six) channels = {"Yposition", "Xposition", "Zposition"};
  for (const char axis : order) channels.push_back(axis + std::string("rotation"));
  std::ostringstream text;
  text.precision(17);
  std::array<Eigen::Vector3d, kJoints> offsets;
  text << "HIERARCHY\n";
  int open = 0;
  for (std::size_t j = 0; j < kJoints; ++j) {
    static constexpr std::array<int, kJoints> kDepths = {0, 1, 2, 2, 1, 2};
    for (; open > kDepths[j]; --open) text << "}\n";
    offsets[j] = {rng.normal(), rng.normal(), rng.normal()};
    text << (j == 0 ? "ROOT j" : "JOINT j") << j << "\n{\nOFFSET " << offsets[j].transpose()
         << "\nCHANNELS " << channels.size();
    for (const std::string& channel : channels) text << ' ' << channel;
    text << '\n';
    ++open;
  }
  for (; open > 0; --open) text << "}\n";
  text << "MOTION\nFrames: " << kFrames << "\nFrame Time: 0.01\n";
  RandomFile file;
  for (int f = 0; f < kFrames; ++f) {
    std::array<Eigen::Matrix4d, kJoints> model_from_joint;
    for (std::size_t j = 0; j < kJoints; ++j) {
      Eigen::Vector3d position = offsets[j];
      Eigen::Matrix4d rotation = Eigen::Matrix4d::Identity();
      for (const std::string& channel : channels) {
        const bool is_position = channel.ends_with("position");
        const double value = is_position ? rng.normal() : rng.uniform(-400.0, 400.0);
        text << value << ' ';
        if (is_position) {
          position[channel[0] - 'X'] = value;
        } else {
          rotation = rotation * channel_matrix(channel, value);
        }
      }
      Eigen::Matrix4d parent_from_joint = Eigen::Matrix4d::Identity();
      parent_from_joint.topRightCorner<3, 1>() = position;
      parent_from_joint = parent_from_joint * rotation;
      model_from_joint[j] =
          j == 0 ? parent_from_joint
                 : Eigen::Matrix4d(model_from_joint[static_cast<std::size_t>(parents[j])] *
                                   parent_from_joint);
      file.positions.emplace_back(model_from_joint[j].topRightCorner<3, 1>());
    }
    text << '\n';
  }
  file.text = text.str();
  return file;
}

const std::vector<std::string> kOrders = {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"};

TEST(ReadBvh, PlacesJointsAsMatricesDoInEveryChannelOrder) {
  Rng rng(3);
  for (const std::string& order : kOrders) {
    for (const std::string& part : {order, order.substr(0, 1), order.substr(0, 2)}) {
      for (const bool six : {false, true}) {
        SCOPED_TRACE(part + (six ? " with positions" : ""));
        const RandomFile file = random_file(part, six, rng);
        const BvhFile read = read_bvh(file.text, "x", {.unit_m = 1.0});
        EXPECT_EQ(read.clip.has_translations(), six);
        const Eigen::Matrix3Xd positions = motion::joint_positions(read.clip);
        ASSERT_EQ(positions.cols(), std::ssize(file.positions));
        for (Eigen::Index i = 0; i < positions.cols(); ++i) {
          // 17 digits a number, a chain of 3 joints of length about 2.
          EXPECT_LT((positions.col(i) - file.positions[static_cast<std::size_t>(i)]).norm(), 1e-13);
        }
      }
    }
  }
}

TEST(ReadBvh, LeavesStillJointsOnTheirOffset) {
  // Six channels on both joints. The chest repeats its OFFSET but for noise: 5e-7 m, then 2e-6 m.
  std::string text =
      replaced(file_text("good.bvh"), "CHANNELS 3", "CHANNELS 6 Xposition Yposition Zposition");
  text = replaced(text, "30 5 6 7", "30 0 20 0 5 6 7");
  const std::string still = replaced(text, "31 6 7.5 8", "31 0 20.00005 0 6 7.5 8");
  EXPECT_FALSE(read_bvh(still, "x", {.unit_m = 0.01}).clip.has_translations());
  const std::string moving = replaced(text, "31 6 7.5 8", "31 0 20.0002 0 6 7.5 8");
  const motion::Clip clip = read_bvh(moving, "x", {.unit_m = 0.01}).clip;
  ASSERT_TRUE(clip.has_translations());
  EXPECT_EQ(clip.translation(0, 1), Eigen::Vector3d(0, 0.2, 0));
  EXPECT_EQ(clip.translation(1, 1), Eigen::Vector3d(0, 0.200002, 0));
}

TEST(ReadBvh, LeavesStillJointsOnTheirOffsetBesideMovingOnes) {
  std::string text = "HIERARCHY\nROOT a{OFFSET 0 0 0 CHANNELS 1 Xposition\n";
  for (int i = 0; i < 2; ++i) text += "JOINT b{OFFSET 0 1 0 CHANNELS 1 Yposition}\n";
  // The first joint moves in the last row, so what came before it is read again; the other is off
  // its OFFSET by less than a micrometre.
  text += "}\nMOTION\nFrames: 3\nFrame Time: 1\n0 1.0000005 1.0000005\n0 1 1\n5 2 0.9999999\n";
  const motion::Clip clip = read_bvh(text, "x", {.unit_m = 1.0}).clip;
  ASSERT_TRUE(clip.has_translations());
  EXPECT_EQ(clip.translation(0, 1).y(), 1.0000005);
  EXPECT_EQ(clip.translation(2, 1).y(), 2.0);
  for (int f = 0; f < 3; ++f) EXPECT_EQ(clip.translation(f, 2).y(), 1.0);
  EXPECT_EQ(clip.translation(2, 0).x(), 5.0);
}

TEST(ReadBvh, ReadsMoreRowsThanItMadeRoomFor) {
  std::string text =
      "HIERARCHY\nROOT a{OFFSET 0 0 0 CHANNELS 1 Xposition JOINT b{OFFSET 0 1 0 CHANNELS 2 "
      "Xrotation Yposition}}\nMOTION\nFrames: 2\nFrame Time: 1\n";
  for (int f = 0; f < 5000; ++f) {
    text += std::to_string(f) + ' ' + std::to_string(f % 360) + ' ' + std::to_string(f) + '\n';
  }
  const motion::Clip clip = read_bvh(text, "x", {.unit_m = 1.0}).clip;
  ASSERT_EQ(clip.frame_count(), 5000);
  for (int f = 0; f < 5000; ++f) {
    ASSERT_EQ(clip.root_positions()(0, f), f);
    ASSERT_EQ(clip.translation(f, 1), Eigen::Vector3d(0.0, f, 0.0));
    ASSERT_THAT(clip.rotation(f, 1),
                test::IsNearRotation(turn(f % 360, Eigen::Vector3d::UnitX()), 1e-9));
  }
}

// ---- Writing, and there and back.

struct TreeShape {
  int joints = 12;
  int frames = 20;
  bool translations = false;
  double length_m = 0.2;  // of a joint's offset
};

/// A random tree, not in depth-first order, of any rotations.
motion::Clip random_tree(const TreeShape& shape, Rng& rng) {
  const auto random_vector = [&](double length) {
    return Eigen::Vector3d(Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal()).normalized() *
                           length);
  };
  std::vector<motion::Joint> joints;
  for (int j = 0; j < shape.joints; ++j) {
    joints.push_back({"joint" + std::to_string(j), j == 0 ? -1 : rng.index(j),
                      random_vector(shape.length_m), std::nullopt});
  }
  const auto cells = static_cast<std::size_t>(shape.frames) * joints.size();
  std::vector<Eigen::Quaterniond> rotations(cells);
  for (Eigen::Quaterniond& q : rotations) {
    q = Eigen::Quaterniond(rng.normal(), rng.normal(), rng.normal(), rng.normal()).normalized();
  }
  Eigen::Matrix3Xd root(3, shape.frames);
  for (int f = 0; f < shape.frames; ++f) root.col(f) = random_vector(3.0);
  Eigen::Matrix3Xd translations;
  if (shape.translations) {
    translations.resize(3, static_cast<Eigen::Index>(cells));
    for (Eigen::Index i = 0; i < translations.cols(); ++i) {
      const Eigen::Index j = i % shape.joints;
      // Every other joint keeps to its offset.
      translations.col(i) = j == 0       ? Eigen::Vector3d(root.col(i / shape.joints))
                            : j % 2 == 0 ? random_vector(0.3)
                                         : joints[static_cast<std::size_t>(j)].rest_offset;
    }
  }
  return {std::make_shared<const motion::Skeleton>(std::move(joints)), 60.0, std::move(root),
          std::move(rotations), std::move(translations)};
}

/// One joint that follows `rotations`, its root at rest.
motion::Clip single_joint(std::vector<Eigen::Quaterniond> rotations) {
  std::vector<motion::Joint> joints(1);
  joints[0].name = "only";
  const auto frames = static_cast<Eigen::Index>(rotations.size());
  return {std::make_shared<const motion::Skeleton>(std::move(joints)), 60.0,
          Eigen::Matrix3Xd::Zero(3, frames), std::move(rotations)};
}

void expect_round_trip(const motion::Clip& clip, const BvhWriteOptions& options) {
  const BvhFile again =
      read_bvh(write_bvh(clip, options).text, "again", {.unit_m = options.unit_m});
  EXPECT_THAT(again.warnings, IsEmpty());
  ASSERT_EQ(again.clip.joint_count(), clip.joint_count());
  ASSERT_EQ(again.clip.frame_count(), clip.frame_count());
  EXPECT_DOUBLE_EQ(again.clip.frame_rate_hz(), clip.frame_rate_hz());
  for (int f = 0; f < clip.frame_count(); ++f) {
    const motion::ModelPose before = motion::forward_kinematics(clip, f);
    const motion::ModelPose after = motion::forward_kinematics(again.clip, f);
    for (int j = 0; j < clip.joint_count(); ++j) {
      const int k = again.clip.skeleton().find(clip.skeleton().joint(j).name).value();
      ASSERT_THAT(again.clip.rotation(f, k), test::IsNearRotation(clip.rotation(f, j), 1e-5));
      ASSERT_LT((after.positions.col(k) - before.positions.col(j)).norm(), 1e-6);
    }
  }
}

TEST(Bvh, RoundTripKeepsRandomTreesInEveryOrderAndUnit) {
  Rng rng(4);
  for (const std::string& order : kOrders) {
    for (const double unit_m : {1.0, 0.01, 0.001, 0.0254, 0.05644}) {
      for (const bool translations : {false, true}) {
        SCOPED_TRACE(order + " in " + std::to_string(unit_m));
        expect_round_trip(random_tree({.translations = translations}, rng),
                          {.unit_m = unit_m, .rotation_order = order});
      }
    }
  }
}

TEST(Bvh, RoundTripKeepsAwkwardClips) {
  Rng rng(5);
  expect_round_trip(random_tree({.frames = 1}, rng), {});
  expect_round_trip(random_tree({.joints = 1}, rng), {});
  expect_round_trip(random_tree({.joints = 1, .frames = 1}, rng), {});
  expect_round_trip(random_tree({.joints = 1, .translations = true}, rng), {});
  expect_round_trip(random_tree({.length_m = 0.0}, rng), {});
  expect_round_trip(test::random_clip({.frame_rate_hz = 29.97}), {});
  expect_round_trip(test::random_clip({.frame_rate_hz = 1000.0 / 7.0}), {});
}

/// A joint that tips about the middle axis of `order` through the angle of gimbal lock while it
/// turns slowly about the others; `lock_degrees` is +-90.
motion::Clip through_gimbal_lock(const std::string& order, double lock_degrees) {
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = -50; f <= 50; ++f) {
    const auto axis = [&](std::size_t n) {
      return Eigen::Vector3d(Eigen::Vector3d::Unit(order[n] - 'X'));
    };
    rotations.push_back(turn(10.0 + 0.1 * f, axis(0)) * turn(lock_degrees + 0.5 * f, axis(1)) *
                        turn(20.0 - 0.2 * f, axis(2)));
  }
  return single_joint(std::move(rotations));
}

/// Rotation values of the rows of a single-joint file, 3 x F, degrees.
Eigen::Matrix3Xd written_angles(const motion::Clip& clip, const BvhWriteOptions& options) {
  const std::string text = write_bvh(clip, options).text;
  std::istringstream rows(text.substr(text.find("Frame Time")));
  std::string line;
  std::getline(rows, line);
  Eigen::Matrix3Xd angles(3, clip.frame_count());
  for (Eigen::Index f = 0; f < angles.cols(); ++f) {
    Eigen::Vector3d position;
    for (double& value : position) rows >> value;
    for (double& value : angles.col(f)) rows >> value;
  }
  EXPECT_TRUE(rows);
  return angles;
}

double largest_step(const Eigen::Matrix3Xd& angles) {
  return (angles.rightCols(angles.cols() - 1) - angles.leftCols(angles.cols() - 1))
      .cwiseAbs()
      .maxCoeff();
}

TEST(WriteBvh, GoesThroughGimbalLockWithoutAJump) {
  for (const std::string& order : kOrders) {
    for (const double lock_degrees : {90.0, -90.0}) {
      SCOPED_TRACE(order + " " + std::to_string(lock_degrees));
      const motion::Clip clip = through_gimbal_lock(order, lock_degrees);
      expect_round_trip(clip, {.rotation_order = order});
      // The true angles change by at most 0.5 degrees a frame; at the lock itself, where the first
      // angle is held, by 0.5 + 0.2.
      EXPECT_LT(largest_step(written_angles(clip, {.rotation_order = order})), 0.71);
    }
  }
}

// All products of quarter turns: where angles are exactly 90 or 180 degrees.
TEST(WriteBvh, KeepsQuarterTurnsInEveryOrder) {
  std::vector<Eigen::Quaterniond> rotations;
  for (int i = 0; i < 64; ++i) {
    rotations.push_back(turn(90.0 * (i % 4), Eigen::Vector3d::UnitX()) *
                        turn(90.0 * (i / 4 % 4), Eigen::Vector3d::UnitY()) *
                        turn(90.0 * (i / 16), Eigen::Vector3d::UnitZ()));
  }
  for (const std::string& order : kOrders) {
    SCOPED_TRACE(order);
    expect_round_trip(single_joint(rotations), {.rotation_order = order});
  }
}

TEST(WriteBvh, StaysPreciseNearGimbalLock) {
  // Cosines of the middle angle from 1e-1 to 1e-10: both sides of the threshold.
  std::vector<Eigen::Quaterniond> rotations;
  for (double distance_rad = 0.1; distance_rad > 1e-10; distance_rad *= 0.3) {
    rotations.push_back(turn(37.0, Eigen::Vector3d::UnitZ()) *
                        turn(90.0 - distance_rad * kRadian, Eigen::Vector3d::UnitX()) *
                        turn(-125.0, Eigen::Vector3d::UnitY()));
  }
  expect_round_trip(single_joint(std::move(rotations)), {});
}

TEST(WriteBvh, TurnsPastHalfAndWholeTurnsWithoutAJump) {
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < 400; ++f) {
    rotations.push_back(turn(5.0 * f, Eigen::Vector3d::UnitY()) *
                        turn(15.0, Eigen::Vector3d::UnitX()));
  }
  const motion::Clip clip = single_joint(std::move(rotations));
  expect_round_trip(clip, {.rotation_order = "YXZ"});
  const Eigen::Matrix3Xd angles = written_angles(clip, {.rotation_order = "YXZ"});
  EXPECT_LT(largest_step(angles), 5.0 + 1e-5);
  EXPECT_NEAR(angles(0, 399) - angles(0, 0), 5.0 * 399, 1e-5);
}

TEST(WriteBvh, WritesTheFormThatAllReadersAgreeOn) {
  std::vector<motion::Joint> joints(3);
  joints[0] = {"Hips", -1, {0.0, 0.9, 0.0}, std::nullopt};
  joints[1] = {"Spine", 0, {0.0, 0.25, 0.0}, std::nullopt};
  joints[2] = {"Leg", 0, {0.1, 0.0, 0.0}, Eigen::Vector3d(0.0, -0.4, 0.0)};
  Eigen::Matrix3Xd root(3, 2);
  root << 0, -1e-12, 0.95, 0.951234567, 0, 1.5;
  std::vector<Eigen::Quaterniond> rotations(6, Eigen::Quaterniond::Identity());
  rotations[4] = turn(90.0, Eigen::Vector3d::UnitZ());
  const motion::Clip clip(std::make_shared<const motion::Skeleton>(std::move(joints)), 40.0,
                          std::move(root), std::move(rotations));
  EXPECT_EQ(write_bvh(clip).text,
            "HIERARCHY\n"
            "ROOT Hips\n"
            "{\n"
            "\tOFFSET 0 0 0\n"
            "\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
            "\tJOINT Spine\n"
            "\t{\n"
            "\t\tOFFSET 0 25 0\n"
            "\t\tCHANNELS 3 Zrotation Xrotation Yrotation\n"
            "\t\tEnd Site\n"
            "\t\t{\n"
            "\t\t\tOFFSET 0 0 0\n"
            "\t\t}\n"
            "\t}\n"
            "\tJOINT Leg\n"
            "\t{\n"
            "\t\tOFFSET 10 0 0\n"
            "\t\tCHANNELS 3 Zrotation Xrotation Yrotation\n"
            "\t\tEnd Site\n"
            "\t\t{\n"
            "\t\t\tOFFSET 0 -40 0\n"
            "\t\t}\n"
            "\t}\n"
            "}\n"
            "MOTION\n"
            "Frames: 2\n"
            "Frame Time: 0.025\n"
            "0 95 0 0 0 0 0 0 0 0 0 0\n"
            "0 95.123457 150 0 0 0 90 0 0 0 0 0\n");
}

TEST(WriteBvh, GivesPositionsOnlyToJointsThatNeedThem) {
  Rng rng(6);
  const std::string text =
      write_bvh(random_tree({.joints = 5, .frames = 2, .translations = true}, rng)).text;
  int six = 0;
  for (std::size_t at = text.find("CHANNELS 6"); at != text.npos;
       at = text.find("CHANNELS 6", at + 1)) {
    ++six;
  }
  EXPECT_EQ(six, 3);  // joints 0, 2 and 4
}

TEST(Bvh, RoundTripKeepsSmallMovesOfJoints) {
  std::vector<motion::Joint> joints = {{"Hips", -1, Eigen::Vector3d::Zero(), std::nullopt},
                                       {"Spine", 0, {0.0, 0.25, 0.0}, std::nullopt}};
  Eigen::Matrix3Xd moves = Eigen::Matrix3Xd::Zero(3, 4);
  moves.col(1) << 0.0, 0.25, 0.0;
  moves.col(3) << 0.0, 0.250005, 0.0;
  const motion::Clip clip(std::make_shared<const motion::Skeleton>(std::move(joints)), 30.0,
                          Eigen::Matrix3Xd::Zero(3, 2),
                          std::vector<Eigen::Quaterniond>(4, Eigen::Quaterniond::Identity()),
                          std::move(moves));
  expect_round_trip(clip, {});
  EXPECT_TRUE(read_bvh(write_bvh(clip).text, "x", {.unit_m = 0.01}).clip.has_translations());
}

TEST(WriteBvh, GivesAJointWithPositionsNoOffsetToAddThemTo) {
  std::vector<motion::Joint> joints = {{"Root", -1, {0.0, 0.1, 0.0}, std::nullopt},
                                       {"Hips", 0, {0.0, 0.9, 0.0}, std::nullopt},
                                       {"Spine", 1, {0.0, 0.25, 0.0}, std::nullopt}};
  Eigen::Matrix3Xd moves = Eigen::Matrix3Xd::Zero(3, 6);
  moves.col(1) << 0.0, 0.9, 0.0;
  moves.col(4) << 0.0, 0.9, 0.06;
  moves.col(2) << 0.0, 0.25, 0.0;
  moves.col(5) << 0.0, 0.25, 0.0;  // stays
  const motion::Clip clip(std::make_shared<const motion::Skeleton>(std::move(joints)), 30.0,
                          Eigen::Matrix3Xd::Zero(3, 2),
                          std::vector<Eigen::Quaterniond>(6, Eigen::Quaterniond::Identity()),
                          std::move(moves));
  expect_round_trip(clip, {});
  const std::string text = write_bvh(clip).text;
  // three.js adds positions to the OFFSET, Blender and assimp put them in its place.
  EXPECT_THAT(text, HasSubstr("JOINT Hips\n\t{\n\t\tOFFSET 0 0 0\n\t\tCHANNELS 6 "));
  EXPECT_THAT(text, HasSubstr("JOINT Spine\n\t\t{\n\t\t\tOFFSET 0 25 0\n\t\t\tCHANNELS 3 "));
  // The skeleton is not lost: the first position is the rest offset.
  const motion::Clip again = read_bvh(text, "x", {.unit_m = 0.01}).clip;
  EXPECT_EQ(again.skeleton().joint(0).rest_offset, Eigen::Vector3d::Zero());
  EXPECT_EQ(again.skeleton().joint(1).rest_offset, Eigen::Vector3d(0.0, 0.9, 0.0));
  EXPECT_EQ(again.skeleton().joint(2).rest_offset, Eigen::Vector3d(0.0, 0.25, 0.0));
}

TEST(WriteBvh, MakesNamesPlainAndUniqueAndReportsIt) {
  std::vector<motion::Joint> joints;
  for (const std::string name :
       {"rig:Hips", "rig_Hips", "", "rig Hips", "rig_Hips", "rig_Hips_2", "t\xC3\xAAte", "joint"}) {
    joints.push_back(
        {name, std::ssize(joints) == 0 ? -1 : 0, Eigen::Vector3d::Zero(), std::nullopt});
  }
  const auto count = joints.size();
  const motion::Clip clip(std::make_shared<const motion::Skeleton>(std::move(joints)), 30.0,
                          Eigen::Matrix3Xd::Zero(3, 1),
                          std::vector<Eigen::Quaterniond>(count, Eigen::Quaterniond::Identity()));
  const BvhText bvh = write_bvh(clip);
  std::vector<std::string> names;
  const BvhFile again = read_bvh(bvh.text, "x");
  for (const motion::Joint& joint : again.clip.skeleton().joints()) names.push_back(joint.name);
  EXPECT_THAT(names, ElementsAre("rig_Hips_3", "rig_Hips", "joint_2", "rig_Hips_4", "rig_Hips_5",
                                 "rig_Hips_2", "t__te", "joint"));
  EXPECT_THAT(
      bvh.renames,
      ElementsAre("'rig:Hips' is written as 'rig_Hips_3'", "'' is written as 'joint_2'",
                  "'rig Hips' is written as 'rig_Hips_4'", "'rig_Hips' is written as 'rig_Hips_5'",
                  "'t\xC3\xAAte' is written as 't__te'"));
}

TEST(WriteBvh, RoundsToTheDecimalsAskedFor) {
  const motion::Clip clip = test::random_clip({.joints = 2, .frames = 3});
  std::istringstream rows(write_bvh(clip, {.decimals = 2}).text);
  std::string line;
  while (line != "Frame Time: 0.016666666666666666") ASSERT_TRUE(std::getline(rows, line));
  for (std::string value; rows >> value;) {
    const std::size_t point = value.find('.');
    if (point == value.npos) continue;
    EXPECT_LE(value.size() - point - 1, 2U) << value;
  }
}

TEST(WriteBvh, RefusesOptionsWithoutSense) {
  const motion::Clip clip = test::random_clip();
  const auto message = [&](const BvhWriteOptions& options) -> std::string {
    try {
      static_cast<void>(write_bvh(clip, options));
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kUsage);
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(message({.unit_m = -1.0}), HasSubstr("BvhWriteOptions::unit_m = -1.0"));
  EXPECT_EQ(message({.rotation_order = "XYX"}),
            "BvhWriteOptions::rotation_order = \"XYX\" (must be a permutation of \"XYZ\")");
  EXPECT_EQ(message({.decimals = 16}), "BvhWriteOptions::decimals = 16 (must be from 0 to 15)");
}

TEST(BvhStream, WritesInPiecesWhatIsWrittenWhole) {
  // Swings wide enough for angles to pass 180 degrees.
  const motion::Clip clip = test::random_clip({.frames = 50, .amplitude_rad = 3.0});
  for (const int cut : {1, 17, 49}) {
    BvhStream stream(clip.slice(0, 1));
    std::string text = stream.head(50);
    text += stream.rows(clip.slice(0, cut));
    text += stream.rows(clip.slice(cut, 50));
    EXPECT_EQ(text, write_bvh(clip).text) << cut;
  }
}

TEST(BvhStream, HeadHoldsTheFramesThatAreAnnounced) {
  const motion::Clip clip = test::random_clip();
  BvhStream stream(clip);
  EXPECT_THAT(stream.head(3000000000), HasSubstr("\nFrames: 3000000000\n"));
  EXPECT_THAT(stream.renames(), IsEmpty());
}

TEST(BvhStream, RefusesPiecesOfAnotherRigOrRate) {
  BvhStream stream(test::random_clip({.joints = 5}));
  EXPECT_THROW((void)stream.rows(test::random_clip({.joints = 4})), Error);
  EXPECT_THROW((void)stream.rows(test::random_clip({.frame_rate_hz = 30.0})), Error);
  EXPECT_THROW(BvhStream(test::random_clip(), {.decimals = 16}), Error);
}

}  // namespace
}  // namespace laban::io
