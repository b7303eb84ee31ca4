#pragma once

#include <vector>

#include "laban/io/gltf.h"

#include "io/gltf_model.h"

namespace laban::io {

inline std::size_t at(int index) {
  return static_cast<std::size_t>(index);
}

/// One joint of the clip on its node.
struct GltfJoint {
  int node = 0;
  /// Model-space rotation of the node in the rest pose: a joint's rotation in the clip is
  /// model_from_node * rest_rotation^-1.
  Eigen::Quaterniond rest_rotation = Eigen::Quaterniond::Identity();
};

class GltfAsset {
 public:
  GltfAsset(GltfDocument document_value, GltfModel model_value)
      : document(std::move(document_value)), model(std::move(model_value)) {}

  const GltfDocument document;
  const GltfModel model;
  std::vector<int> ancestors;     ///< nodes above the root joint, topmost first
  std::vector<GltfJoint> joints;  ///< in the clip's order
  double unit_m = 1.0;
  double begin_s = 0.0;  ///< time of frame 0
  double frame_rate_hz = 30.0;
};

}  // namespace laban::io
