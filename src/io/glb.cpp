#include "laban/io/glb.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <nlohmann/json.hpp>

#include "laban/base/error.h"
#include "laban/motion/forward_kinematics.h"

#include "io/glb_animation.h"
#include "io/gltf_document.h"
#include "io/travel.h"

namespace laban::io {
namespace {

using nlohmann::json;

constexpr int kArrayBuffer = 34962;

// Nothing shorter is drawn: a bone of no length has no direction.
constexpr double kShortestBoneM = 1e-3;
// Height of the mark drawn where a skeleton has no bone at all, so that it can be seen.
constexpr double kMarkM = 0.1;

/// The binary chunk and the accessors into it, grown together.
class Buffer {
 public:
  explicit Buffer(json& asset) : asset_(asset) {}

  /// Appends an accessor of 3-, 4- or 16-vectors, one a column; returns its index.
  int add_floats(const Eigen::Ref<const Eigen::MatrixXf>& values, bool with_bounds,
                 std::optional<int> target = std::nullopt) {
    std::string bytes;
    for (Eigen::Index c = 0; c < values.cols(); ++c)
      append(bytes, values.col(c).data(), values.rows());
    json accessor = {{"componentType", kGltfFloat},
                     {"count", values.cols()},
                     {"type", type_name(values.rows())}};
    if (with_bounds) {
      const Eigen::VectorXf least = values.rowwise().minCoeff();
      const Eigen::VectorXf most = values.rowwise().maxCoeff();
      accessor["min"] = std::vector<float>(least.begin(), least.end());
      accessor["max"] = std::vector<float>(most.begin(), most.end());
    }
    return add_accessor(std::move(accessor), bytes, target);
  }

  /// Appends an accessor of 4-vectors of unsigned shorts.
  int add_joint_indices(const std::vector<std::array<std::uint16_t, 4>>& values) {
    std::string bytes;
    for (const auto& value : values) append(bytes, value.data(), value.size());
    return add_accessor(
        {{"componentType", kGltfUnsignedShort}, {"count", values.size()}, {"type", "VEC4"}}, bytes,
        kArrayBuffer);
  }

  [[nodiscard]] std::string& bytes() noexcept { return bytes_; }

 private:
  template <typename T, typename Count>
  static void append(std::string& bytes, const T* values, Count count) {
    bytes.append(reinterpret_cast<const char*>(values),
                 static_cast<std::size_t>(count) * sizeof(T));
  }

  static const char* type_name(Eigen::Index rows) {
    switch (rows) {
      case 3:
        return "VEC3";
      case 4:
        return "VEC4";
      default:
        LABAN_CHECK(rows == 16);
        return "MAT4";
    }
  }

  int add_accessor(json accessor, std::string_view bytes, std::optional<int> target) {
    const std::size_t view = append_view(asset_, bytes_, bytes);
    if (target) asset_["bufferViews"][view]["target"] = *target;
    accessor["bufferView"] = view;
    asset_["accessors"].push_back(std::move(accessor));
    return static_cast<int>(asset_["accessors"].size()) - 1;
  }

  json& asset_;
  std::string bytes_;
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

GlbAnimation make_animation(const motion::Clip& clip, const GlbWriteOptions& options) {
  GlbAnimation animation(clip.frame_count(), clip.frame_rate_hz(), options);
  const double tolerance = options.compact ? options.compact->translation_tolerance_m : 0.0;
  std::vector<Eigen::Quaterniond> rotations(static_cast<std::size_t>(clip.frame_count()));
  Eigen::MatrixXd translations(3, clip.frame_count());
  for (int j = 0; j < clip.joint_count(); ++j) {
    // Clip keeps neighbours in one hemisphere.
    for (int f = 0; f < clip.frame_count(); ++f) {
      rotations[static_cast<std::size_t>(f)] = clip.rotation(f, j);
    }
    animation.add_rotations(j, rotations);
    if (j > 0 && !clip.has_translations()) continue;
    for (int f = 0; f < clip.frame_count(); ++f) translations.col(f) = clip.translation(f, j);
    animation.add_vectors(j, "translation", translations, tolerance);
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

}  // namespace

std::string write_glb(const motion::Clip& clip, const GlbWriteOptions& options) {
  if (clip.joint_count() > std::numeric_limits<std::uint16_t>::max()) {
    throw base::Error(base::ErrorKind::kData, "GLB: " + std::to_string(clip.joint_count()) +
                                                  " joints (a skin has at most 65535)");
  }
  const Eigen::Matrix3Xd rest_positions = motion::rest_pose(clip.skeleton()).positions;
  std::vector<int> joints(static_cast<std::size_t>(clip.joint_count()));
  for (std::size_t j = 0; j < joints.size(); ++j) joints[j] = static_cast<int>(j);
  json asset = {{"asset", {{"version", "2.0"}, {"generator", "laban"}}},
                {"scene", 0},
                {"scenes", json::array({{{"nodes", json::array({0})}}})},
                {"nodes", joint_nodes(clip)}};
  Buffer buffer(asset);
  asset["skins"] =
      json::array({{{"name", "skeleton"},
                    {"joints", joints},
                    {"skeleton", 0},
                    {"inverseBindMatrices", add_inverse_bind_matrices(buffer, rest_positions)}}});
  make_animation(clip, options).finish(asset, buffer.bytes());
  if (options.bone_mesh) add_bone_mesh(asset, buffer, bone_mesh(clip, rest_positions));
  asset["buffers"] = json::array({{{"byteLength", buffer.bytes().size()}}});
  return pack_glb(asset, buffer.bytes());
}

}  // namespace laban::io
