#include "io/gltf_model.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <set>

// The library's own parser, and no picture is ever decoded: its headers are not needed.
#define TINYGLTF_NO_INCLUDE_STB_IMAGE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include "laban/base/error.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;
using nlohmann::json;

// What any file may have, and one more for so many bytes: a node of a rig takes 60 bytes of text or
// more, a channel with its sampler and accessor 200.
constexpr std::size_t kFreeObjects = 16'384;
constexpr std::size_t kBytesPerObject = 48;
// Numbers of accessors that any file may have, however few bytes they share.
constexpr std::size_t kFreeNumbers = std::size_t{1} << 20U;
// A rotation shorter than this has no direction.
constexpr double kShortestQuaternion = 1e-3;
constexpr double kLargest = 1e30;
// Names that an error message lists.
constexpr std::size_t kMostNames = 20;

std::string indexed(const std::string& place, std::size_t index) {
  return place + "/" + std::to_string(index);
}

std::size_t bytes_of(int component_type) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;
  }
}

int width_of(const std::string& type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC3") return 3;
  if (type == "VEC4") return 4;
  if (type == "MAT4") return 16;
  return 0;
}

template <typename T>
T raw(std::string_view binary, std::size_t at) {
  T value{};
  std::memcpy(&value, binary.data() + at, sizeof value);
  return value;
}

/// A component as a number; normalised whole ones by the formulas of the specification (3.11).
double component(std::string_view binary, std::size_t at, int type, bool normalized) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: {
      const double value = raw<std::int8_t>(binary, at);
      return normalized ? std::max(value / 127.0, -1.0) : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: {
      const double value = raw<std::uint8_t>(binary, at);
      return normalized ? value / 255.0 : value;
    }
    case TINYGLTF_COMPONENT_TYPE_SHORT: {
      const double value = raw<std::int16_t>(binary, at);
      return normalized ? std::max(value / 32767.0, -1.0) : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
      const double value = raw<std::uint16_t>(binary, at);
      return normalized ? value / 65535.0 : value;
    }
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return raw<std::uint32_t>(binary, at);
    default:
      return static_cast<double>(raw<float>(binary, at));
  }
}

std::size_t element_number(const GltfSparse& sparse, std::string_view binary, std::size_t i) {
  const std::size_t size = bytes_of(sparse.index_type);
  return static_cast<std::size_t>(
      component(binary, sparse.indices_begin + i * size, sparse.index_type, false));
}

/// Checks what concerns motion and copies it, and nothing else, into a document for tinygltf: all
/// that reaches it has been looked at before.
class Pruner {
 public:
  Pruner(const GltfDocument& document, std::string_view name, std::vector<std::string>& warnings)
      : source_(document.json),
        binary_(document.binary),
        bytes_(document.file_bytes),
        name_(name),
        accessors_(array_at(name, source_, "accessors", "", true)),
        views_(array_at(name, source_, "bufferViews", "", true)),
        skins_(array_at(name, source_, "skins", "", true)),
        warnings_(warnings) {
    pruned_ = {{"asset", {{"version", "2.0"}}}, {"nodes", json::array()},
               {"skins", json::array()},        {"accessors", json::array()},
               {"bufferViews", json::array()},  {"animations", json::array()}};
  }

  json prune(std::size_t animation) {
    prune_nodes();
    prune_skins();
    prune_animation(animation);
    return std::move(pruned_);
  }

 private:
  [[noreturn]] void fail(const std::string& at, const std::string& message) const {
    fail_gltf(name_, at, message);
  }

  /// A section's objects, not more than a file of this size would have.
  [[nodiscard]] const json& section(const json& object, const char* key, const std::string& at) {
    const json& list = array_at(name_, object, key, at, true);
    objects_ += list.size();
    if (objects_ > kFreeObjects + bytes_ / kBytesPerObject) {
      fail(at + "/" + key,
           std::to_string(list.size()) + " of them are more than is read from a file of this size");
    }
    return list;
  }

