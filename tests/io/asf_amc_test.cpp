#include "laban/io/asf_amc.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "laban/io/clip_file.h"
#include "laban/motion/forward_kinematics.h"
#include "support/clips.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Vector3d;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kUnitM = 0.0254 / 0.45;

std::string file_text(const std::string& name) {
  std::ifstream file(LABAN_SOURCE_DIR "/tests/io/" + name, std::ios::binary);
  EXPECT_TRUE(file) << name;
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string with_crlf(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '\n' ? std::string("\r\n") : std::string(1, c);
  return result;
}

AsfFile good_skeleton() {
  return read_asf(file_text("asf/good.asf"), "good.asf");
}

struct Failure {
  ErrorKind kind = ErrorKind::kInternal;
  std::string message = "no error";
};

template <typename Work>
Failure failure_of(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    return {error.kind(), error.what()};
  }
  return {};
}

std::string asf_error(std::string_view text) {
  const Failure failure = failure_of([&] { static_cast<void>(read_asf(text, "x.asf")); });
  EXPECT_EQ(failure.kind, ErrorKind::kFormat);
  return failure.message;
}

std::string amc_error(std::string_view text) {
  const AsfFile skeleton = good_skeleton();
  const Failure failure = failure_of([&] { static_cast<void>(read_amc(text, "x.amc", skeleton)); });
  EXPECT_EQ(failure.kind, ErrorKind::kFormat);
  return failure.message;
}

struct Case {
  std::string file;
  std::string message;  // after the file's name
};

const std::vector<Case> kBrokenSkeletons = {
    {"angle_turns", "7:3: the angle of :units must be deg or rad, found 'turns'"},
    {"beyond_1e30", "48:12: '5e30' is not a finite number up to 1e30; mend or remove the frame"},
    {"bone_cut", "44:3: this bone is never closed; an 'end' is missing"},
    {"bone_open", "42:3: a bone begins inside another; an 'end' before it is missing"},
    {"circle", "44:3: bone 'back' does not lead to the root; mend its lines of :hierarchy"},
    {"decimal_comma", "48:12: '5,0' has a decimal comma; write it with a point"},
    {"dof_twice", "50:12: 'tx' is given twice"},
    {"empty", "1:1: there are no bones; a skeleton has :bonedata and :hierarchy"},
    {"empty_name", "26:5: the bone has no name; write one after 'name'"},
    {"length_zero", "6:3: the length of :units must be greater than 0"},
    {"name_digit", "37:10: the name of a bone must not begin with a digit; rename it"},
    {"name_latin1", "37:10: the name of a bone must be of ASCII characters; rename it"},
    {"name_twice", "37:10: there is a bone 'lfemur' already; rename one"},
    {"nan", "47:17: 'nan' is not a finite number up to 1e30; mend or remove the frame"},
    {"negative_length", "48:5: the length of a bone must not be less than 0"},
    {"no_begin", "44:5: expected 'begin' of a bone, found 'id'"},
    {"no_bones", "16:1: there are no bones; a skeleton has :bonedata and :hierarchy"},
    {"no_direction", "44:3: bone 'back' has a length but no direction; add a direction line"},
    {"no_name", "24:3: the bone has no name; add a name line"},
    {"no_parent", "52:3: bone 'head' has no parent; add it to a line of :hierarchy"},
    {"no_section", "2:1: expected a section such as :units or :bonedata, found 'version'"},
    {"root_as_child", "65:15: root cannot be the child of a bone"},
    {"short_direction", "47:18: the line ends where a number is due"},
    {"two_parents", "65:15: bone 'lfemur' has a parent already"},
    {"unknown_child", "65:10: there is no bone 'hat' in the :bonedata before"},
    {"unknown_dof", "50:12: expected tx, ty, tz, rx, ry, rz or l, found 'rw'"},
    {"unknown_order", "49:18: expected an order of axes such as XYZ, found 'ZYZ'"},
    {"unknown_parent", "65:5: there is no bone 'bag' in the :bonedata before"},
    {"utf16", "1:1: the text is UTF-16; save it as UTF-8"},
    {"word_in_direction", "47:17: expected a number, found 'up'"},
};

