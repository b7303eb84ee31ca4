#include "laban/io/glb.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include <nlohmann/json.hpp>

#include "laban/base/error.h"
#include "laban/motion/forward_kinematics.h"

#include "io/travel.h"

namespace laban::io {
namespace {

using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "GLB buffers are little-endian");

// Numbers of the glTF 2.0 specification.
constexpr int kFloat = 5126;
constexpr int kUnsignedShort = 5123;
constexpr int kArrayBuffer = 34962;
constexpr std::uint32_t kGlbMagic = 0x46546C67;   // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr std::uint32_t kBinChunk = 0x004E4942;   // "BIN\0"

// Nothing shorter is drawn: a bone of no length has no direction.
constexpr double kShortestBoneM = 1e-3;
// Height of the mark drawn where a skeleton has no bone at all, so that it can be seen.
constexpr double kMarkM = 0.1;

/// The binary chunk and the JSON that describes it, grown together.
class Buffer {
 public:
  /// Appends an accessor of 3-, 4- or 16-vectors, one a column, or of scalars; returns its index.
  int add_floats(const Eigen::Ref<const Eigen::MatrixXf>& values, bool with_bounds,
                 std::optional<int> target = std::nullopt) {
    const std::size_t begin = bytes_.size();
    for (Eigen::Index c = 0; c < values.cols(); ++c) append(values.col(c).data(), values.rows());
    json accessor = {
        {"componentType", kFloat}, {"count", values.cols()}, {"type", type_name(values.rows())}};
    if (with_bounds) {
      const Eigen::VectorXf least = values.rowwise().minCoeff();
      const Eigen::VectorXf most = values.rowwise().maxCoeff();
      accessor["min"] = std::vector<float>(least.begin(), least.end());
      accessor["max"] = std::vector<float>(most.begin(), most.end());
    }
    return add_accessor(std::move(accessor), begin, target);
  }

  /// Appends an accessor of 4-vectors of unsigned shorts.
  int add_joint_indices(const std::vector<std::array<std::uint16_t, 4>>& values) {
    const std::size_t begin = bytes_.size();
    for (const auto& value : values) append(value.data(), value.size());
    return add_accessor(
        {{"componentType", kUnsignedShort}, {"count", values.size()}, {"type", "VEC4"}}, begin,
        kArrayBuffer);
  }

  [[nodiscard]] const std::string& bytes() const noexcept { return bytes_; }

  /// Puts accessors, views and the buffer into the asset.
  void describe(json& asset) const {
    asset["accessors"] = accessors_;
    asset["bufferViews"] = views_;
    asset["buffers"] = json::array({{{"byteLength", bytes_.size()}}});
  }

 private:
  template <typename T, typename Count>
  void append(const T* values, Count count) {
    const auto old = bytes_.size();
    bytes_.resize(old + static_cast<std::size_t>(count) * sizeof(T));
    std::memcpy(bytes_.data() + old, values, static_cast<std::size_t>(count) * sizeof(T));
  }

  static const char* type_name(Eigen::Index rows) {
    switch (rows) {
      case 1:
        return "SCALAR";
      case 3:
        return "VEC3";
      case 4:
        return "VEC4";
      default:
        LABAN_CHECK(rows == 16);
        return "MAT4";
    }
  }

  int add_accessor(json accessor, std::size_t begin, std::optional<int> target) {
    json view = {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes_.size() - begin}};
    if (target) view["target"] = *target;
    accessor["bufferView"] = views_.size();
    views_.push_back(std::move(view));
    accessors_.push_back(std::move(accessor));
    return static_cast<int>(accessors_.size()) - 1;
  }

  std::string bytes_;
  json accessors_ = json::array();
  json views_ = json::array();
};

/// Triangles of a mesh, three vertices each, every vertex tied to one joint of the skin.
struct Triangles {
  std::vector<Eigen::Vector3f> positions;  // model space at rest, metres
  std::vector<Eigen::Vector3f> normals;
  std::vector<std::array<std::uint16_t, 4>> joints;
};

struct Vertex {
  Eigen::Vector3d position;
  int joint = 0;
};

/// Appends a flat triangle, its normal pointing away from `inside`.
void add_triangle(Triangles& mesh, const Vertex& a, Vertex b, Vertex c,
                  const Eigen::Vector3d& inside) {
  Eigen::Vector3d normal = (b.position - a.position).cross(c.position - a.position).normalized();
  if (normal.dot(a.position - inside) < 0.0) {
    std::swap(b, c);
    normal = -normal;
  }
  for (const Vertex* vertex :
       {&a, static_cast<const Vertex*>(&b), static_cast<const Vertex*>(&c)}) {
    mesh.positions.push_back(vertex->position.cast<float>());
    mesh.normals.push_back(normal.cast<float>().normalized());
    mesh.joints.push_back({static_cast<std::uint16_t>(vertex->joint), 0, 0, 0});
  }
}