  /// An index into one of the file's lists. @throws Error{kFormat} if it is not one.
  [[nodiscard]] std::size_t index(const json& object, const char* key, const std::string& at,
                                  std::size_t count, const char* what) const {
    return in_range(whole_number(name_, object, key, at), at + "/" + key, count, what);
  }
  [[nodiscard]] std::size_t in_range(std::size_t value, const std::string& at, std::size_t count,
                                     const char* what) const {
    if (value >= count) fail(at, std::to_string(value) + ", " + there_are(count, what));
    return value;
  }
  /// Elements of a list of indices.
  [[nodiscard]] std::vector<std::size_t> indices(const json& object, const char* key,
                                                 const std::string& at, std::size_t count,
                                                 const char* what) const {
    const json& list = array_at(name_, object, key, at, false);
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string place = indexed(at + "/" + key, i);
      if (!list[i].is_number_unsigned()) fail(place, "it is not a whole number of 0 or more");
      found.push_back(in_range(list[i].get<std::size_t>(), place, count, what));
    }
    return found;
  }

  /// Copies a list of `size` finite numbers, if there is one.
  void copy_numbers(const json& from, json& to, const char* key, const std::string& at,
                    std::size_t size) const {
    const auto found = from.find(key);
    if (found == from.end()) return;
    bool good = found->is_array() && found->size() == size;
    for (std::size_t i = 0; good && i < size; ++i) {
      good = (*found)[i].is_number() && std::abs((*found)[i].get<double>()) <= kLargest;
    }
    if (!good) {
      fail(at + "/" + key, "it is not a list of " + std::to_string(size) + " numbers below 1e30");
    }
    to[key] = *found;
  }

  void prune_nodes() {
    const json& nodes = section(source_, "nodes", "");
    std::vector<int> parents(nodes.size(), -1);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      const std::string at = indexed("/nodes", n);
      json node = json::object();
      if (nodes[n].contains("name") && nodes[n]["name"].is_string())
        node["name"] = nodes[n]["name"];
      copy_numbers(nodes[n], node, "translation", at, 3);
      copy_numbers(nodes[n], node, "rotation", at, 4);
      copy_numbers(nodes[n], node, "scale", at, 3);
      copy_numbers(nodes[n], node, "matrix", at, 16);
      require_direction(node, at);
      if (nodes[n].contains("skin")) {
        node["skin"] = index(nodes[n], "skin", at, skins_.size(), "skin");
      }
      const std::vector<std::size_t> children =
          indices(nodes[n], "children", at, nodes.size(), "node");
      for (std::size_t i = 0; i < children.size(); ++i) {
        int& parent = parents[children[i]];
        if (parent >= 0) {
          fail(indexed(at + "/children", i), "node " + std::to_string(children[i]) +
                                                 " is a child of node " + std::to_string(parent) +
                                                 " already");
        }
        parent = static_cast<int>(n);
      }
      if (!children.empty()) node["children"] = children;
      pruned_["nodes"].push_back(std::move(node));
    }
    require_trees(parents);
  }

  void require_direction(const json& node, const std::string& at) const {
    if (!node.contains("rotation")) return;
    double square = 0.0;
    for (const json& value : node["rotation"]) square += value.get<double>() * value.get<double>();
    if (square < kShortestQuaternion * kShortestQuaternion) {
      fail(at + "/rotation", "it has no length; a rotation is a unit quaternion");
    }
  }

  /// With one parent at most a node, what is no tree has a cycle.
  void require_trees(const std::vector<int>& parents) const {
    std::vector<int> seen_from(parents.size(), -1);
    for (std::size_t n = 0; n < parents.size(); ++n) {
      int up = static_cast<int>(n);
      while (up >= 0 && seen_from[static_cast<std::size_t>(up)] < 0) {
        seen_from[static_cast<std::size_t>(up)] = static_cast<int>(n);
        up = parents[static_cast<std::size_t>(up)];
      }
      if (up >= 0 && seen_from[static_cast<std::size_t>(up)] == static_cast<int>(n)) {
        fail(indexed("/nodes", static_cast<std::size_t>(up)), "it is its own ancestor");
      }
    }
  }

  void prune_skins() {
    const json& skins = section(source_, "skins", "");
    const std::size_t nodes = pruned_["nodes"].size();
    for (std::size_t s = 0; s < skins.size(); ++s) {
      const std::string at = indexed("/skins", s);
      const std::vector<std::size_t> joints = indices(skins[s], "joints", at, nodes, "node");
      if (joints.empty()) fail(at + "/joints", "there are none");
      const std::set<std::size_t> distinct(joints.begin(), joints.end());
      if (distinct.size() != joints.size()) fail(at + "/joints", "one of them is there twice");
      json skin = {{"joints", joints}};
      if (skins[s].contains("inverseBindMatrices")) {
        const std::size_t matrices = accessor(skins[s], "inverseBindMatrices", at);
        const json& info = pruned_["accessors"][matrices];
        if (info["type"] != "MAT4" || info["componentType"] != TINYGLTF_COMPONENT_TYPE_FLOAT ||
            info["count"].get<std::size_t>() < joints.size()) {
          fail(at + "/inverseBindMatrices", "it is not a 4 x 4 matrix of floats for each of " +
                                                std::to_string(joints.size()) + " joints");
        }
        skin["inverseBindMatrices"] = matrices;
      }
      pruned_["skins"].push_back(std::move(skin));
    }
  }

  void prune_animation(std::size_t which) {
    const std::string at = indexed("/animations", which);
    const json& source = array_at(name_, source_, "animations", "", true)[which];
    const json& channels = section(source, "channels", at);
    const json& samplers = section(source, "samplers", at);
    json animation = {{"channels", json::array()}, {"samplers", json::array()}};
    std::set<std::pair<std::size_t, std::string>> seen;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const std::string place = indexed(at + "/channels", c);
      const auto target = channels[c].find("target");
      if (target == channels[c].end() || !target->is_object() || !target->contains("path") ||
          !(*target)["path"].is_string()) {
        fail(place + "/target", "it is not an object with a path");
      }
      const std::string path = (*target)["path"].get<std::string>();
      const bool known =
          path == "translation" || path == "rotation" || path == "scale" || path == "weights";
      if (!known || !target->contains("node")) {
        tell_once("channels of other things than nodes are not read", place);
        continue;
      }
      const std::size_t node =
          index(*target, "node", place + "/target", pruned_["nodes"].size(), "node");
      const std::size_t sampler = index(channels[c], "sampler", place, samplers.size(), "sampler");
      if (!seen.emplace(node, path).second) {
        tell_once("a second channel of one node and path is ignored", place);
        continue;
      }
      animation["channels"].push_back({{"sampler", animation["samplers"].size()},
                                       {"target", {{"node", node}, {"path", path}}}});
      animation["samplers"].push_back(
          pruned_sampler(samplers[sampler], indexed(at + "/samplers", sampler), path));
    }
    pruned_["animations"].push_back(std::move(animation));
  }

  json pruned_sampler(const json& source, const std::string& at, const std::string& path) {
    std::string interpolation = "LINEAR";
    if (source.contains("interpolation")) {
      if (!source["interpolation"].is_string()) fail(at + "/interpolation", "it is not text");
      interpolation = source["interpolation"].get<std::string>();
    }
    if (interpolation != "LINEAR" && interpolation != "STEP" && interpolation != "CUBICSPLINE") {
      fail(at + "/interpolation",
           cited(interpolation) + " is not one of LINEAR, STEP, CUBICSPLINE");
    }
    const std::size_t input = accessor(source, "input", at);
    const std::size_t output = accessor(source, "output", at);
    const json& times = pruned_["accessors"][input];
    if (times["type"] != "SCALAR" || times["componentType"] != TINYGLTF_COMPONENT_TYPE_FLOAT) {
      fail(at + "/input", "key times are float scalars");
    }
    require_times(input);
    const bool is_spline = interpolation == "CUBICSPLINE";
    require_values(pruned_["accessors"][output], at + "/output", path,
                   times["count"].get<std::size_t>() * (is_spline ? 3 : 1));
    if (path == "rotation") require_directions(output, is_spline);
    return {{"input", input}, {"output", output}, {"interpolation", interpolation}};
  }

  void require_values(const json& values, const std::string& at, const std::string& path,
                      std::size_t keys) const {
    const std::string type = path == "rotation" ? "VEC4" : path == "weights" ? "SCALAR" : "VEC3";
    const int component_type = values["componentType"].get<int>();
    const bool is_float = component_type == TINYGLTF_COMPONENT_TYPE_FLOAT;
    const bool is_small = values["normalized"].get<bool>() && bytes_of(component_type) < 4;
    const bool may_be_small = path == "rotation" || path == "weights";
    if (values["type"] != type || !(is_float || (is_small && may_be_small))) {
      fail(at, "values of " + path + " are " + type + " of floats" +
                   (may_be_small ? " or of normalized int8 or int16" : ""));
    }
    const std::size_t count = values["count"].get<std::size_t>();
    const bool fits = path == "weights" ? count >= keys && count % keys == 0 : count == keys;
    if (!fits) {
      fail(at, std::to_string(count) + " values for " + std::to_string(keys) +
                   (path == "weights" ? " keys or a multiple of it" : " expected"));
    }
  }

  /// No key of a rotation may be too short to have a direction; tangents may.
  void require_directions(std::size_t accessor, bool is_spline) {
    if (!checked_rotations_.emplace(accessor, is_spline).second) return;
    const GltfAccessor& view = views_of_[accessor];
    for (std::size_t i = is_spline ? 1 : 0; i < view.count; i += is_spline ? 3 : 1) {
      Eigen::Vector4d q;
      view.read(binary_, i, q.data());
      if (q.norm() >= kShortestQuaternion) continue;
      fail(indexed("/accessors", sources_[accessor]),
           "element " + std::to_string(i) + " has no length; a rotation is a unit quaternion");
    }
  }

  void require_times(std::size_t accessor) {
    if (!checked_times_.insert(accessor).second) return;
    const std::string at = indexed("/accessors", sources_[accessor]);
    const GltfAccessor& times = views_of_[accessor];
    double before = 0.0;
    for (std::size_t k = 0; k < times.count; ++k) {
      double time = 0.0;
      times.read(binary_, k, &time);
      if (k > 0 && time < before) {
        fail(at, "key time " + std::to_string(k) + " is " + std::to_string(time) +
                     " s, the one before is " + std::to_string(before) + " s; they must rise");
      }
      if (k > 0 && time == before) tell_once("two keys have one time; the later is used", at);
      before = time;
    }
  }

  /// The pruned index of the accessor that `key` names, checked and copied the first time.
  std::size_t accessor(const json& object, const char* key, const std::string& at) {
    const std::size_t wanted = index(object, key, at, accessors_.size(), "accessor");
    const auto known = pruned_accessors_.find(wanted);
    if (known != pruned_accessors_.end()) return known->second;
    const std::size_t made = pruned_["accessors"].size();
    pruned_accessors_.emplace(wanted, made);
    sources_.push_back(wanted);
    copy_accessor(accessors_[wanted], indexed("/accessors", wanted));
    return made;
  }

  void copy_accessor(const json& source, const std::string& at) {
    if (++objects_ > kFreeObjects + bytes_ / kBytesPerObject) {
      fail(at, "more accessors than is read from a file of this size");
    }
    json copy = json::object();
    const std::size_t count = whole_number(name_, source, "count", at);
    if (count == 0) fail(at + "/count", "0; an accessor has one element or more");
    copy["count"] = count;
    const std::size_t type = whole_number(name_, source, "componentType", at);
    const std::size_t bytes = type < 10'000 ? bytes_of(static_cast<int>(type)) : 0;
    if (bytes == 0) fail(at + "/componentType", std::to_string(type) + " is no component type");
    copy["componentType"] = type;
    if (!source.contains("type") || !source["type"].is_string()) fail(at, "it has no type");
    const int width = width_of(source["type"].get<std::string>());
    if (width == 0) fail(at + "/type", "motion is SCALAR, VEC3, VEC4 or MAT4");
    copy["type"] = source["type"];
    const auto normalized = source.find("normalized");
    if (normalized != source.end() && !normalized->is_boolean()) {
      fail(at + "/normalized", "it is neither true nor false");
    }
    copy["normalized"] = normalized != source.end() && normalized->get<bool>();
    require_affordable(count, static_cast<std::size_t>(width), at);
    GltfAccessor view{
        static_cast<int>(type), copy["normalized"].get<bool>(), width, count, {}, 0, {}};
    const std::size_t element = bytes * static_cast<std::size_t>(width);
    if (source.contains("bufferView")) {
      const std::size_t offset = whole_number(name_, source, "byteOffset", at, 0);
      const Range range = view_range(source, "bufferView", at, offset, count, element);
      copy["bufferView"] = range.pruned_view;
      copy["byteOffset"] = offset;
      view.begin = range.begin;
      view.stride = range.stride;
    }
    if (source.contains("sparse")) copy["sparse"] = pruned_sparse(source, at, element, view);
    require_finite(view, at);
    pruned_["accessors"].push_back(std::move(copy));
    views_of_.push_back(view);
  }

  void require_affordable(std::size_t count, std::size_t width, const std::string& at) {
    const std::size_t most = kFreeNumbers + 2 * bytes_;
    if (count > most || count * width > most - std::min(most, numbers_)) {
      fail(at + "/count", std::to_string(count) +
                              " elements are more than is read from a file of "
                              "this size");
    }
    numbers_ += count * width;
  }

  /// Where elements lie, once it is known that they lie inside their view.
  struct Range {
    std::size_t begin = 0;
    std::size_t stride = 0;
    std::size_t pruned_view = 0;
  };

  Range view_range(const json& object, const char* key, const std::string& at, std::size_t offset,
                   std::size_t count, std::size_t element) {
    const std::size_t v = index(object, key, at, views_.size(), "buffer view");
    const std::string place = indexed("/bufferViews", v);
    if (views_[v].contains("extensions") &&
        views_[v]["extensions"].contains("EXT_meshopt_compression")) {
      fail(place, "EXT_meshopt_compression is not read; export without compression");
    }
    // The view lies inside the buffer: read_gltf_document saw to it.
    const std::size_t begin = whole_number(name_, views_[v], "byteOffset", place, 0);
    const std::size_t length = whole_number(name_, views_[v], "byteLength", place);
    const std::size_t stride = whole_number(name_, views_[v], "byteStride", place, element);
    const bool told = views_[v].contains("byteStride");
    if (stride < element || (told && (stride % 4 != 0 || stride > 252))) {
      fail(place + "/byteStride", std::to_string(stride) + " for elements of " +
                                      std::to_string(element) +
                                      " bytes (a multiple of 4, at most 252)");
    }
    // tinygltf keeps some of these as int.
    constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max();
    if (offset > kMost || count > kMost) fail(at, "it reaches beyond 2 GB, the most that is read");
    if (offset > length || count > (length - offset) / element + 1 ||
        (count - 1) * stride + element > length - offset) {
      fail(at, std::to_string(count) + " elements from byte " + std::to_string(offset) + " need " +
                   std::to_string((count - 1) * stride + element) + " bytes, the buffer view has " +
                   std::to_string(length - std::min(length, offset)));
    }
    return {begin + offset, stride, copy_view(v, begin, length, told ? stride : 0)};
  }

  std::size_t copy_view(std::size_t view, std::size_t begin, std::size_t length,
                        std::size_t stride) {
    const auto [place, is_new] = pruned_views_.emplace(view, pruned_["bufferViews"].size());
    if (!is_new) return place->second;
    json copy = {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", length}};
    if (stride > 0) copy["byteStride"] = stride;
    pruned_["bufferViews"].push_back(std::move(copy));
    return place->second;
  }

  json pruned_sparse(const json& accessor, const std::string& at, std::size_t element,
                     GltfAccessor& view) {
    const auto part = [&](const json& object, const char* key, const std::string& place) {
      if (!object.contains(key) || !object[key].is_object())
        fail(place, "it has no " + std::string(key));
      return object[key];
    };
    const std::string place = at + "/sparse";
    const json source = part(accessor, "sparse", at);
    const json indices = part(source, "indices", place);
    const json values = part(source, "values", place);
    GltfSparse sparse;
    sparse.count = whole_number(name_, source, "count", place);
    if (sparse.count == 0 || sparse.count > view.count) {
      fail(place + "/count",
           std::to_string(sparse.count) + " of " + std::to_string(view.count) + " elements");
    }
    const std::size_t type = whole_number(name_, indices, "componentType", place + "/indices");
    if (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
        type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
        type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) {
      fail(place + "/indices/componentType", std::to_string(type) + " is not an unsigned type");
    }
    sparse.index_type = static_cast<int>(type);
    const std::size_t at_index = whole_number(name_, indices, "byteOffset", place + "/indices", 0);
    const std::size_t at_value = whole_number(name_, values, "byteOffset", place + "/values", 0);
    const Range of_indices = view_range(indices, "bufferView", place + "/indices", at_index,
                                        sparse.count, bytes_of(sparse.index_type));
    const Range of_values =
        view_range(values, "bufferView", place + "/values", at_value, sparse.count, element);
    sparse.indices_begin = of_indices.begin;
    sparse.values_begin = of_values.begin;
    require_rising(sparse, view.count, place + "/indices");
    view.sparse = sparse;
    return {{"count", sparse.count},
            {"indices",
             {{"bufferView", of_indices.pruned_view},
              {"byteOffset", at_index},
              {"componentType", type}}},
            {"values", {{"bufferView", of_values.pruned_view}, {"byteOffset", at_value}}}};
  }

  void require_rising(const GltfSparse& sparse, std::size_t count, const std::string& at) const {
    for (std::size_t i = 0; i < sparse.count; ++i) {
      const std::size_t number = element_number(sparse, binary_, i);
      if (number >= count || (i > 0 && number <= element_number(sparse, binary_, i - 1))) {
        fail(at, "index " + std::to_string(i) + " is " + std::to_string(number) +
                     "; they must rise and stay below " + std::to_string(count));
      }
    }
  }

  void require_finite(const GltfAccessor& view, const std::string& at) const {
    if (view.component_type != TINYGLTF_COMPONENT_TYPE_FLOAT) return;
    std::array<double, 16> values{};
    for (std::size_t i = 0; i < view.count; ++i) {
      view.read(binary_, i, values.data());
      for (int c = 0; c < view.width; ++c) {
        if (std::abs(values[static_cast<std::size_t>(c)]) <= kLargest) continue;
        fail(at, "element " + std::to_string(i) + " is not a number below 1e30");
      }
    }
  }

  void tell_once(const std::string& message, const std::string& at) {
    if (!told_.insert(message).second) return;
    warnings_.push_back(std::string(name_) + ": " + at + ": " + message);
  }

  const json& source_;
  std::string_view binary_;
  std::size_t bytes_;
  std::string_view name_;
  // Looked through once, then indexed.
  const json& accessors_;
  const json& views_;
  const json& skins_;
  std::vector<std::string>& warnings_;
  json pruned_;
  std::map<std::size_t, std::size_t> pruned_accessors_;  // by index in the file
  std::map<std::size_t, std::size_t> pruned_views_;
  std::vector<std::size_t> sources_;    // of pruned accessors, in the file
  std::vector<GltfAccessor> views_of_;  // the bytes of pruned accessors
  std::set<std::size_t> checked_times_;
  std::set<std::pair<std::size_t, bool>> checked_rotations_;
  std::set<std::string> told_;
  std::size_t objects_ = 0;
  std::size_t numbers_ = 0;
};

