#include "laban/io/gltf.h"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>

#include <nlohmann/json.hpp>

#include "laban/base/error.h"
#include "laban/io/clip_file.h"
#include "laban/motion/forward_kinematics.h"
#include "support/clips.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

namespace fs = std::filesystem;

const fs::path kCorpus = fs::path(LABAN_SOURCE_DIR) / "tests/io/gltf";

std::string corpus_bytes(const std::string& name) {
  std::ifstream file(kCorpus / name, std::ios::binary);
  EXPECT_TRUE(file.good()) << name;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

GltfFile read_corpus(const std::string& name, GltfReadOptions options = {}) {
  options.folder = kCorpus;
  return read_gltf(corpus_bytes(name), name, options);
}

Eigen::Quaterniond turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis));
}

/// Whether two clips show the same motion of the same skeleton, float32 apart.
void expect_same(const motion::Clip& clip, const motion::Clip& expected, double meters = 1e-6,
                 double degrees = 1e-4) {
  ASSERT_EQ(clip.frame_count(), expected.frame_count());
  ASSERT_EQ(clip.joint_count(), expected.joint_count());
  EXPECT_EQ(clip.frame_rate_hz(), expected.frame_rate_hz());
  EXPECT_EQ(clip.has_translations(), expected.has_translations());
  for (int j = 0; j < clip.joint_count(); ++j) {
    const motion::Joint& joint = clip.skeleton().joint(j);
    EXPECT_EQ(joint.name, expected.skeleton().joint(j).name);
    EXPECT_EQ(joint.parent, expected.skeleton().joint(j).parent);
    EXPECT_LT((joint.rest_offset - expected.skeleton().joint(j).rest_offset).norm(), meters);
    EXPECT_EQ(joint.end_site.has_value(), expected.skeleton().joint(j).end_site.has_value());
    for (int f = 0; f < clip.frame_count(); ++f) {
      ASSERT_THAT(clip.rotation(f, j), test::IsNearRotation(expected.rotation(f, j), degrees));
      ASSERT_LT((clip.translation(f, j) - expected.translation(f, j)).norm(), meters);
    }
  }
}

TEST(ReadGltf, ReadsHierarchyNamesAndKeys) {
  for (const std::string name : {"minimal.gltf", "minimal.glb", "external.gltf"}) {
    SCOPED_TRACE(name);
    const GltfFile file = read_corpus(name);
    EXPECT_THAT(file.warnings, IsEmpty());
    EXPECT_THAT(file.animations, ElementsAre("walk"));
    const motion::Clip& clip = file.clip;
    ASSERT_EQ(clip.joint_count(), 2);
    ASSERT_EQ(clip.frame_count(), 3);
    EXPECT_EQ(clip.frame_rate_hz(), 30.0);
    EXPECT_EQ(clip.skeleton().joint(0).name, "Hips");
    EXPECT_EQ(clip.skeleton().joint(1).name, "Spine");
    EXPECT_FALSE(clip.has_translations());
    EXPECT_LT((clip.skeleton().joint(1).rest_offset - Eigen::Vector3d(0.0, 0.5, 0.0)).norm(), 1e-9);
    EXPECT_LT((clip.root_positions().col(2) - Eigen::Vector3d(0.0, 1.0, 0.2)).norm(), 1e-6);
    EXPECT_THAT(clip.rotation(1, 0),
                test::IsNearRotation(turn(10.0, Eigen::Vector3d::UnitY()), 1e-4));
    EXPECT_THAT(clip.rotation(2, 1),
                test::IsNearRotation(turn(10.0, Eigen::Vector3d::UnitZ()), 1e-4));
  }
}

TEST(ReadGltf, HoldsStepKeysUntilTheNext) {
  const motion::Clip clip = read_corpus("step.gltf", {.frame_rate_hz = 30.0}).clip;
  ASSERT_EQ(clip.frame_count(), 7);
  const double expected[] = {0, 0, 0, 1, 1, 1, 2};
  for (int f = 0; f < 7; ++f) EXPECT_EQ(clip.root_positions()(0, f), expected[f]);
  EXPECT_THAT(clip.rotation(5, 1),
              test::IsNearRotation(turn(20.0, Eigen::Vector3d::UnitZ()), 1e-4));
}

