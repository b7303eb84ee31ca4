#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "io/gltf_document.h"

namespace laban::io {

/// Some elements of an accessor that differ from the bytes it points at, by rising element.
struct GltfSparse {
  std::size_t count = 0;
  int index_type = 0;             ///< glTF component type of the element numbers
  std::size_t indices_begin = 0;  ///< in the document's buffer
  std::size_t values_begin = 0;
};

/// `count` vectors of `width` numbers in a document's buffer. Every element lies inside it and is
/// finite.
struct GltfAccessor {
  int component_type = 0;  ///< of glTF: 5120 int8 .. 5126 float
  bool normalized = false;
  int width = 1;
  std::size_t count = 0;
  std::optional<std::size_t> begin;  ///< in the document's buffer; none: zeros
  std::size_t stride = 0;            ///< bytes from element to element
  std::optional<GltfSparse> sparse;

  /// Puts the `width` numbers of one element into `values`.
  void read(std::string_view binary, std::size_t element, double* values) const;
};

enum class GltfPath { kTranslation, kRotation, kScale, kWeights };
enum class GltfInterpolation { kLinear, kStep, kCubicSpline };

/// What moves one property of one node.
struct GltfChannel {
  int node = 0;
  GltfPath path = GltfPath::kTranslation;
  GltfInterpolation interpolation = GltfInterpolation::kLinear;
  GltfAccessor times;   ///< scalars, seconds, never falling
  GltfAccessor values;  ///< 1 (weights) or `width` numbers an element
  int width = 3;        ///< numbers a key: 3, 4 or as many as the mesh has morph targets

  [[nodiscard]] std::size_t key_count() const noexcept { return times.count; }
};

struct GltfNode {
  std::string name;
  int parent = -1;
  std::vector<int> children;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  /// Rotation and scale together; of a node with a `matrix`, that, which may hold shear besides.
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
  bool has_matrix = false;
  std::optional<int> skin;                  ///< of the mesh it carries
  std::optional<Eigen::Vector3d> end_site;  ///< node space; ours alone (`extras.end_site`)
};

struct GltfSkin {
  std::vector<int> joints;
  std::optional<GltfAccessor> inverse_bind;  ///< a 4 x 4 matrix a joint, by columns
  /// Where the mesh was bound; ours alone (`extras.model_from_mesh`).
  std::optional<Eigen::Matrix4d> model_from_mesh;
};

/// What of a document has to do with motion, every index checked: nodes form disjoint trees, joints
/// and targets are nodes.
struct GltfModel {
  std::vector<GltfNode> nodes;
  std::vector<GltfSkin> skins;
  std::vector<std::string> animation_names;  ///< "" where it has none
  std::size_t animation = 0;                 ///< the one that was chosen
  std::vector<GltfChannel> channels;         ///< of it, at most one a node and path
  std::optional<double> frame_rate_hz;       ///< of it; ours alone (`extras.frame_rate_hz`)
};

/// Checks a document and reads one animation of it: by name, else by index, else the first.
///
/// @throws Error{kFormat} "name: JSON pointer: what"; Error{kUsage} for an animation that is not
///         there, listing those that are; Error{kData} if there is none at all.
[[nodiscard]] GltfModel read_gltf_model(const GltfDocument& document, std::string_view name,
                                        const std::optional<std::string>& animation,
                                        std::vector<std::string>& warnings);

}  // namespace laban::io