/// tinygltf's own reading of a pruned document: no buffers, so it opens no file and decodes
/// nothing.
tinygltf::Model load(const json& pruned, std::string_view name) {
  const std::string text = pruned.dump(-1, ' ', false, json::error_handler_t::replace);
  tinygltf::TinyGLTF loader;
  tinygltf::Model model;
  std::string error;
  std::string warning;
  bool loaded = false;
  try {
    loaded = loader.LoadASCIIFromString(&model, &error, &warning, text.data(),
                                        static_cast<unsigned int>(text.size()), "");
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  if (loaded) return model;
  fail_gltf(name, "", "tinygltf does not read it: " + cited(error));
}

GltfAccessor accessor_of(const tinygltf::Model& model, int index) {
  const tinygltf::Accessor& source = model.accessors.at(static_cast<std::size_t>(index));
  const auto view_of = [&](int view) -> const tinygltf::BufferView& {
    return model.bufferViews.at(static_cast<std::size_t>(view));
  };
  GltfAccessor made;
  made.component_type = source.componentType;
  made.normalized = source.normalized;
  made.width = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(source.type));
  made.count = source.count;
  if (source.bufferView >= 0) {
    const tinygltf::BufferView& view = view_of(source.bufferView);
    made.begin = view.byteOffset + source.byteOffset;
    made.stride = static_cast<std::size_t>(source.ByteStride(view));
  }
  if (source.sparse.isSparse) {
    const auto begin = [&](int view, int offset) {
      return view_of(view).byteOffset + static_cast<std::size_t>(offset);
    };
    made.sparse = GltfSparse{
        static_cast<std::size_t>(source.sparse.count), source.sparse.indices.componentType,
        begin(source.sparse.indices.bufferView, source.sparse.indices.byteOffset),
        begin(source.sparse.values.bufferView, source.sparse.values.byteOffset)};
  }
  return made;
}