TEST(ReadGltf, FollowsCubicSplines) {
  const motion::Clip clip = read_corpus("cubic_spline.gltf", {.frame_rate_hz = 4.0}).clip;
  ASSERT_EQ(clip.frame_count(), 5);
  // p(t) = 3 (t^3 - 2 t^2 + t) + 3 t^2 - 2 t^3 = t^3 - 3 t^2 + 3 t.
  for (int f = 0; f < 5; ++f) {
    const double t = f / 4.0;
    EXPECT_NEAR(clip.root_positions()(0, f), t * t * t - 3 * t * t + 3 * t, 1e-6);
  }
  // Half way between two keys without tangents lies their mean, normalised: half the turn.
  EXPECT_THAT(clip.rotation(2, 1),
              test::IsNearRotation(turn(45.0, Eigen::Vector3d::UnitZ()), 1e-4));
}

TEST(ReadGltf, FillsSparseAccessorsWithZeros) {
  const motion::Clip clip = read_corpus("sparse.gltf").clip;
  EXPECT_EQ(clip.root_positions().row(1), Eigen::RowVector3d(0.0, 2.0, 0.0));
}

TEST(ReadGltf, DecodesNormalisedRotations) {
  for (const std::string name : {"normalized_int8.gltf", "normalized_int16.gltf"}) {
    SCOPED_TRACE(name);
    const motion::Clip clip = read_corpus(name).clip;
    EXPECT_THAT(clip.rotation(0, 0), test::IsNearRotation(Eigen::Quaterniond::Identity(), 1e-9));
    EXPECT_THAT(clip.rotation(1, 0),
                test::IsNearRotation(turn(180.0, Eigen::Vector3d::UnitY()), 1e-9));
  }
}

TEST(ReadGltf, FindsTheRateOfUnevenKeysAndInterpolatesBetweenThem) {
  const motion::Clip clip = read_corpus("uneven_times.gltf").clip;
  EXPECT_EQ(clip.frame_rate_hz(), 30.0);
  ASSERT_EQ(clip.frame_count(), 10);
  const double expected[] = {0, 1.0 / 3, 2.0 / 3, 1, 2, 2.2, 2.4, 2.6, 2.8, 3};
  for (int f = 0; f < 10; ++f) EXPECT_NEAR(clip.root_positions()(0, f), expected[f], 1e-6);
}

TEST(ReadGltf, SnapsTheRateOfKeysButKeepsOneThatIsMeant) {
  for (const double rate : {29.97, 30.0, 59.94, 60.0, 119.88, 120.0, 33.3}) {
    SCOPED_TRACE(rate);
    const motion::Clip clip =
        test::random_clip({.joints = 2, .frames = 400, .frame_rate_hz = rate});
    std::string glb = write_glb(clip);
    glb.replace(glb.find("frame_rate_hz"), 13, "frame_rate_no");
    const motion::Clip again = read_gltf(glb, "x.glb").clip;
    EXPECT_NEAR(again.frame_rate_hz(), rate, 1e-4);
    EXPECT_EQ(again.frame_count(), 400);
  }
}

TEST(ReadGltf, ChoosesTheAnimationByNameOrIndex) {
  EXPECT_THAT(read_corpus("two_animations.gltf").warnings,
              ElementsAre("two_animations.gltf: /animations: the first of 2 is read (--animation "
                          "chooses): 0 'walk', 1 'run'"));
  for (const std::string which : {"run", "1"}) {
    const GltfFile file = read_corpus("two_animations.gltf", {.animation = which});
    EXPECT_THAT(file.warnings, IsEmpty());
    EXPECT_EQ(file.animation, 1U);
    EXPECT_THAT(file.clip.rotation(2, 0),
                test::IsNearRotation(turn(20.0, Eigen::Vector3d::UnitY()), 1e-4));
  }
  try {
    read_corpus("two_animations.gltf", {.animation = "jump"});
    FAIL() << "read";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    EXPECT_STREQ(error.what(),
                 "two_animations.gltf: there is no animation 'jump'; there are 0 'walk', 1 'run'");
  }
}

TEST(ReadGltf, StandsAnArmatureInCentimetresUpright) {
  const GltfFile file = read_corpus("armature.gltf");
  EXPECT_THAT(file.warnings, IsEmpty());
  const motion::Clip& clip = file.clip;
  ASSERT_EQ(clip.joint_count(), 2);
  EXPECT_EQ(clip.skeleton().joint(0).name, "Hips");
  EXPECT_FALSE(clip.has_translations());
  // Hips 100 cm and spine 150 cm up the armature's Z axis.
  EXPECT_LT((clip.root_positions().col(0) - Eigen::Vector3d(0.0, 1.0, 0.0)).norm(), 1e-6);
  EXPECT_LT((clip.skeleton().joint(1).rest_offset - Eigen::Vector3d(0.0, 0.5, 0.0)).norm(), 1e-6);
  EXPECT_THAT(clip.rotation(0, 0), test::IsNearRotation(Eigen::Quaterniond::Identity(), 1e-4));
  EXPECT_THAT(clip.rotation(2, 0),
              test::IsNearRotation(turn(90.0, Eigen::Vector3d::UnitY()), 1e-4));
  const motion::Clip doubled = read_corpus("armature.gltf", {.unit_m = 2.0}).clip;
  EXPECT_NEAR(doubled.root_positions()(1, 0), 2.0, 1e-6);
}

