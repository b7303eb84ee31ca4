#include "laban/io/glb.h"

#include <array>
#include <cstring>

#include <nlohmann/json.hpp>

#include "laban/base/error.h"
#include "laban/motion/forward_kinematics.h"
#include "support/clips.h"

namespace laban::io {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

/// A GLB taken apart by the letter of the specification, independently of the writer.
struct Glb {
  json asset;
  std::string binary;

  [[nodiscard]] const json& accessor(const json& index) const {
    return asset["accessors"][index.get<std::size_t>()];
  }

  /// Values of an accessor of floats or unsigned shorts, one element a column.
  [[nodiscard]] Eigen::MatrixXd values(const json& index) const {
    const json& info = accessor(index);
    const json& view = asset["bufferViews"][info["bufferView"].get<std::size_t>()];
    const std::string type = info["type"];
    const Eigen::Index rows = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
    const bool is_float = info["componentType"] == 5126;
    const std::size_t size = is_float ? 4 : 2;
    const std::size_t offset = info.value("byteOffset", std::size_t{0});
    const std::size_t begin = view["byteOffset"].get<std::size_t>() + offset;
    EXPECT_EQ(begin % size, 0U);
    Eigen::MatrixXd result(rows, info["count"].get<Eigen::Index>());
    EXPECT_GE(view["byteLength"].get<std::size_t>(),
              offset + static_cast<std::size_t>(result.size()) * size);
    for (Eigen::Index i = 0; i < result.size(); ++i) {
      const char* const at = binary.data() + begin + static_cast<std::size_t>(i) * size;
      float real = 0.0F;
      std::uint16_t whole = 0;
      std::memcpy(is_float ? static_cast<void*>(&real) : &whole, at, size);
      result.data()[i] = is_float ? static_cast<double>(real) : whole;
    }
    return result;
  }

  /// Output of the channel that drives `path` of a node, one key a column; no columns if none does.
  [[nodiscard]] Eigen::MatrixXd keys(int node, const std::string& path) const {
    const json& animation = asset["animations"][0];
    for (const json& channel : animation["channels"]) {
      if (channel["target"]["node"] != node || channel["target"]["path"] != path) continue;
      const json& sampler = animation["samplers"][channel["sampler"].get<std::size_t>()];
      EXPECT_EQ(sampler["interpolation"], "LINEAR");
      return values(sampler["output"]);
    }
    return {};
  }
};

std::uint32_t word_at(const std::string& bytes, std::size_t offset) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, sizeof word);
  return word;
}

Glb parse_glb(const std::string& bytes) {
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word_at(bytes, 4), 2U);
  EXPECT_EQ(word_at(bytes, 8), bytes.size());
  const std::size_t text_size = word_at(bytes, 12);
  EXPECT_EQ(text_size % 4, 0U);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  const std::size_t binary_size = word_at(bytes, 20 + text_size);
  EXPECT_EQ(binary_size % 4, 0U);
  EXPECT_EQ(bytes.substr(24 + text_size, 4), std::string("BIN\0", 4));
  EXPECT_EQ(28 + text_size + binary_size, bytes.size());
  Glb glb{json::parse(bytes.substr(20, text_size)), bytes.substr(28 + text_size)};
  EXPECT_LE(glb.asset["buffers"][0]["byteLength"].get<std::size_t>(), binary_size);
  return glb;
}

/// Model-from-node transforms at a key of the animation, as a glTF player computes them.
std::vector<Eigen::Affine3d> play(const Glb& glb, Eigen::Index key) {
  const json& nodes = glb.asset["nodes"];
  std::vector<Eigen::Affine3d> model_from_node(nodes.size(), Eigen::Affine3d::Identity());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const int node = static_cast<int>(n);
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < 3 && nodes[n].contains("translation"); ++i) {
      translation[static_cast<Eigen::Index>(i)] = nodes[n]["translation"][i];
    }
    const Eigen::MatrixXd translations = glb.keys(node, "translation");
    if (translations.cols() > 0) translation = translations.col(key);
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
    const Eigen::MatrixXd rotations = glb.keys(node, "rotation");
    if (rotations.cols() > 0) rotation.coeffs() = rotations.col(key);
    model_from_node[n] = model_from_node[n] * Eigen::Translation3d(translation) * rotation;
    // Parents come first here, so this node's transform is complete.
    for (const json& child : nodes[n].value("children", json::array())) {
      EXPECT_GT(child.get<std::size_t>(), n);
      model_from_node[child.get<std::size_t>()] = model_from_node[n];
    }
  }
  return model_from_node;
}