/// The rotation nearest to a matrix, and the scale along its axes that is left.
void decompose(GltfNode& node) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(node.linear,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  if (rotation.determinant() < 0.0) rotation = -rotation;
  node.rotation = Eigen::Quaterniond(rotation).normalized();
  node.scale = (rotation.transpose() * node.linear).diagonal();
}

GltfNode node_of(const tinygltf::Node& source) {
  GltfNode node;
  node.name = source.name;
  node.children = source.children;
  if (source.skin >= 0) node.skin = source.skin;
  if (source.matrix.size() == 16) {
    const Eigen::Map<const Eigen::Matrix4d> matrix(source.matrix.data());
    node.has_matrix = true;
    node.translation = matrix.topRightCorner<3, 1>();
    node.linear = matrix.topLeftCorner<3, 3>();
    decompose(node);
    return node;
  }
  if (source.translation.size() == 3) {
    node.translation = Eigen::Vector3d(source.translation.data());
  }
  if (source.rotation.size() == 4) {
    const auto& q = source.rotation;
    node.rotation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized();
  }
  if (source.scale.size() == 3) node.scale = Eigen::Vector3d(source.scale.data());
  node.linear = node.rotation.toRotationMatrix() * node.scale.asDiagonal();
  return node;
}

GltfChannel channel_of(const tinygltf::Model& model, const tinygltf::AnimationChannel& source) {
  const tinygltf::AnimationSampler& sampler =
      model.animations.front().samplers.at(static_cast<std::size_t>(source.sampler));
  GltfChannel channel;
  channel.node = source.target_node;
  channel.times = accessor_of(model, sampler.input);
  channel.values = accessor_of(model, sampler.output);
  if (sampler.interpolation == "STEP") channel.interpolation = GltfInterpolation::kStep;
  if (sampler.interpolation == "CUBICSPLINE") {
    channel.interpolation = GltfInterpolation::kCubicSpline;
  }
  channel.width = channel.values.width;
  if (source.target_path == "rotation") channel.path = GltfPath::kRotation;
  if (source.target_path == "scale") channel.path = GltfPath::kScale;
  if (source.target_path == "weights") {
    channel.path = GltfPath::kWeights;
    const std::size_t parts = channel.interpolation == GltfInterpolation::kCubicSpline ? 3 : 1;
    channel.width = static_cast<int>(channel.values.count / (parts * channel.key_count()));
  }
  return channel;
}