/// A body of a hip with two legs and a spine, some of them moving within their parents.
motion::Clip body(bool translations) {
  const motion::Clip source = test::random_clip({.joints = 6, .frames = 30});
  std::vector<motion::Joint> joints = {
      {"Root", -1, {0.0, 0.0, 0.0}, std::nullopt},
      {"Hips", 0, {0.3, 0.9, 0.1}, std::nullopt},
      {"LeftLeg", 1, {0.1, 0.0, 0.0}, Eigen::Vector3d(0.0, -0.8, 0.0)},
      {"RightLeg", 1, {-0.1, 0.0, 0.0}, Eigen::Vector3d(0.0, -0.8, 0.1)},
      {"Spine", 1, {0.0, 0.4, 0.05}, std::nullopt},
      {"Head", 4, {0.0, 0.0, 0.0}, std::nullopt}};
  std::vector<Eigen::Quaterniond> rotations;
  Eigen::Matrix3Xd moves(3, 6 * 30);
  for (int f = 0; f < 30; ++f) {
    for (int j = 0; j < 6; ++j) {
      rotations.push_back(source.rotation(f, j));
      Eigen::Vector3d place = joints[static_cast<std::size_t>(j)].rest_offset;
      if (j == 0) place = source.root_positions().col(f);
      if (j == 1) place.x() += 0.1 * f;
      moves.col(6 * f + j) = place;
    }
  }
  return {std::make_shared<const motion::Skeleton>(std::move(joints)), 60.0,
          source.root_positions(), std::move(rotations), translations ? moves : Eigen::Matrix3Xd()};
}