const std::vector<Case> kBrokenMotions = {
    {"beyond_1e30", "12:14: '1e31' is not a finite number up to 1e30; mend or remove the frame"},
    {"bone_before_frame", "4:1: expected a frame's number before 'root'"},
    {"bone_missing",
     "10:1: this frame has no line for bone 'ltibia'; the file is cut short or belongs to another "
     "skeleton (--skeleton)"},
    {"bone_twice", "14:1: bone 'ltibia' stands twice in one frame"},
    {"cut",
     "10:1: this frame has no line for bone 'back'; the file is cut short or belongs to another "
     "skeleton (--skeleton)"},
    {"cut_in_row", "14:12: bone 'back' has 4 values in the skeleton, found 2"},
    {"decimal_comma", "12:14: '3,5' has a decimal comma; write it with a point"},
    {"empty", "1:1: there is no frame; the file has no motion"},
    {"frame_number_word", "10:1: expected a number, found '2nd'"},
    {"long_row", "12:18: bone 'lfemur' has 3 values in the skeleton, found 4"},
    {"nan", "12:12: 'nan' is not a finite number up to 1e30; mend or remove the frame"},
    {"no_frame", "4:1: there is no frame; the file has no motion"},
    {"rate_zero",
     "4:1: :SAMPLES-PER-SECOND must be greater than 0 and at most 1e6; give the frame rate (--fps) "
     "instead"},
    {"short_row", "12:13: bone 'lfemur' has 3 values in the skeleton, found 2"},
    {"unknown_bone",
     "13:1: the skeleton has no bone 'rtibia'; give the .asf that belongs to this motion "
     "(--skeleton)"},
    {"utf16", "1:1: the text is UTF-16; save it as UTF-8"},
    {"values_after_frame", "10:3: a frame's number stands on a line of its own"},
    {"values_of_bone_without_dof", "12:11: bone 'lhipjoint' has 0 values in the skeleton, found 1"},
    {"word_in_row", "12:12: expected a number, found 'six'"},
};

TEST(ReadAsf, NamesTheFaultThePlaceAndTheMend) {
  for (const Case& broken : kBrokenSkeletons) {
    SCOPED_TRACE(broken.file);
    const std::string text = file_text("asf/" + broken.file + ".asf");
    EXPECT_EQ(asf_error(text), "x.asf:" + broken.message);
    EXPECT_EQ(asf_error(with_crlf(text)), "x.asf:" + broken.message);
  }
}

TEST(ReadAmc, NamesTheFaultThePlaceAndTheMend) {
  for (const Case& broken : kBrokenMotions) {
    SCOPED_TRACE(broken.file);
    const std::string text = file_text("amc/" + broken.file + ".amc");
    EXPECT_EQ(amc_error(text), "x.amc:" + broken.message);
    EXPECT_EQ(amc_error(with_crlf(text)), "x.amc:" + broken.message);
  }
}

TEST(ReadAsf, ABoneIsAJointWhereItBegins) {
  const AsfFile file = good_skeleton();
  EXPECT_THAT(file.warnings, IsEmpty());
  EXPECT_NEAR(file.unit_m, 0.05644, 1e-5);
  EXPECT_FALSE(file.unit_guessed);
  EXPECT_TRUE(file.degrees);
  const motion::Skeleton& skeleton = *file.skeleton;
  ASSERT_EQ(skeleton.joint_count(), 6);
  const auto parent = [&](const char* name) {
    return skeleton.joint(skeleton.joint(*skeleton.find(name)).parent).name;
  };
  const auto offset = [&](const char* name) -> Vector3d {
    return skeleton.joint(*skeleton.find(name)).rest_offset / kUnitM;
  };
  EXPECT_EQ(skeleton.joint(0).name, "root");
  EXPECT_EQ(parent("ltibia"), "lfemur");
  EXPECT_EQ(parent("head"), "back");
  EXPECT_LT(offset("lhipjoint").norm(), 1e-12);
  EXPECT_LT(offset("back").norm(), 1e-12);
  EXPECT_LT((offset("lfemur") - Vector3d(1.2, -1.6, 0.0)).norm(), 1e-12);
  EXPECT_LT((offset("ltibia") - 7.0 * Vector3d(0.34202, -0.939693, 0.0)).norm(), 1e-5);
  EXPECT_LT(
      (*skeleton.joint(*skeleton.find("head")).end_site / kUnitM - Vector3d(0, 2.4, 1.8)).norm(),
      1e-12);
  EXPECT_FALSE(skeleton.joint(*skeleton.find("back")).end_site.has_value());
  const auto joint = static_cast<std::size_t>(*skeleton.find("back"));
  EXPECT_THAT(file.joints[joint].dofs,
              ElementsAre(AsfDof::kTx, AsfDof::kRz, AsfDof::kRy, AsfDof::kLength));
}

