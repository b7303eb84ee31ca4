#include "laban/io/clip_file.h"

#include <filesystem>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"
#include "support/clips.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Failure {
  ErrorKind kind = ErrorKind::kInternal;
  std::string message;
};

template <typename Work>
Failure failure_of(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    return {error.kind(), error.what()};
  }
  return {ErrorKind::kInternal, "no error"};
}

/// A folder of its own for a test, empty at its beginning and removed at its end.
class ClipFileTest : public ::testing::Test {
 protected:
  ClipFileTest()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                (std::string("laban_clip_file_") +
                 ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~ClipFileTest() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_;
};

TEST_F(ClipFileTest, ReadsBackTheBvhItWrote) {
  const motion::Clip clip = test::random_clip();
  const std::filesystem::path path = folder_ / "walk.bvh";
  EXPECT_THAT(write_clip(path, clip), ElementsAre());
  const ClipFile file = read_clip(path, {.unit_m = 0.01});
  EXPECT_EQ(file.format, "bvh");
  EXPECT_FALSE(file.unit_guessed);
  EXPECT_EQ(file.clip.frame_rate_hz(), clip.frame_rate_hz());
  ASSERT_EQ(file.clip.frame_count(), clip.frame_count());
  EXPECT_THAT(file.clip.rotation(7, 2), test::IsNearRotation(clip.rotation(7, 2), 1e-5));
}

TEST_F(ClipFileTest, WritesInTheUnitAskedFor) {
  const motion::Clip clip = test::random_clip();
  write_clip(folder_ / "inches.bvh", clip, {.unit_m = 0.0254});
  const motion::Clip read = read_clip(folder_ / "inches.bvh", {.unit_m = 0.0254}).clip;
  EXPECT_NEAR(read.skeleton().joint(1).rest_offset.y(), 0.2, 1e-8);
}

TEST_F(ClipFileTest, WritesTheFormatOfTheEndingOrTheOneAskedFor) {
  const motion::Clip clip = test::random_clip();
  write_clip(folder_ / "a.GLB", clip);
  EXPECT_THAT(base::read_file(folder_ / "a.GLB"), StartsWith("glTF"));
  EXPECT_THAT(base::read_file(folder_ / "a.GLB"), HasSubstr("\"name\":\"a\""));
  write_clip(folder_ / "b.out", clip, {.format = "bvh"});
  EXPECT_THAT(base::read_file(folder_ / "b.out"), StartsWith("HIERARCHY"));
  const Failure failure = failure_of([&] { write_clip(folder_ / "c.fbx", clip); });
  EXPECT_EQ(failure.kind, ErrorKind::kUsage);
  EXPECT_THAT(failure.message,
              HasSubstr("c.fbx: clips are written as .bvh or .glb; end the name so "
                        "or give the format (--format)"));
  EXPECT_EQ(failure_of([&] { static_cast<void>(format_clip(clip, "obj")); }).message,
            "output format 'obj' is not written (bvh and glb are)");
}

TEST_F(ClipFileTest, OverwritesOnlyIfForced) {
  const motion::Clip clip = test::random_clip();
  const std::filesystem::path path = folder_ / "walk.bvh";
  base::write_file(path, "mine");
  EXPECT_EQ(failure_of([&] { write_clip(path, clip); }).kind, ErrorKind::kIo);
  EXPECT_EQ(base::read_file(path), "mine");
  write_clip(path, clip, {.force = true});
  EXPECT_THAT(base::read_file(path), StartsWith("HIERARCHY"));
}

TEST_F(ClipFileTest, GivesTheFilesRateAndUnitToTheReader) {
  const std::string text = format_clip(test::random_clip(), "bvh").bytes;
  const ClipFile file = parse_clip(text, "x.bvh", {.unit_m = 1.0, .frame_rate_hz = 12.0});
  EXPECT_EQ(file.unit_m, 1.0);
  EXPECT_EQ(file.clip.frame_rate_hz(), 12.0);
  EXPECT_NEAR(file.clip.skeleton().joint(1).rest_offset.y(), 20.0, 1e-6);
}

TEST(ParseClip, GoesByContentBeforeEnding) {
  const std::string bvh = format_clip(test::random_clip(), "bvh").bytes;
  for (const std::string name : {"-", "x.fbx", "x", "x.bvh"}) {
    SCOPED_TRACE(name);
    EXPECT_EQ(parse_clip(bvh, name).format, "bvh");
    EXPECT_EQ(parse_clip("\xEF\xBB\xBF \r\n" + bvh, name).format, "bvh");
  }
}

TEST(ParseClip, RefusesForeignFormatsByNameWithTheWayOut) {
  const auto message_of = [](const std::string& name, const std::string& bytes) {
    const Failure failure = failure_of([&] { static_cast<void>(parse_clip(bytes, name)); });
    EXPECT_EQ(failure.kind, ErrorKind::kFormat);
    return failure.message;
  };
  const std::string fbx =
      ": FBX is not read; import it into Blender (File, Import, FBX) and export glTF or BVH";
  EXPECT_EQ(message_of("x.dat", "Kaydara FBX Binary  "), "x.dat" + fbx);
  EXPECT_EQ(message_of("x.fbx", "; FBX 7.3.0 project file"), "x.fbx" + fbx);
  EXPECT_THAT(message_of("x.C3D", "\x02P"), HasSubstr("x.C3D: C3D holds markers and no skeleton"));
}

TEST(ParseClip, KnowsAcclaimFilesByTheirOpening) {
  for (const char* text : {"# AST/ASF file\n# ---\r\n:version 1.10\n", ":version 1.10\n"}) {
    EXPECT_EQ(failure_of([&] { static_cast<void>(parse_clip(text, "x")); }).message,
              "x:" + std::to_string(text[0] == '#' ? 4 : 2) +
                  ":1: there are no bones; a skeleton has :bonedata and :hierarchy");
  }
  for (const char* text : {"#!OML:ASF H:\\x.asf", "# by hand\n:FULLY-SPECIFIED"}) {
    EXPECT_THAT(failure_of([&] { static_cast<void>(parse_clip(text, "x")); }).message,
                HasSubstr("x: AMC motion needs its skeleton"));
  }
}

TEST(ParseClip, SaysWhatItReadsWhereTheFormatIsUnknown) {
  const Failure failure = failure_of([] { static_cast<void>(parse_clip("abc", "x.txt")); });
  EXPECT_EQ(failure.kind, ErrorKind::kFormat);
  EXPECT_EQ(
      failure.message,
      "x.txt: not a motion file that is known; BVH, which begins with HIERARCHY, glTF (.gltf, "
      ".glb) and ASF/AMC are read");
  const Failure forced =
      failure_of([] { static_cast<void>(parse_clip("abc", "-", {.input_format = "bvh"})); });
  EXPECT_EQ(forced.message, "-:1:1: a BVH file begins with HIERARCHY, found 'abc'");
  const Failure unknown =
      failure_of([] { static_cast<void>(parse_clip("abc", "-", {.input_format = "fbx"})); });
  EXPECT_EQ(unknown.kind, ErrorKind::kUsage);
}

TEST(ReadClip, SaysThatAFileIsMissing) {
  const Failure failure = failure_of([] { static_cast<void>(read_clip("no/such/file.bvh")); });
  EXPECT_EQ(failure.kind, ErrorKind::kIo);
  EXPECT_THAT(failure.message, HasSubstr("no/such/file.bvh"));
}

}  // namespace
}  // namespace laban::io