TEST(ReadGltf, GetsOurOwnFilesBackWithinFloat32) {
  for (const bool translations : {false, true}) {
    for (const bool bone_mesh : {false, true}) {
      const motion::Clip clip = body(translations);
      const GltfFile file = read_gltf(write_glb(clip, {.bone_mesh = bone_mesh}), "x.glb");
      EXPECT_THAT(file.warnings, IsEmpty());
      expect_same(file.clip, clip);
    }
  }
  const motion::Clip one_frame = body(false).slice(0, 1);
  expect_same(read_gltf(write_glb(one_frame), "x.glb").clip, one_frame);
  // Minutes in, float32 times are 1e-5 s off: keys are hit all the same.
  const motion::Clip clip = test::random_clip({.joints = 2, .frames = 60'000});
  const motion::Clip again = read_gltf(write_glb(clip), "x.glb").clip;
  ASSERT_EQ(again.frame_count(), 60'000);
  EXPECT_THAT(again.rotation(59'999, 1), test::IsNearRotation(clip.rotation(59'999, 1), 1e-4));
  EXPECT_THAT(again.rotation(40'001, 1), test::IsNearRotation(clip.rotation(40'001, 1), 1e-4));
}

// ---- writing back ----------------------------------------------------------------------------

json asset_of(const std::string& glb) {
  std::uint32_t size = 0;
  std::memcpy(&size, glb.data() + 12, sizeof size);
  return json::parse(glb.substr(20, size));
}

TEST(WriteGlbOfAnAsset, PlaysTheClipOnTheFilesOwnNodes) {
  for (const std::string name : {"minimal.gltf", "armature.gltf", "external.gltf"}) {
    SCOPED_TRACE(name);
    const GltfFile file = read_corpus(name);
    // Another motion: the skeleton's, made of random turns and a longer way.
    const motion::Clip random = test::random_clip({.joints = 2, .frames = 50});
    std::vector<Eigen::Quaterniond> rotations;
    for (int f = 0; f < 50; ++f) {
      for (int j = 0; j < 2; ++j) rotations.push_back(random.rotation(f, j));
    }
    const motion::Clip clip(file.clip.shared_skeleton(), 60.0, random.root_positions(),
                            std::move(rotations));
    const std::string glb = write_glb(*file.asset, clip, {}, {.animation_name = "new"});
    const GltfFile again = read_gltf(glb, "again.glb");
    EXPECT_THAT(again.animations, ElementsAre("new", file.animations[0]));
    expect_same(again.clip, clip, 2e-6);
    const GltfFile old = read_gltf(glb, "again.glb", {.animation = file.animations[0]});
    expect_same(old.clip, file.clip, 2e-6);
  }
}

TEST(WriteGlbOfAnAsset, KeepsAllThatIsNotMotion) {
  const GltfFile file = read_corpus("armature.gltf");
  const json before = json::parse(corpus_bytes("armature.gltf"));
  const json after = asset_of(write_glb(*file.asset, file.clip));
  EXPECT_EQ(after["meshes"], before["meshes"]);
  EXPECT_EQ(after["materials"], before["materials"]);
  EXPECT_EQ(after["skins"][0]["joints"], before["skins"][0]["joints"]);
  EXPECT_EQ(after["nodes"][0]["extras"], before["nodes"][0]["extras"]);
  EXPECT_EQ(after["nodes"].size(), before["nodes"].size());
  EXPECT_EQ(after["animations"][1], before["animations"][0]);
  EXPECT_EQ(after["buffers"].size(), 1U);
  EXPECT_FALSE(after["buffers"][0].contains("uri"));
  for (std::size_t a = 0; a < before["accessors"].size(); ++a) {
    EXPECT_EQ(after["accessors"][a]["count"], before["accessors"][a]["count"]);
    EXPECT_EQ(after["accessors"][a]["bufferView"], before["accessors"][a]["bufferView"]);
  }
}

TEST(WriteGlbOfAnAsset, WarpsMorphTargetsAndOtherNodesWithTheClip) {
  const GltfFile file = read_corpus("armature.gltf");
  // Played backwards at a quarter of the speed.
  std::vector<double> source_frames;
  std::vector<Eigen::Quaterniond> rotations(9 * 2, Eigen::Quaterniond::Identity());
  for (int f = 0; f < 9; ++f) source_frames.push_back(2.0 - f / 4.0);
  const motion::Clip clip(file.clip.shared_skeleton(), 30.0,
                          Eigen::Vector3d(0.0, 1.0, 0.0).replicate(1, 9), std::move(rotations));
  const std::string glb = write_glb(*file.asset, clip, source_frames);
  const json asset = asset_of(glb);
  const json& animation = asset["animations"][0];
  std::uint32_t json_size = 0;
  std::memcpy(&json_size, glb.data() + 12, 4);
  const char* binary = glb.data() + 28 + json_size;
  int found = 0;
  for (const json& channel : animation["channels"]) {
    const int node = channel["target"]["node"];
    const std::string path = channel["target"]["path"];
    if (node != 3 && node != 4) continue;
    ++found;
    const json& sampler = animation["samplers"][channel["sampler"].get<std::size_t>()];
    const json& output = asset["accessors"][sampler["output"].get<std::size_t>()];
    const json& view = asset["bufferViews"][output["bufferView"].get<std::size_t>()];
    const std::size_t width = path == "weights" ? 1 : 3;
    ASSERT_EQ(output["count"], 9);
    const char* values =
        binary + view["byteOffset"].get<std::size_t>() + output.value("byteOffset", std::size_t{0});
    for (std::size_t f = 0; f < 9; ++f) {
      // Weights rise by 0.5 a source frame, the prop by 1 m.
      float value = 0.0F;
      std::memcpy(&value, values + 4 * (f * width + (width == 3 ? 1 : 0)), 4);
      EXPECT_NEAR(value, (2.0 - static_cast<double>(f) / 4.0) * (width == 3 ? 1.0 : 0.5), 1e-6);
    }
  }
  EXPECT_EQ(found, 2);
}

TEST(WriteGlbOfAnAsset, MendsWeightsAndLiftsTheSkinnedMeshToTheRoot) {
  const GltfFile file = read_corpus("armature.gltf");
  const json asset = asset_of(write_glb(*file.asset, file.clip));
  EXPECT_EQ(asset["nodes"][0]["children"], json::array({1}));
  EXPECT_EQ(asset["scenes"][0]["nodes"], json::array({0, 4, 3}));
  // Where it was bound is kept: the rest pose comes back the same.
  const GltfFile again = read_gltf(write_glb(*file.asset, file.clip), "x.glb");
  EXPECT_LT((again.clip.skeleton().joint(1).rest_offset - Eigen::Vector3d(0.0, 0.5, 0.0)).norm(),
            1e-6);
}

TEST(WriteGlbOfAnAsset, RefusesWhatDoesNotFit) {
  const GltfFile file = read_corpus("minimal.gltf");
  const auto message = [&](const motion::Clip& clip,
                           std::span<const double> frames) -> std::string {
    try {
      static_cast<void>(write_glb(*file.asset, clip, frames));
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kUsage);
      return error.what();
    }
    return "written";
  };
  const double two[] = {0.0, 1.0};
  const double nan[] = {0.0, std::nan(""), 1.0};
  EXPECT_EQ(message(test::random_clip(), {}), "write_glb: the clip has 5 joints, the glTF file 2");
  EXPECT_EQ(message(file.clip, two), "write_glb: 2 source frames for 3 frames");
  EXPECT_EQ(message(file.clip, nan), "write_glb: source frame 1 is not finite");
}