/// A finite number at extras/`key` of an object, if there is one.
const json* extra(const json& object, const char* key) {
  const auto extras = object.find("extras");
  if (extras == object.end() || !extras->is_object()) return nullptr;
  const auto found = extras->find(key);
  return found == extras->end() ? nullptr : &*found;
}

/// `size` finite numbers that we keep in `extras`: taken where they are as we write them, else left
/// alone.
std::optional<std::vector<double>> extra_numbers(const json& object, const char* key,
                                                 std::size_t size) {
  const json* list = extra(object, key);
  if (list == nullptr || !list->is_array() || list->size() != size) return std::nullopt;
  std::vector<double> values;
  for (const json& value : *list) {
    if (!value.is_number() || !(std::abs(value.get<double>()) <= kLargest)) return std::nullopt;
    values.push_back(value.get<double>());
  }
  return values;
}

void read_extras(const json& source, GltfModel& model) {
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    const auto end = extra_numbers(source["nodes"][n], "end_site", 3);
    if (end) model.nodes[n].end_site = Eigen::Vector3d(end->data());
  }
  for (std::size_t s = 0; s < model.skins.size(); ++s) {
    const auto matrix = extra_numbers(source["skins"][s], "model_from_mesh", 16);
    if (matrix) model.skins[s].model_from_mesh = Eigen::Matrix4d(matrix->data());
  }
}