/// Appends an octahedral bone: widest near the head, its tip following the joint at the tail.
void add_bone(Triangles& mesh, const Vertex& head, const Vertex& tail) {
  const Eigen::Vector3d along = tail.position - head.position;
  const double radius = std::clamp(0.1 * along.norm(), 0.004, 0.04);
  const Eigen::Vector3d side = along.unitOrthogonal();
  const Eigen::Vector3d other = along.normalized().cross(side);
  const Eigen::Vector3d middle = head.position + 0.2 * along;
  std::array<Vertex, 4> ring;
  for (std::size_t i = 0; i < 4; ++i) {
    const double turn = i < 2 ? 1.0 : -1.0;
    ring[i] = {middle + turn * radius * (i % 2 == 0 ? side : other), head.joint};
  }
  for (std::size_t i = 0; i < 4; ++i) {
    add_triangle(mesh, head, ring[i], ring[(i + 1) % 4], middle);
    add_triangle(mesh, tail, ring[i], ring[(i + 1) % 4], middle);
  }
}

Triangles bone_mesh(const motion::Clip& clip, const Eigen::Matrix3Xd& rest_positions) {
  const std::vector<bool> travels = travelling_joints(clip);
  Triangles mesh;
  for (int j = 0; j < clip.joint_count(); ++j) {
    const motion::Joint& joint = clip.skeleton().joint(j);
    const Vertex here{rest_positions.col(j), j};
    if (joint.parent >= 0 && !travels[static_cast<std::size_t>(j)] &&
        joint.rest_offset.norm() >= kShortestBoneM) {
      add_bone(mesh, {rest_positions.col(joint.parent), joint.parent}, here);
    }
    if (joint.end_site && joint.end_site->norm() >= kShortestBoneM) {
      add_bone(mesh, here, {here.position + *joint.end_site, j});
    }
  }
  if (mesh.positions.empty()) {
    const Eigen::Vector3d root = rest_positions.col(0);
    add_bone(mesh, {root, 0}, {root + Eigen::Vector3d(0.0, kMarkM, 0.0), 0});
  }
  return mesh;
}

Eigen::MatrixXf as_columns(const std::vector<Eigen::Vector3f>& vectors) {
  return Eigen::Map<const Eigen::MatrixXf>(vectors.front().data(), 3,
                                           static_cast<Eigen::Index>(vectors.size()));
}