TEST(WriteGlbOfAnAsset, GivesARealCharacterBack) {
  const char* const data = std::getenv("LABAN_DATA");
  if (data == nullptr) GTEST_SKIP() << "LABAN_DATA is not set: no character to read";
  const GltfReadOptions options{.folder = fs::path(data) / "gltf"};
  std::ifstream in(*options.folder / "cesium_man.gltf", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const GltfFile file = read_gltf(bytes, "cesium_man.gltf", options);
  EXPECT_THAT(file.warnings, IsEmpty());
  EXPECT_EQ(file.clip.joint_count(), 19);
  EXPECT_EQ(file.clip.frame_rate_hz(), 24.0);
  const Eigen::Matrix3Xd positions = motion::joint_positions(file.clip);
  // It stands on the floor, 1.2 m to the base of its head.
  EXPECT_NEAR(positions.row(1).maxCoeff(), 1.17, 0.05);
  EXPECT_NEAR(positions.row(1).minCoeff(), 0.02, 0.05);
  const std::string glb = write_glb(*file.asset, file.clip);
  const json before = json::parse(bytes);
  const json after = asset_of(glb);
  for (const char* part : {"meshes", "materials", "textures", "samplers"}) {
    EXPECT_EQ(after[part], before[part]) << part;
  }
  EXPECT_EQ(after["images"][0]["mimeType"], "image/jpeg");
  EXPECT_EQ(after["animations"].size(), 2U);
  // Its scales, animated by 1e-6, are not quite uniform.
  expect_same(read_gltf(glb, "again.glb").clip, file.clip, 1e-5, 1e-3);
}

// ---- compact ---------------------------------------------------------------------------------

std::size_t animation_bytes(const motion::Clip& clip, const GlbWriteOptions& options) {
  const json asset = asset_of(write_glb(clip, options));
  std::size_t bytes = 0;
  // All but the inverse bind matrices, the first accessor: its view holds nothing else.
  for (std::size_t v = 1; v < asset["bufferViews"].size(); ++v) {
    bytes += asset["bufferViews"][v]["byteLength"].get<std::size_t>();
  }
  return bytes;
}

TEST(CompactGlb, StaysWithinTheTolerancesInLessThanHalfTheBytes) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const double degrees : {1.0, 0.1, 0.01, 0.001}) {
      SCOPED_TRACE(::testing::Message() << "seed " << seed << ", " << degrees << " degrees");
      const motion::Clip clip =
          test::random_clip({.joints = 8, .frames = 240, .seed = seed, .amplitude_rad = 1.5});
      GlbWriteOptions options{.bone_mesh = false, .compact = GlbCompactOptions{}};
      options.compact->rotation_tolerance_rad = degrees * std::numbers::pi / 180.0;
      const motion::Clip again = read_gltf(write_glb(clip, options), "x.glb").clip;
      ASSERT_EQ(again.frame_count(), clip.frame_count());
      double worst = 0.0;
      for (int f = 0; f < clip.frame_count(); ++f) {
        for (int j = 0; j < clip.joint_count(); ++j) {
          worst = std::max(worst, math::angle_between(clip.rotation(f, j), again.rotation(f, j)));
        }
        EXPECT_LT((clip.root_positions().col(f) - again.root_positions().col(f)).norm(),
                  5e-4 + 1e-6);
      }
      EXPECT_LE(worst, options.compact->rotation_tolerance_rad * (1.0 + 1e-6));
      if (degrees >= 0.1) {
        EXPECT_LT(animation_bytes(clip, options), animation_bytes(clip, {.bone_mesh = false}) / 2);
      }
    }
  }
}

TEST(CompactGlb, HalvesThePhrases) {
  int seen = 0;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(fs::path(LABAN_SOURCE_DIR) / "data/phrase")) {
    if (entry.path().extension() != ".bvh" || ++seen % 10 != 0) continue;
    SCOPED_TRACE(entry.path().filename().string());
    const motion::Clip clip = read_clip(entry.path()).clip;
    const GlbWriteOptions options{.bone_mesh = false, .compact = GlbCompactOptions{}};
    EXPECT_LT(animation_bytes(clip, options), animation_bytes(clip, {.bone_mesh = false}) / 2);
    const motion::Clip again = read_gltf(write_glb(clip, options), "x.glb").clip;
    for (int f = 0; f < clip.frame_count(); ++f) {
      for (int j = 0; j < clip.joint_count(); ++j) {
        ASSERT_THAT(again.rotation(f, j), test::IsNearRotation(clip.rotation(f, j), 0.1 + 1e-6));
      }
    }
  }
  EXPECT_GE(seen, 10);
}