std::vector<std::string> animation_names(const json& animations) {
  std::vector<std::string> names;
  for (const json& animation : animations) {
    const bool named = animation.contains("name") && animation["name"].is_string();
    names.push_back(named ? animation["name"].get<std::string>() : "");
  }
  return names;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMostNames); ++i) {
    text += (i > 0 ? ", " : "") + std::to_string(i) + " " + cited(names[i]);
  }
  return names.size() > kMostNames ? text + ", .." : text;
}

std::size_t choose(const std::vector<std::string>& names, std::string_view file,
                   const std::optional<std::string>& wanted, std::vector<std::string>& warnings) {
  if (names.empty()) {
    throw Error(ErrorKind::kData, std::string(file) +
                                      ": /animations: there are none, so there is no motion to "
                                      "read; export the character with its animation");
  }
  if (!wanted) {
    if (names.size() > 1) {
      warnings.push_back(std::string(file) + ": /animations: the first of " +
                         std::to_string(names.size()) +
                         " is read (--animation chooses): " + listed(names));
    }
    return 0;
  }
  const auto named = std::find(names.begin(), names.end(), *wanted);
  if (named != names.end()) return static_cast<std::size_t>(named - names.begin());
  std::size_t index = names.size();
  const char* const end = wanted->data() + wanted->size();
  const auto [stop, failed] = std::from_chars(wanted->data(), end, index);
  if (failed == std::errc() && stop == end && index < names.size()) return index;
  throw Error(ErrorKind::kUsage, std::string(file) + ": there is no animation " + cited(*wanted) +
                                     "; there are " + listed(names));
}

}  // namespace