TEST(ReadAsf, TheRestClipStandsStill) {
  const motion::Clip clip = rest_clip(good_skeleton());
  EXPECT_EQ(clip.frame_count(), 1);
  EXPECT_THAT(clip.rotation(0, 2), test::IsNearRotation(Eigen::Quaterniond::Identity(), 1e-9));
}

TEST(ReadAsf, GuessesTheUnitWhereLengthIsLeftAtOne) {
  const std::string text = file_text("asf/good.asf");
  for (const auto& other :
       {replaced(text, "length 0.45", "length 1"), replaced(text, "  length 0.45\n", "")}) {
    const AsfFile file = read_asf(other, "x.asf");
    EXPECT_TRUE(file.unit_guessed);
    EXPECT_EQ(file.unit_m, 0.05644);  // 16 units from the hips to the ankle
  }
  EXPECT_EQ(read_asf(text, "x.asf", {.unit_m = 0.01}).unit_m, 0.01);
  EXPECT_EQ(failure_of([&] { static_cast<void>(read_asf(text, "x.asf", {.unit_m = -1.0})); }).kind,
            ErrorKind::kUsage);
}

TEST(ReadAsf, WarnsOfWhatItIgnores) {
  std::string text = file_text("asf/good.asf");
  text =
      replaced(text, "    dof rx\n    limits (-10", "    colour red\n    dof rx\n    limits (-10");
  text = replaced(text, ":hierarchy", ":skin skin.obj\n:hierarchy");
  EXPECT_THAT(read_asf(text, "x.asf").warnings,
              ElementsAre("x.asf:41:5: 'colour' of a bone is ignored",
                          "x.asf:61:1: section ':skin' is ignored"));
}

TEST(ReadAsf, RefusesMoreBonesThanItSays) {
  std::string text = ":bonedata\n";
  for (int i = 0; i <= kMaxAsfBones; ++i) {
    text += "begin\nname b" + std::to_string(i) + "\nend\n";
  }
  EXPECT_THAT(asf_error(text), HasSubstr("more than 10000 bones, the most that are read"));
}

TEST(ReadAsf, ReadsTheLongestChain) {
  std::string text = ":bonedata\n";
  std::string hierarchy = ":hierarchy\nroot b1\n";
  for (int i = 1; i <= kMaxAsfBones; ++i) {
    text += "begin\nname b" + std::to_string(i) + "\nend\n";
    if (i > 1) hierarchy += "b" + std::to_string(i - 1) + " b" + std::to_string(i) + "\n";
  }
  EXPECT_EQ(read_asf(text + hierarchy, "x.asf").skeleton->joint_count(), kMaxAsfBones + 1);
}

/// A rotation about fixed axes, first letter first, as a product of matrices.
Eigen::Matrix3d about(const std::string& order, const std::vector<double>& degrees) {
  Eigen::Matrix3d result = Eigen::Matrix3d::Identity();
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    const Vector3d axis = Vector3d::Unit(order[i] - 'x');
    result = Eigen::AngleAxisd(degrees[i] * kDegree, axis).toRotationMatrix() * result;
  }
  return result;
}

// Oracle: the format's own definition with matrices, M_model = M_parent C M C^-1, on the small
// body: positions in the file's unit.
struct Body {
  Vector3d root, ltibia, lankle, head, crown;
};