TEST(CompactGlb, KeepsOneKeyOfAJointThatNeverMovesAndTheLengthOfTheClip) {
  const motion::Clip clip(std::make_shared<const motion::Skeleton>(std::vector<motion::Joint>{
                              {"a", -1, {}, {}}, {"b", 0, {0.0, 1.0, 0.0}, {}}}),
                          30.0, Eigen::Matrix3Xd::Zero(3, 90),
                          std::vector<Eigen::Quaterniond>(180, Eigen::Quaterniond::Identity()));
  const GlbWriteOptions options{.bone_mesh = false, .compact = GlbCompactOptions{}};
  EXPECT_LT(animation_bytes(clip, options), 60U);
  EXPECT_EQ(read_gltf(write_glb(clip, options), "x.glb").clip.frame_count(), 90);
}

TEST(CompactGlb, RefusesTolerancesOfNothing) {
  GlbWriteOptions options{.compact = GlbCompactOptions{}};
  options.compact->rotation_tolerance_rad = 0.0;
  try {
    static_cast<void>(write_glb(test::random_clip(), options));
    FAIL() << "written";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    EXPECT_THAT(error.what(), HasSubstr("rotation_tolerance_rad = 0.000000 (must be > 0)"));
  }
}

// ---- files that can hurt ---------------------------------------------------------------------

struct Broken {
  const char* name;
  const char* message;  // after the file's name
};