void GltfAccessor::read(std::string_view binary, std::size_t element, double* values) const {
  const std::size_t size = bytes_of(component_type);
  std::optional<std::size_t> at;
  if (begin) at = *begin + element * stride;
  if (sparse) {
    std::size_t low = 0;
    std::size_t high = sparse->count;
    while (low < high) {
      const std::size_t middle = low + (high - low) / 2;
      const std::size_t number = element_number(*sparse, binary, middle);
      if (number == element)
        at = sparse->values_begin + middle * size * static_cast<std::size_t>(width);
      if (number < element) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
  }
  for (int c = 0; c < width; ++c) {
    values[c] =
        at ? component(binary, *at + static_cast<std::size_t>(c) * size, component_type, normalized)
           : 0.0;
  }
}

GltfModel read_gltf_model(const GltfDocument& document, std::string_view name,
                          const std::optional<std::string>& animation,
                          std::vector<std::string>& warnings) {
  const json& animations = array_at(name, document.json, "animations", "", true);
  GltfModel model;
  model.animation_names = animation_names(animations);
  model.animation = choose(model.animation_names, name, animation, warnings);
  const json pruned = Pruner(document, name, warnings).prune(model.animation);
  const tinygltf::Model loaded = load(pruned, name);
  for (const tinygltf::Node& node : loaded.nodes) model.nodes.push_back(node_of(node));
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    for (const int child : model.nodes[n].children) {
      model.nodes[static_cast<std::size_t>(child)].parent = static_cast<int>(n);
    }
  }
  for (const tinygltf::Skin& skin : loaded.skins) {
    model.skins.push_back({skin.joints, {}, {}});
    if (skin.inverseBindMatrices >= 0) {
      model.skins.back().inverse_bind = accessor_of(loaded, skin.inverseBindMatrices);
    }
  }
  for (const tinygltf::AnimationChannel& channel : loaded.animations.front().channels) {
    model.channels.push_back(channel_of(loaded, channel));
  }
  read_extras(document.json, model);
  const json* rate = extra(animations[model.animation], "frame_rate_hz");
  if (rate != nullptr && rate->is_number() && rate->get<double>() > 0.0 &&
      rate->get<double>() <= 1e6) {
    model.frame_rate_hz = rate->get<double>();
  }
  return model;
}

}  // namespace laban::io