/// A body of a hip with two legs and a spine; the last joint repeats its parent's place.
motion::Clip body(bool translations) {
  std::vector<motion::Joint> joints = {
      {"Root", -1, {0.0, 0.0, 0.0}, std::nullopt},
      {"Hips", 0, {0.3, 0.9, 0.1}, std::nullopt},
      {"LeftLeg", 1, {0.1, 0.0, 0.0}, Eigen::Vector3d(0.0, -0.8, 0.0)},
      {"RightLeg", 1, {-0.1, 0.0, 0.0}, Eigen::Vector3d(0.0, -0.8, 0.1)},
      {"Spine", 1, {0.0, 0.4, 0.05}, std::nullopt},
      {"Head", 4, {0.0, 0.0, 0.0}, std::nullopt}};
  const motion::Clip source = test::random_clip({.joints = 6, .frames = 30});
  std::vector<Eigen::Quaterniond> rotations;
  Eigen::Matrix3Xd moves(3, 6 * source.frame_count());
  for (int f = 0; f < source.frame_count(); ++f) {
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

TEST(WriteGlb, PlaysJointsToWhereForwardKinematicsPutsThem) {
  for (const bool translations : {false, true}) {
    SCOPED_TRACE(translations);
    const motion::Clip clip = body(translations);
    const Glb glb = parse_glb(write_glb(clip));
    for (const int f : {0, 11, 29}) {
      const std::vector<Eigen::Affine3d> nodes = play(glb, f);
      const motion::ModelPose pose = motion::forward_kinematics(clip, f);
      for (int j = 0; j < clip.joint_count(); ++j) {
        const Eigen::Affine3d& node = nodes[static_cast<std::size_t>(j)];
        // float32 of a few metres and of unit quaternions.
        EXPECT_LT((node.translation() - pose.positions.col(j)).norm(), 2e-6);
        EXPECT_THAT(Eigen::Quaterniond(node.rotation()),
                    test::IsNearRotation(pose.rotations[static_cast<std::size_t>(j)], 1e-4));
      }
    }
  }
}

TEST(WriteGlb, KeysAreAtTheFramesTimesWithBounds) {
  const motion::Clip clip = body(false);
  const Glb glb = parse_glb(write_glb(clip));
  const json& animation = glb.asset["animations"][0];
  EXPECT_EQ(animation["extras"]["frame_rate_hz"], 60.0);
  for (const json& sampler : animation["samplers"]) {
    const Eigen::MatrixXd times = glb.values(sampler["input"]);
    ASSERT_EQ(times.cols(), 30);
    for (Eigen::Index f = 0; f < 30; ++f)
      EXPECT_NEAR(times(0, f), static_cast<double>(f) / 60, 1e-7);
    EXPECT_EQ(glb.accessor(sampler["input"])["min"][0], times(0, 0));
    EXPECT_EQ(glb.accessor(sampler["input"])["max"][0], times(0, 29));
  }
}

TEST(WriteGlb, KeepsNeighbouringQuaternionsInOneHemisphere) {
  // Three whole turns: the quaternion of the short way would change sign.
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < 60; ++f) {
    rotations.emplace_back(Eigen::AngleAxisd(0.3 * f, Eigen::Vector3d::UnitY()));
    if (f % 3 == 0) rotations.back().coeffs() *= -1.0;
  }
  const motion::Clip clip(std::make_shared<const motion::Skeleton>(std::vector<motion::Joint>(1)),
                          60.0, Eigen::Matrix3Xd::Zero(3, 60), std::move(rotations));
  const Eigen::MatrixXd keys = parse_glb(write_glb(clip)).keys(0, "rotation");
  ASSERT_EQ(keys.cols(), 60);
  for (Eigen::Index f = 1; f < keys.cols(); ++f) {
    EXPECT_GT(keys.col(f).dot(keys.col(f - 1)), 0.0);
    EXPECT_NEAR(keys.col(f).norm(), 1.0, 1e-6);
  }
}

TEST(WriteGlb, BindsEveryJointWhereItRests) {
  const motion::Clip clip = body(true);
  const Glb glb = parse_glb(write_glb(clip));
  const json& skin = glb.asset["skins"][0];
  EXPECT_EQ(skin["skeleton"], 0);
  EXPECT_EQ(skin["joints"], json::array({0, 1, 2, 3, 4, 5}));
  const Eigen::MatrixXd matrices = glb.values(skin["inverseBindMatrices"]);
  const Eigen::Matrix3Xd rest = motion::rest_pose(clip.skeleton()).positions;
  ASSERT_EQ(matrices.cols(), 6);
  for (Eigen::Index j = 0; j < 6; ++j) {
    const Eigen::Matrix4d inverse_bind = matrices.col(j).reshaped(4, 4);
    EXPECT_LT((inverse_bind * rest.col(j).homogeneous() - Eigen::Vector4d::UnitW()).norm(), 1e-6);
  }
}

/// Vertices of the bone mesh at a key, skinned as a player does it; 3 x V.
Eigen::Matrix3Xd skinned_vertices(const Glb& glb, Eigen::Index key) {
  const json& attributes = glb.asset["meshes"][0]["primitives"][0]["attributes"];
  const Eigen::MatrixXd rest = glb.values(attributes["POSITION"]);
  const Eigen::MatrixXd joints = glb.values(attributes["JOINTS_0"]);
  const Eigen::MatrixXd weights = glb.values(attributes["WEIGHTS_0"]);
  const Eigen::MatrixXd binds = glb.values(glb.asset["skins"][0]["inverseBindMatrices"]);
  const std::vector<Eigen::Affine3d> nodes = play(glb, key);
  Eigen::Matrix3Xd vertices = Eigen::Matrix3Xd::Zero(3, rest.cols());
  for (Eigen::Index v = 0; v < rest.cols(); ++v) {
    EXPECT_EQ(weights.col(v).sum(), 1.0);
    for (Eigen::Index k = 0; k < 4; ++k) {
      const auto joint = static_cast<std::size_t>(joints(k, v));
      const Eigen::Matrix4d bind = binds.col(static_cast<Eigen::Index>(joint)).reshaped(4, 4);
      const Eigen::Vector4d moved = nodes[joint].matrix() * (bind * rest.col(v).homogeneous());
      vertices.col(v) += weights(k, v) * moved.head<3>();
    }
  }
  return vertices;
}

double distance_to(const Eigen::Matrix3Xd& vertices, const Eigen::Vector3d& point) {
  return (vertices.colwise() - point).colwise().norm().minCoeff();
}

TEST(WriteGlb, DrawsABoneFromEachJointToItsChildrenAndEndSite) {
  const motion::Clip clip = body(false);
  const Glb glb = parse_glb(write_glb(clip));
  // Hips, two legs with an end site each, spine; none to the head, which lies on the spine joint.
  const Eigen::Matrix3Xd vertices = skinned_vertices(glb, 17);
  EXPECT_EQ(vertices.cols(), 6 * 24);
  const motion::ModelPose pose = motion::forward_kinematics(clip, 17);
  for (int j = 0; j < clip.joint_count(); ++j) {
    EXPECT_LT(distance_to(vertices, pose.positions.col(j)), 2e-6);
    const motion::Joint& joint = clip.skeleton().joint(j);
    if (!joint.end_site) continue;
    const Eigen::Vector3d end =
        pose.positions.col(j) + pose.rotations[static_cast<std::size_t>(j)] * *joint.end_site;
    EXPECT_LT(distance_to(vertices, end), 2e-6);
  }
}

TEST(WriteGlb, DrawsNoBoneToAJointThatTravels) {
  const motion::Clip clip = body(true);
  const Eigen::Matrix3Xd vertices = skinned_vertices(parse_glb(write_glb(clip)), 29);
  EXPECT_EQ(vertices.cols(), 5 * 24);
  const motion::ModelPose pose = motion::forward_kinematics(clip, 29);
  EXPECT_GT(distance_to(vertices, pose.positions.col(0)), 0.1);
  EXPECT_LT(distance_to(vertices, pose.positions.col(1)), 2e-6);
}

TEST(WriteGlb, FacesOfBonesLookOutwards) {
  const Glb glb = parse_glb(write_glb(body(false)));
  const json& attributes = glb.asset["meshes"][0]["primitives"][0]["attributes"];
  const Eigen::MatrixXd positions = glb.values(attributes["POSITION"]);
  const Eigen::MatrixXd normals = glb.values(attributes["NORMAL"]);
  EXPECT_EQ(glb.accessor(attributes["POSITION"])["min"][1], positions.row(1).minCoeff());
  EXPECT_EQ(glb.accessor(attributes["POSITION"])["max"][0], positions.row(0).maxCoeff());
  for (Eigen::Index bone = 0; bone < positions.cols(); bone += 24) {
    const Eigen::Vector3d center = positions.middleCols<24>(bone).rowwise().mean();
    for (Eigen::Index v = bone; v < bone + 24; v += 3) {
      const Eigen::Vector3d a = positions.col(v);
      const Eigen::Vector3d b = positions.col(v + 1);
      const Eigen::Vector3d c = positions.col(v + 2);
      const Eigen::Vector3d front = (b - a).cross(c - a).normalized();
      EXPECT_GT(front.dot(a - center), 0.0);
      for (Eigen::Index i = v; i < v + 3; ++i) EXPECT_LT((normals.col(i) - front).norm(), 1e-4);
    }
  }
}

TEST(WriteGlb, MarksASkeletonWithoutBones) {
  const motion::Clip clip(std::make_shared<const motion::Skeleton>(std::vector<motion::Joint>(1)),
                          60.0, Eigen::Matrix3Xd::Zero(3, 1),
                          std::vector<Eigen::Quaterniond>(1, Eigen::Quaterniond::Identity()));
  EXPECT_EQ(skinned_vertices(parse_glb(write_glb(clip)), 0).cols(), 24);
}

TEST(WriteGlb, LeavesTheMeshOutIfAsked) {
  const Glb glb = parse_glb(write_glb(body(false), {.bone_mesh = false, .animation_name = "walk"}));
  EXPECT_FALSE(glb.asset.contains("meshes"));
  EXPECT_EQ(glb.asset["nodes"].size(), 6U);
  EXPECT_TRUE(glb.asset.contains("skins"));
  EXPECT_EQ(glb.asset["animations"][0]["name"], "walk");
}

TEST(WriteGlb, KeepsEndSitesAndNamesAndSaysWhoWroteIt) {
  const Glb glb = parse_glb(write_glb(body(false)));
  EXPECT_EQ(glb.asset["asset"]["generator"], "laban");
  EXPECT_EQ(glb.asset["nodes"][4]["name"], "Spine");
  EXPECT_FLOAT_EQ(glb.asset["nodes"][2]["extras"]["end_site"][1].get<float>(), -0.8F);
  EXPECT_EQ(glb.asset["scenes"][0]["nodes"], json::array({0, 6}));  // the root and the mesh
}

TEST(WriteGlb, ReplacesWhatIsNotUtf8InNames) {
  std::vector<motion::Joint> joints(1);
  joints[0].name = "t\xEAte \"x\"";
  const motion::Clip clip(std::make_shared<const motion::Skeleton>(std::move(joints)), 60.0,
                          Eigen::Matrix3Xd::Zero(3, 1),
                          std::vector<Eigen::Quaterniond>(1, Eigen::Quaterniond::Identity()));
  EXPECT_EQ(parse_glb(write_glb(clip)).asset["nodes"][0]["name"], "t\xEF\xBF\xBDte \"x\"");
}

TEST(WriteGlb, RefusesFramesThatFloat32TimesCannotTellApart) {
  const motion::Clip clip(std::make_shared<const motion::Skeleton>(std::vector<motion::Joint>(1)),
                          1e50, Eigen::Matrix3Xd::Zero(3, 2),
                          std::vector<Eigen::Quaterniond>(2, Eigen::Quaterniond::Identity()));
  try {
    static_cast<void>(write_glb(clip));
    FAIL() << "written";
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kData);
    EXPECT_THAT(error.what(), HasSubstr("GLB: frame 1 has no float32 time of its own"));
  }
}

}  // namespace
}  // namespace laban::io