Body body_by_matrices(const std::vector<double>& v) {
  const Eigen::Matrix3d root = about("xyz", {v[3], v[4], v[5]});
  const Eigen::Matrix3d c = about("z", {20.0});
  const Vector3d leg = 7.0 * Vector3d(0.34202, -0.939693, 0.0).normalized();
  const Eigen::Matrix3d femur = root * c * about("xyz", {v[6], v[7], v[8]}) * c.transpose();
  const Eigen::Matrix3d tibia = femur * c * about("x", {v[9]}) * c.transpose();
  const Eigen::Matrix3d back_axes = about("zyx", {90.0, 30.0, 0.0});
  const Eigen::Matrix3d back =
      root * back_axes * about("zy", {v[11], v[12]}) * back_axes.transpose();
  const Eigen::Matrix3d head = back * about("x", {v[14]});
  Body body;
  body.root = {v[0], v[1], v[2]};
  body.ltibia = body.root + root * Vector3d(1.2, -1.6, 0.0) + femur * leg;
  body.lankle = body.ltibia + tibia * leg;
  const Vector3d back_begin = body.root + root * (back_axes * Vector3d(v[10], 0.0, 0.0));
  body.head = back_begin + back * Vector3d(0.0, 5.0 + v[13], 0.0);
  body.crown = body.head + head * Vector3d(0.0, 2.4, 1.8);
  return body;
}

TEST(ReadAmc, PlacesJointsAsTheFormatsMatricesDo) {
  const AsfFile skeleton = good_skeleton();
  base::Rng rng(5);
  std::vector<std::vector<double>> frames;
  std::string text = ":DEGREES\n";
  for (int f = 0; f < 20; ++f) {
    std::vector<double> v(15);
    for (double& value : v) value = rng.uniform(-170.0, 170.0);
    const auto row = [&](const char* name, std::size_t begin, std::size_t end) {
      text += name;
      for (std::size_t i = begin; i < end; ++i) text += " " + std::to_string(v[i]);
      text += "\n";
    };
    text += std::to_string(f + 1) + "\n";
    // Any order of bones, another one in each second frame.
    if (f % 2 == 0) row("head", 14, 15);
    row("root", 0, 6);
    row("lfemur", 6, 9);
    row("back", 10, 14);
    if (f % 2 == 1) row("head", 14, 15);
    row("ltibia", 9, 10);
    frames.push_back(v);
  }
  const AmcFile file = read_amc(text, "x.amc", skeleton);
  EXPECT_THAT(file.warnings, IsEmpty());
  ASSERT_EQ(file.clip.frame_count(), 20);
  ASSERT_TRUE(file.clip.has_translations());
  const auto index = [&](const char* name) { return *skeleton.skeleton->find(name); };
  for (int f = 0; f < 20; ++f) {
    SCOPED_TRACE(f);
    const Body body = body_by_matrices(frames[static_cast<std::size_t>(f)]);
    const motion::ModelPose pose = motion::forward_kinematics(file.clip, f);
    const auto end_of = [&](int joint) -> Vector3d {
      return pose.positions.col(joint) + pose.rotations[static_cast<std::size_t>(joint)] *
                                             *skeleton.skeleton->joint(joint).end_site;
    };
    // std::to_string rounds to 1e-6.
    const double tolerance = 1e-5 * kUnitM;
    EXPECT_LT((pose.positions.col(0) - kUnitM * body.root).norm(), tolerance);
    EXPECT_LT((pose.positions.col(index("ltibia")) - kUnitM * body.ltibia).norm(), tolerance);
    EXPECT_LT((end_of(index("ltibia")) - kUnitM * body.lankle).norm(), tolerance);
    EXPECT_LT((pose.positions.col(index("head")) - kUnitM * body.head).norm(), tolerance);
    EXPECT_LT((end_of(index("head")) - kUnitM * body.crown).norm(), tolerance);
  }
}

TEST(ReadAmc, ReadsRadiansAndTheSkeletonsOwnAngle) {
  const std::string text = file_text("amc/good.amc");
  const motion::Clip degrees = read_amc(text, "x.amc", good_skeleton()).clip;
  const auto shin = *degrees.skeleton().find("ltibia");
  EXPECT_NEAR(math::angle_between(degrees.rotation(0, shin), Eigen::Quaterniond::Identity()),
              40.0 * kDegree, 1e-12);
  const auto with_shin = [&](const std::string& head) {
    return replaced(replaced(text, ":DEGREES\n", head), "ltibia 40\n", "ltibia 0.5\n");
  };
  const motion::Clip radians = read_amc(with_shin(":RADIANS\n"), "x.amc", good_skeleton()).clip;
  EXPECT_NEAR(math::angle_between(radians.rotation(0, shin), Eigen::Quaterniond::Identity()), 0.5,
              1e-12);
  const AsfFile in_radians =
      read_asf(replaced(file_text("asf/good.asf"), "angle deg", "angle rad"), "x.asf");
  const motion::Clip own = read_amc(with_shin(""), "x.amc", in_radians).clip;
  EXPECT_NEAR(math::angle_between(own.rotation(0, shin), Eigen::Quaterniond::Identity()), 0.5,
              1e-12);
}