/// glTF keeps text as UTF-8; a name in another encoding gets U+FFFD for what it cannot be.
std::string dump(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

json vector_json(const Eigen::Vector3d& v) {
  return json::array(
      {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
}

json joint_nodes(const motion::Clip& clip) {
  json nodes = json::array();
  for (int j = 0; j < clip.joint_count(); ++j) {
    const motion::Joint& joint = clip.skeleton().joint(j);
    json node = {{"name", joint.name}, {"translation", vector_json(joint.rest_offset)}};
    if (joint.end_site) node["extras"] = {{"end_site", vector_json(*joint.end_site)}};
    if (joint.parent >= 0) nodes[static_cast<std::size_t>(joint.parent)]["children"].push_back(j);
    nodes.push_back(std::move(node));
  }
  return nodes;
}

int add_inverse_bind_matrices(Buffer& buffer, const Eigen::Matrix3Xd& rest_positions) {
  Eigen::MatrixXf matrices(16, rest_positions.cols());
  for (Eigen::Index j = 0; j < rest_positions.cols(); ++j) {
    Eigen::Matrix4f joint_from_model = Eigen::Matrix4f::Identity();
    joint_from_model.topRightCorner<3, 1>() = -rest_positions.col(j).cast<float>();
    matrices.col(j) = joint_from_model.reshaped();
  }
  return buffer.add_floats(matrices, false);
}

int add_times(Buffer& buffer, const motion::Clip& clip) {
  Eigen::RowVectorXf times(clip.frame_count());
  for (Eigen::Index f = 0; f < times.size(); ++f) {
    times[f] = static_cast<float>(static_cast<double>(f) / clip.frame_rate_hz());
    if (f > 0 && !(times[f] > times[f - 1])) {
      throw base::Error(base::ErrorKind::kData,
                        "GLB: frame " + std::to_string(f) +
                            " has no float32 time of its own; cut the clip into shorter ones");
    }
  }
  return buffer.add_floats(times, true);
}

/// One channel of the animation, and the sampler it plays.
void add_channel(json& animation, int node, const char* path, int input, int output) {
  animation["channels"].push_back(
      {{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
  animation["samplers"].push_back(
      {{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
}

json make_animation(Buffer& buffer, const motion::Clip& clip, const std::string& name) {
  json animation = {{"name", name},
                    {"channels", json::array()},
                    {"samplers", json::array()},
                    {"extras", {{"frame_rate_hz", clip.frame_rate_hz()}}}};
  const int times = add_times(buffer, clip);
  Eigen::MatrixXf rotations(4, clip.frame_count());
  Eigen::MatrixXf translations(3, clip.frame_count());
  for (int j = 0; j < clip.joint_count(); ++j) {
    for (int f = 0; f < clip.frame_count(); ++f) {
      // Eigen stores x, y, z, w, as glTF does; Clip keeps neighbours in one hemisphere.
      rotations.col(f) = clip.rotation(f, j).coeffs().cast<float>();
      translations.col(f) = clip.translation(f, j).cast<float>();
    }
    add_channel(animation, j, "rotation", times, buffer.add_floats(rotations, false));
    if (j == 0 || clip.has_translations()) {
      add_channel(animation, j, "translation", times, buffer.add_floats(translations, false));
    }
  }
  return animation;
}

void add_bone_mesh(json& asset, Buffer& buffer, const Triangles& triangles) {
  Eigen::MatrixXf weights = Eigen::MatrixXf::Zero(4, std::ssize(triangles.positions));
  weights.row(0).setOnes();
  const json attributes = {
      {"POSITION", buffer.add_floats(as_columns(triangles.positions), true, kArrayBuffer)},
      {"NORMAL", buffer.add_floats(as_columns(triangles.normals), false, kArrayBuffer)},
      {"JOINTS_0", buffer.add_joint_indices(triangles.joints)},
      {"WEIGHTS_0", buffer.add_floats(weights, false, kArrayBuffer)}};
  asset["materials"] = json::array({{{"name", "bones"},
                                     {"pbrMetallicRoughness",
                                      {{"baseColorFactor", {0.75, 0.72, 0.66, 1.0}},
                                       {"metallicFactor", 0.0},
                                       {"roughnessFactor", 0.8}}}}});
  asset["meshes"] =
      json::array({{{"name", "bones"},
                    {"primitives", json::array({{{"attributes", attributes}, {"material", 0}}})}}});
  // Beside the root joint, not below it: a skinned mesh ignores its own node's transform.
  asset["scenes"][0]["nodes"].push_back(asset["nodes"].size());
  asset["nodes"].push_back({{"name", "bones"}, {"mesh", 0}, {"skin", 0}});
}

void append_u32(std::string& bytes, std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  std::array<char, sizeof word> raw{};
  std::memcpy(raw.data(), &word, sizeof word);
  bytes.append(raw.data(), raw.size());
}

/// The two chunks and their header; chunks are padded to 4 bytes, JSON with spaces, BIN with zeros.
std::string pack(std::string text, std::string binary) {
  text.resize((text.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const std::size_t size = 12 + 8 + text.size() + 8 + binary.size();
  if (size > std::numeric_limits<std::uint32_t>::max()) {
    throw base::Error(
        base::ErrorKind::kData,
        "GLB: " + std::to_string(size) +
            " bytes, a file holds at most 4294967295; cut the clip into shorter ones");
  }
  std::string bytes;
  bytes.reserve(size);
  for (const std::size_t word : {std::size_t{kGlbMagic}, std::size_t{2}, size, text.size()}) {
    append_u32(bytes, word);
  }
  append_u32(bytes, kJsonChunk);
  bytes += text;
  append_u32(bytes, binary.size());
  append_u32(bytes, kBinChunk);
  bytes += binary;
  return bytes;
}

}  // namespace

std::string write_glb(const motion::Clip& clip, const GlbWriteOptions& options) {
  if (clip.joint_count() > std::numeric_limits<std::uint16_t>::max()) {
    throw base::Error(base::ErrorKind::kData, "GLB: " + std::to_string(clip.joint_count()) +
                                                  " joints (a skin has at most 65535)");
  }
  const Eigen::Matrix3Xd rest_positions = motion::rest_pose(clip.skeleton()).positions;
  Buffer buffer;
  std::vector<int> joints(static_cast<std::size_t>(clip.joint_count()));
  for (std::size_t j = 0; j < joints.size(); ++j) joints[j] = static_cast<int>(j);
  json asset = {{"asset", {{"version", "2.0"}, {"generator", "laban"}}},
                {"scene", 0},
                {"scenes", json::array({{{"nodes", json::array({0})}}})},
                {"nodes", joint_nodes(clip)}};
  asset["skins"] =
      json::array({{{"name", "skeleton"},
                    {"joints", joints},
                    {"skeleton", 0},
                    {"inverseBindMatrices", add_inverse_bind_matrices(buffer, rest_positions)}}});
  asset["animations"] = json::array({make_animation(buffer, clip, options.animation_name)});
  if (options.bone_mesh) add_bone_mesh(asset, buffer, bone_mesh(clip, rest_positions));
  buffer.describe(asset);
  return pack(dump(asset), buffer.bytes());
}

}  // namespace laban::io
