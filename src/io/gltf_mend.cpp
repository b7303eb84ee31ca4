#include "io/gltf_mend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <set>

#include "io/gltf_sampler.h"

namespace laban::io {
namespace {

using nlohmann::json;

constexpr int kUnsignedByte = 5121;
constexpr int kUnsignedShort = 5123;
constexpr int kFloat = 5126;
// The validator allows a vertex 2e-7 a weight.
constexpr double kSumTolerance = 2e-7;

/// 4-vectors in the buffer, all inside it.
struct Vectors {
  std::size_t begin = 0;
  std::size_t stride = 0;
  std::size_t count = 0;
  int component_type = 0;
};

/// An unsigned number at a key; nothing if it is none.
std::optional<std::size_t> number(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number_unsigned()) return std::nullopt;
  const std::size_t value = found->get<std::size_t>();
  return value <= std::size_t{1} << 40U ? std::optional(value) : std::nullopt;
}

/// The object at an index of a list; nullptr if there is none.
json* element(json& document, const char* list, std::optional<std::size_t> index) {
  const auto found = document.find(list);
  if (!index || found == document.end() || !found->is_array() || *index >= found->size()) {
    return nullptr;
  }
  json& object = (*found)[*index];
  return object.is_object() ? &object : nullptr;
}

std::optional<Vectors> vectors(json& document, const json& attributes, const std::string& key,
                               std::size_t binary_size) {
  const json* accessor = element(document, "accessors", number(attributes, key.c_str()));
  if (accessor == nullptr || accessor->contains("sparse")) return std::nullopt;
  const json* view = element(document, "bufferViews", number(*accessor, "bufferView"));
  if (view == nullptr || view->contains("extensions")) return std::nullopt;
  const auto type = number(*accessor, "componentType");
  const std::size_t bytes = type == kFloat           ? 16
                            : type == kUnsignedShort ? 8
                            : type == kUnsignedByte  ? 4
                                                     : 0;
  const auto count = number(*accessor, "count");
  const auto length = number(*view, "byteLength");
  const auto shape = accessor->find("type");
  const bool is_vec4 = shape != accessor->end() && *shape == "VEC4";
  if (bytes == 0 || !count || *count == 0 || !length || !is_vec4) return std::nullopt;
  const std::size_t offset = number(*accessor, "byteOffset").value_or(0);
  const Vectors found{number(*view, "byteOffset").value_or(0) + offset,
                      number(*view, "byteStride").value_or(bytes), *count, static_cast<int>(*type)};
  const bool inside = found.stride >= bytes && found.stride <= 252 &&
                      offset + (*count - 1) * found.stride + bytes <= *length &&
                      found.begin + (*count - 1) * found.stride + bytes <= binary_size;
  return inside ? std::optional(found) : std::nullopt;
}

/// The joints and weights of a primitive's vertices: four each a set.
struct Influences {
  std::vector<Vectors> joints, weights;
};

std::optional<Influences> influences(json& document, const json& attributes,
                                     std::size_t binary_size) {
  Influences found;
  for (int set = 0; attributes.contains("WEIGHTS_" + std::to_string(set)); ++set) {
    const auto weights =
        vectors(document, attributes, "WEIGHTS_" + std::to_string(set), binary_size);
    const auto joints = vectors(document, attributes, "JOINTS_" + std::to_string(set), binary_size);
    if (!weights || !joints || weights->component_type != kFloat ||
        joints->component_type == kFloat || weights->count != joints->count) {
      return std::nullopt;
    }
    if (set > 0 && weights->count != found.weights.front().count) return std::nullopt;
    found.weights.push_back(*weights);
    found.joints.push_back(*joints);
  }
  return found.weights.empty() ? std::nullopt : std::optional(found);
}

/// Whether anything had to be mended.
bool mend_vertex(const Influences& all, std::size_t vertex, std::string& binary) {
  std::vector<std::array<float, 4>> weights(all.weights.size());
  double sum = 0.0;
  for (std::size_t set = 0; set < weights.size(); ++set) {
    const char* from = binary.data() + all.weights[set].begin + vertex * all.weights[set].stride;
    std::memcpy(weights[set].data(), from, 16);
    for (const float weight : weights[set]) sum += static_cast<double>(weight);
  }
  if (!(sum > 1e-6) || !std::isfinite(sum)) return false;
  const bool scale = std::abs(sum - 1.0) > kSumTolerance;
  bool mended = scale;
  for (std::size_t set = 0; set < weights.size(); ++set) {
    const Vectors& joints = all.joints[set];
    const std::size_t size = joints.component_type == kUnsignedByte ? 1 : 2;
    for (std::size_t i = 0; i < 4; ++i) {
      float& weight = weights[set][i];
      if (scale) weight = static_cast<float>(static_cast<double>(weight) / sum);
      if (weight != 0.0F) continue;
      char* joint = binary.data() + joints.begin + vertex * joints.stride + i * size;
      mended = mended || std::any_of(joint, joint + size, [](char byte) { return byte != 0; });
      std::memset(joint, 0, size);
    }
    char* to = binary.data() + all.weights[set].begin + vertex * all.weights[set].stride;
    std::memcpy(to, weights[set].data(), 16);
  }
  return mended;
}

/// Bounds of what has changed; glTF asks for none here.
void drop_bounds(json& document, const json& attributes, std::size_t sets) {
  for (std::size_t set = 0; set < sets; ++set) {
    for (const char* key : {"WEIGHTS_", "JOINTS_"}) {
      const std::string attribute = key + std::to_string(set);
      json* accessor = element(document, "accessors", number(attributes, attribute.c_str()));
      accessor->erase("min");
      accessor->erase("max");
    }
  }
}

void mend_weights(json& document, std::string& binary) {
  const auto meshes = document.find("meshes");
  if (meshes == document.end() || !meshes->is_array()) return;
  std::set<std::size_t> done;  // primitives share vertices
  for (const json& mesh : *meshes) {
    if (!mesh.is_object() || !mesh.contains("primitives") || !mesh["primitives"].is_array())
      continue;
    for (const json& primitive : mesh["primitives"]) {
      if (!primitive.is_object() || !primitive.contains("attributes")) continue;
      const json& attributes = primitive["attributes"];
      if (!attributes.is_object()) continue;
      const auto all = influences(document, attributes, binary.size());
      if (!all || !done.insert(all->weights.front().begin).second) continue;
      bool mended = false;
      for (std::size_t v = 0; v < all->weights.front().count; ++v) {
        mended = mend_vertex(*all, v, binary) || mended;
      }
      if (mended) drop_bounds(document, attributes, all->weights.size());
    }
  }
}

/// Nodes that any animation of the file moves.
std::set<std::size_t> animated_nodes(const json& document) {
  std::set<std::size_t> nodes;
  for (const json& animation : document.value("animations", json::array())) {
    if (!animation.contains("channels") || !animation["channels"].is_array()) continue;
    for (const json& channel : animation["channels"]) {
      if (!channel.is_object() || !channel.contains("target")) continue;
      const json& target = channel["target"];
      if (!target.is_object() || !target.contains("path") || target["path"] == "weights") continue;
      if (const auto node = number(target, "node")) nodes.insert(*node);
    }
  }
  return nodes;
}

GltfPlace default_place(const GltfModel& model, const GltfPlayer& player, int node) {
  std::vector<int> way;
  for (int n = node; n >= 0; n = model.nodes[static_cast<std::size_t>(n)].parent) way.push_back(n);
  GltfPlace place;
  for (auto n = way.rbegin(); n != way.rend(); ++n) place = player.default_place(*n, place);
  return place;
}

void keep_bind_place(json& skin, const GltfPlace& place) {
  json& extras = skin["extras"];
  if (!extras.is_null() && !extras.is_object()) return;  // someone else's
  if (extras.contains("model_from_mesh")) return;
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = place.linear;
  matrix.topRightCorner<3, 1>() = place.position;
  extras["model_from_mesh"] = std::vector<double>(matrix.data(), matrix.data() + matrix.size());
}

/// Puts a node beside the root it was below, in every scene that has that.
void move_to_root(json& document, std::size_t node, std::size_t parent, std::size_t root) {
  json& children = document["nodes"][parent]["children"];
  for (std::size_t c = 0; c < children.size(); ++c) {
    if (children[c] == node) children.erase(c--);
  }
  if (children.empty()) document["nodes"][parent].erase("children");
  for (const char* key : {"translation", "rotation", "scale", "matrix"}) {
    document["nodes"][node].erase(key);
  }
  if (!document.contains("scenes") || !document["scenes"].is_array()) return;
  for (json& scene : document["scenes"]) {
    if (!scene.is_object() || !scene.contains("nodes") || !scene["nodes"].is_array()) continue;
    json& nodes = scene["nodes"];
    if (std::find(nodes.begin(), nodes.end(), json(root)) != nodes.end()) nodes.push_back(node);
  }
}

void lift_skinned_meshes(const GltfModel& model, json& document) {
  const std::set<std::size_t> animated = animated_nodes(document);
  const GltfPlayer player(model, {});
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    const GltfNode& node = model.nodes[n];
    const bool lifts = node.skin && node.parent >= 0 && node.children.empty() &&
                       !animated.contains(n) && document["nodes"][n].contains("mesh");
    if (!lifts) continue;
    std::size_t root = n;
    while (model.nodes[root].parent >= 0) root = static_cast<std::size_t>(model.nodes[root].parent);
    keep_bind_place(document["skins"][static_cast<std::size_t>(*node.skin)],
                    default_place(model, player, static_cast<int>(n)));
    move_to_root(document, n, static_cast<std::size_t>(node.parent), root);
  }
}

}  // namespace

void mend_skinned_meshes(const GltfModel& model, json& document, std::string& binary) {
  mend_weights(document, binary);
  lift_skinned_meshes(model, document);
}

}  // namespace laban::io