TEST(ReadAmc, ReadsTheSameMotionInEveryDress) {
  const AsfFile skeleton = good_skeleton();
  const std::string text = file_text("amc/good.amc");
  const motion::Clip plain = read_amc(text, "x.amc", skeleton).clip;
  const std::vector<std::string> dresses = {
      with_crlf(text),
      "\xEF\xBB\xBF" + text,
      "# a comment\n\n" + text,
      replaced(text, "ltibia 41", "\t ltibia  \t41.00 "),
      replaced(text, "head 16.5\n", "head 16.5"),
      replaced(text, "2\nroot", "\n2 \n# here\nlhipjoint\nroot")};
  for (const std::string& dress : dresses) {
    SCOPED_TRACE(dress);
    const AmcFile file = read_amc(dress, "x.amc", skeleton);
    EXPECT_THAT(file.warnings, IsEmpty());
    ASSERT_EQ(file.clip.frame_count(), 2);
    EXPECT_EQ(file.clip.root_positions(), plain.root_positions());
    for (int j = 0; j < plain.joint_count(); ++j) {
      EXPECT_THAT(file.clip.rotation(1, j), test::IsNearRotation(plain.rotation(1, j), 1e-9));
    }
  }
}

TEST(ReadAmc, WarnsOnceOfFramesThatDoNotCountUp) {
  const std::string text = file_text("amc/good.amc");
  const AmcFile gap = read_amc(replaced(text, "\n2\n", "\n5\n"), "x.amc", good_skeleton());
  EXPECT_EQ(gap.clip.frame_count(), 2);
  EXPECT_THAT(gap.warnings,
              ElementsAre("x.amc:10:1: frame 5 where 2 is expected; frames are read one after the "
                          "other as they stand"));
  const AmcFile late = read_amc(replaced(replaced(text, "\n1\n", "\n0\n"), "\n2\n", "\n9\n"),
                                "x.amc", good_skeleton());
  EXPECT_THAT(late.warnings, ElementsAre(HasSubstr("x.amc:4:1: frame 0 where 1 is expected")));
}

TEST(ReadAmc, TakesTheRateFromTheCallerThenTheFileThenCustom) {
  const std::string text = file_text("amc/good.amc");
  const AsfFile skeleton = good_skeleton();
  const AmcFile guessed = read_amc(text, "x.amc", skeleton);
  EXPECT_TRUE(guessed.frame_rate_guessed);
  EXPECT_EQ(guessed.clip.frame_rate_hz(), 120.0);
  const std::string rated = replaced(text, ":DEGREES", ":DEGREES\n:SAMPLES-PER-SECOND 60");
  const AmcFile told = read_amc(rated, "x.amc", skeleton);
  EXPECT_FALSE(told.frame_rate_guessed);
  EXPECT_EQ(told.clip.frame_rate_hz(), 60.0);
  EXPECT_EQ(read_amc(rated, "x.amc", skeleton, {.frame_rate_hz = 30.0}).clip.frame_rate_hz(), 30.0);
  EXPECT_EQ(failure_of([&] {
              static_cast<void>(read_amc(text, "x.amc", skeleton, {.frame_rate_hz = 0.0}));
            }).kind,
            ErrorKind::kUsage);
}