const Broken kBroken[] = {
    {"accessor_beyond_view.gltf",
     ": /accessors/1: 4 elements from byte 0 need 64 bytes, the buffer view has 48"},
    {"accessor_index.gltf", ": /animations/0/samplers/0/output: 9, there are 4 accessors"},
    {"accessor_offset.gltf",
     ": /accessors/1: 3 elements from byte 40 need 48 bytes, the buffer view has 8"},
    {"base64.gltf", ": /buffers/0/uri: it is not a data URI in base64"},
    {"buffer_index.gltf", ": /bufferViews/1/buffer: 1, there is 1 buffer"},
    {"buffer_no_uri.gltf",
     ": /buffers/0: it has no uri; only the first buffer of a .glb may have none"},
    {"buffer_short.gltf",
     ": /buffers/0/byteLength: 100000, the buffer has 144 bytes; the file is cut short or damaged"},
    {"child_index.gltf", ": /nodes/0/children/0: 9, there are 2 nodes"},
    {"child_negative.gltf", ": /nodes/0/children/0: it is not a whole number of 0 or more"},
    {"component_type.gltf", ": /accessors/1/componentType: 5130 is no component type"},
    {"count_fraction.gltf", ": /accessors/0/count: it is not a whole number of 0 or more"},
    {"count_huge.gltf",
     ": /accessors/1/count: 4000000000 elements are more than is read from a file of this size"},
    {"count_zero.gltf", ": /accessors/0/count: 0; an accessor has one element or more"},
    {"cut.gltf",
     ":2:12: the JSON is malformed: syntax error while parsing value - unexpected end of input; "
     "expected '[', '{', or a literal"},
    {"cycle.gltf", ": /nodes/0: it is its own ancestor"},
    {"deep.gltf", ": the JSON is nested more than 64 deep, the most that is read"},
    {"deep_unclosed.gltf", ": the JSON is nested more than 64 deep, the most that is read"},
    {"empty.gltf",
     ":1:1: the JSON is malformed: syntax error while parsing value - unexpected end of input; "
     "expected '[', '{', or a literal"},
    {"glb_chunk.glb", ": chunk 0 says 100000 bytes, there are 1340"},
    {"glb_cut.glb", ": the header says 1360 bytes, the file has 1320; it is cut short"},
    {"glb_header.glb", ": the file ends within the header of a GLB"},
    {"glb_no_json.glb", ": the first chunk is not JSON"},
    {"glb_version.glb", ": GLB version 1 is not read (2 is); save it as glTF 2.0"},
    {"interpolation.gltf",
     ": /animations/0/samplers/0/interpolation: 'SMOOTH' is not one of LINEAR, STEP, CUBICSPLINE"},
    {"list.gltf", ": a glTF file is one JSON object"},
    {"matrix.gltf", ": /nodes/0/matrix: it is not a list of 16 numbers below 1e30"},
    {"no_animation.gltf",
     ": /animations: there are none, so there is no motion to read; export the character with its "
     "animation"},
    {"no_channel.gltf",
     ": no node is animated and there is no skin, so there is no motion to read"},
    {"no_target.gltf", ": /animations/0/channels/0/target: it is not an object with a path"},
    {"no_version.gltf", ": /asset/version: there is none; a glTF file says \"2.0\" there"},
    {"node_is_a_number.gltf", ": /nodes/1: it is not an object"},
    {"node_rotation.gltf",
     ": /nodes/0/rotation: it has no length; a rotation is a unit quaternion"},
    {"nodes_are_text.gltf", ": /nodes: it is not a list"},
    {"not_utf8.gltf",
     ":1:45: the JSON is malformed: syntax error while parsing value - invalid string: ill-formed "
     "UTF-8 byte; last read: '\"\xEA\"'"},
    {"number_too_large.gltf",
     ":1:44: the JSON is malformed: number overflow parsing "
     "'1e999'"},
    {"output_count.gltf", ": /animations/0/samplers/0/output: 2 values for 3 expected"},
    {"own_child.gltf", ": /nodes/1/children/0: node 1 is a child of node 0 already"},
    {"rotation_not_finite.gltf", ": /accessors/1: element 1 is not a number below 1e30"},
    {"rotation_of_no_length.gltf",
     ": /accessors/1: element 1 has no length; a rotation is a unit quaternion"},
    {"sampler_index.gltf", ": /animations/0/channels/0/sampler: 9, there are 3 samplers"},
    {"skin_index.gltf", ": /nodes/1/skin: 0, there are 0 skins"},
    {"skin_joint.gltf", ": /skins/0/joints/1: 5, there are 2 nodes"},
    {"skin_joint_twice.gltf", ": /skins/0/joints: one of them is there twice"},
    {"skin_matrices.gltf",
     ": /skins/0/inverseBindMatrices: it is not a 4 x 4 matrix of floats for each of 2 joints"},
    {"skin_no_joints.gltf", ": /skins/0/joints: there are none"},
    {"sparse_beyond.gltf",
     ": /accessors/2/sparse/indices: index 0 is 15624; they must rise and stay below 3"},
    {"sparse_count.gltf", ": /accessors/2/sparse/count: 9 of 3 elements"},
    {"sparse_falls.gltf",
     ": /accessors/2/sparse/indices: index 1 is 0; they must rise and stay below 3"},
    {"sparse_no_values.gltf", ": /accessors/2/sparse: it has no values"},
    {"sparse_type.gltf",
     ": /accessors/2/sparse/indices/componentType: 5126 is not an unsigned type"},
    {"stride.gltf",
     ": /bufferViews/1/byteStride: 12 for elements of 16 bytes (a multiple of 4, at most 252)"},
    {"target_index.gltf", ": /animations/0/channels/0/target/node: 9, there are 2 nodes"},
    {"time_not_finite.gltf", ": /accessors/0: element 1 is not a number below 1e30"},
    {"times_are_whole.gltf", ": /animations/0/samplers/0/input: key times are float scalars"},
    {"times_fall.gltf",
     ": /accessors/0: key time 1 is -1.000000 s, the one before is 0.000000 s; they must rise"},
    {"too_long.gltf",
     ": /animations/0: 1000000000.000000 s at 30.000000 Hz with 2 nodes are more than is read from "
     "a file of this size; give a lower rate (--fps)"},
    {"two_parents.gltf", ": /nodes/2/children/0: node 1 is a child of node 0 already"},
    {"type.gltf",
     ": /animations/0/samplers/0/output: values of rotation are VEC4 of floats or of normalized "
     "int8 or int16"},
    {"uri_absolute.gltf",
     ": /buffers/0/uri: '/etc/passwd' is an absolute path; only files beside this one are read"},
    {"uri_backslash.gltf",
     ": /buffers/0/uri: '..\\a.bin' holds a backslash; only files beside this one are read"},
    {"uri_directory.gltf", ": /buffers/0/uri: '.' is not a regular file"},
    {"uri_empty.gltf", ": /buffers/0/uri: '' is empty; only files beside this one are read"},
    {"uri_http.gltf",
     ": /buffers/0/uri: 'http://example.org/a.bin' names a scheme or a drive; only files beside "
     "this one are read"},
    {"uri_inner_parent.gltf",
     ": /buffers/0/uri: 'a/../../clip.bin' leads out of the file's folder; only files beside this "
     "one are read"},
    {"uri_missing.gltf",
     ": /buffers/0/uri: 'nowhere.bin' cannot be read: No such file or directory"},
    {"uri_parent.gltf",
     ": /buffers/0/uri: '../bvh/empty.bvh' leads out of the file's folder; only files beside this "
     "one are read"},
    {"uri_parent_percent.gltf",
     ": /buffers/0/uri: '%2e%2e/bvh/empty.bvh' leads out of the file's folder; only files beside "
     "this one are read"},
    {"uri_percent.gltf", ": /buffers/0/uri: 'a%2' has a '%' without two hexadecimal digits"},
    {"uri_scheme.gltf",
     ": /buffers/0/uri: 'file:///etc/passwd' names a scheme or a drive; only files beside this one "
     "are read"},
    {"uri_zero.gltf",
     ": /buffers/0/uri: 'a%00.bin' holds a zero byte; only files beside this one are read"},
    {"version.gltf", ": /asset/version: '1.0' is not read (2.0 is); save it as glTF 2.0"},
    {"view_beyond_buffer.gltf", ": /bufferViews/3: bytes 96 to 1096, the buffer has 144"},
    {"view_index.gltf", ": /accessors/1/bufferView: 7, there are 4 buffer views"},
    {"view_offset.gltf",
     ": /bufferViews/3: bytes 9007199254740992 to 9007199254741040, the buffer has 144"},
    {"zeros_huge.gltf",
     ": /accessors/0/count: 4000000000 elements are more than is read from a file of this size"}};

