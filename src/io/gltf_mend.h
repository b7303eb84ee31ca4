#pragma once

#include <string>

#include "io/gltf_model.h"

namespace laban::io {

/// Puts right what exporters get wrong about skinned meshes and the Khronos validator minds. No
/// vertex moves: players do the same when they draw.
///
/// - Weights of a vertex that do not add up to 1 are scaled until they do; a joint of no weight
///   becomes joint 0.
/// - A skinned mesh below other nodes moves to the root of its scenes, without the transform of its
///   own that players must ignore. What its parents said of where the mesh was bound is kept in the
///   skin's `extras.model_from_mesh`, by columns. One with children or animated stays where it is.
///
/// What is malformed is left as it is: nothing here is needed to play the clip.
void mend_skinned_meshes(const GltfModel& model, nlohmann::json& document, std::string& binary);

}  // namespace laban::io