TEST(ReadAmc, RefusesBonesWithoutDofThatWouldFillMemory) {
  std::string bones = ":root\norder rx\n:bonedata\n";
  std::string hierarchy = ":hierarchy\nroot";
  for (int i = 0; i < 2000; ++i) {
    const std::string name = "b" + std::to_string(i);
    bones += "begin\nname " + name + "\nend\n";
    hierarchy += " " + name;
  }
  const AsfFile skeleton = read_asf(bones + hierarchy, "x.asf");
  std::string text;
  for (int f = 1; f <= 1000; ++f) text += std::to_string(f) + "\nroot 1\n";
  const Failure failure = failure_of([&] { static_cast<void>(read_amc(text, "x.amc", skeleton)); });
  EXPECT_THAT(failure.message,
              HasSubstr("x.amc:1:1: 1000 frames of 2001 bones, most without dof, are more than is "
                        "read from a file of this size"));
}

/// A folder of its own for a test, removed at its end.
class AmcSkeletonTest : public ::testing::Test {
 protected:
  AmcSkeletonTest()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                (std::string("laban_amc_") +
                 ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~AmcSkeletonTest() override { std::filesystem::remove_all(folder_); }

  void put(const std::string& name, const std::string& text) const {
    base::write_file(folder_ / name, text);
  }
  /// A skeleton that can be told by its unit.
  [[nodiscard]] static std::string skeleton_of_unit(const char* length) {
    return replaced(file_text("asf/good.asf"), "0.45", length);
  }
  [[nodiscard]] static double unit_of(const char* length) { return 0.0254 / std::stod(length); }

  const std::filesystem::path folder_;
  const std::string amc_ = file_text("amc/good.amc");
};

TEST_F(AmcSkeletonTest, IsTheOneOfTheSameStemElseOfTheLongestElseTheOnlyOne) {
  put("HDM_bd_walk_001.amc", amc_);
  put("other.ASF", skeleton_of_unit("0.5"));
  const std::filesystem::path amc = folder_ / "HDM_bd_walk_001.amc";
  EXPECT_NEAR(read_clip(amc).unit_m, unit_of("0.5"), 1e-12);
  put("HDM.asf", skeleton_of_unit("0.6"));
  EXPECT_NEAR(read_clip(amc).unit_m, unit_of("0.6"), 1e-12);
  put("hdm_BD.asf", skeleton_of_unit("0.7"));
  EXPECT_NEAR(read_clip(amc).unit_m, unit_of("0.7"), 1e-12);
  put("HDM_bd_walk_001.asf", skeleton_of_unit("0.8"));
  EXPECT_NEAR(read_clip(amc).unit_m, unit_of("0.8"), 1e-12);
  EXPECT_NEAR(read_clip(amc, {.skeleton = folder_ / "other.ASF"}).unit_m, unit_of("0.5"), 1e-12);
}

TEST_F(AmcSkeletonTest, SaysTheWayOutWhereThereIsNone) {
  put("walk.amc", amc_);
  const auto failure = [&](const ReadOptions& options = {}) {
    return failure_of([&] { static_cast<void>(read_clip(folder_ / "walk.amc", options)); });
  };
  EXPECT_EQ(failure().kind, ErrorKind::kIo);
  EXPECT_EQ(failure().message, (folder_ / "walk.amc").string() +
                                   ": AMC motion needs its skeleton, but " + folder_.string() +
                                   " has no .asf file; name the skeleton (--skeleton FILE.asf)");
  put("a.asf", skeleton_of_unit("0.5"));
  put("b.asf", skeleton_of_unit("0.5"));
  EXPECT_THAT(
      failure().message,
      HasSubstr("has several .asf files and none is named as it begins; name the skeleton"));
  EXPECT_THAT(failure({.skeleton = folder_ / "c.asf"}).message, HasSubstr("c.asf"));
  const Failure no_folder = failure_of([&] { static_cast<void>(parse_clip(amc_, "stdin")); });
  EXPECT_EQ(no_folder.kind, ErrorKind::kUsage);
  EXPECT_EQ(no_folder.message,
            "stdin: AMC motion needs its skeleton; name it (--skeleton FILE.asf)");
}

TEST_F(AmcSkeletonTest, AloneIsReadAsOneFrameAtRest) {
  put("a.asf", file_text("asf/good.asf"));
  const ClipFile file = read_clip(folder_ / "a.asf");
  EXPECT_EQ(file.format, "asf");
  EXPECT_EQ(file.clip.frame_count(), 1);
  EXPECT_TRUE(file.frame_rate_guessed);
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("a.asf:1:1: a skeleton without motion")));
}

}  // namespace
}  // namespace laban::io