TEST(ReadGltf, RefusesEachBrokenFileByPlaceAndFault) {
  for (const Broken& broken : kBroken) {
    const std::string name = std::string("broken_") + broken.name;
    SCOPED_TRACE(name);
    try {
      static_cast<void>(read_corpus(name));
      ADD_FAILURE() << "read";
    } catch (const Error& error) {
      EXPECT_EQ(error.what(), name + broken.message);
    }
  }
}

TEST(ReadGltf, HasAnExpectationForEachBrokenFile) {
  std::size_t files = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(kCorpus)) {
    if (entry.path().filename().string().starts_with("broken_")) ++files;
  }
  EXPECT_EQ(files, std::size(kBroken));
}

TEST(ReadGltf, FollowsNoLinkOutOfItsFolder) {
  const fs::path folder = fs::path(::testing::TempDir()) / "laban_gltf_links";
  fs::remove_all(folder);
  fs::create_directories(folder / "inside");
  fs::copy_file(kCorpus / "external.gltf", folder / "inside/external.gltf");
  fs::copy_file(kCorpus / "minimal data.bin", folder / "outside.bin");
  fs::create_symlink("../outside.bin", folder / "inside/minimal data.bin");
  try {
    static_cast<void>(read_clip(folder / "inside/external.gltf"));
    ADD_FAILURE() << "read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/buffers/0/uri: 'minimal%20data.bin' is a link that leads "
                                        "out of the file's folder"));
  }
  // A link within the folder is as good as a file.
  fs::rename(folder / "outside.bin", folder / "inside/outside.bin");
  fs::remove(folder / "inside/minimal data.bin");
  fs::create_symlink("outside.bin", folder / "inside/minimal data.bin");
  EXPECT_EQ(read_clip(folder / "inside/external.gltf").clip.frame_count(), 3);
  fs::remove_all(folder);
}

TEST(ReadGltf, FindsNoCompanionWithoutAFolder) {
  try {
    static_cast<void>(read_gltf(corpus_bytes("external.gltf"), "stdin"));
    FAIL() << "read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("there is no folder to find it in"));
  }
}

TEST(ReadGltf, TakesAFlatFileOfManyNodesButNoDenseOne) {
  std::string dense = R"({"asset":{"version":"2.0"},"animations":[{}],"nodes":[{})";
  for (int n = 0; n < 40'000; ++n) dense += ",{}";
  try {
    static_cast<void>(read_gltf(dense + "]}", "dense.gltf"));
    FAIL() << "read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/nodes: 40001 of them are more than is read from a file "
                                        "of this size"));
  }
  const motion::Clip many = test::random_clip({.joints = 20'000, .frames = 1});
  EXPECT_EQ(read_gltf(write_glb(many, {.bone_mesh = false}), "many.glb").clip.joint_count(),
            20'000);
}

TEST(ReadGltf, RefusesOptionsThatMeanNothing) {
  const GltfReadOptions options{.unit_m = 0.0, .frame_rate_hz = -1.0};
  EXPECT_THAT(
      options.problems(),
      ElementsAre("GltfReadOptions::unit_m = 0.000000 (must be > 0 and at most 1e6)",
                  "GltfReadOptions::frame_rate_hz = -1.000000 (must be > 0 and at most 1e6)"));
}

}  // namespace
}  // namespace laban::io
