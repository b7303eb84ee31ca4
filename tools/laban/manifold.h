#pragma once

#include <string>
#include <utility>

#include "laban/manifold/pose_manifold.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {

/// The parts of `laban manifold`, a file each.
void add_manifold_learn(CLI::App* manifold);
void add_manifold_synthesize(CLI::App* manifold);

/// Reads a `.manifold` file. @throws naming it.
[[nodiscard]] manifold::PoseManifold read_manifold_file(const std::string& path,
                                                        InputRecord& record);

/// What is in a manifold, as JSON of `laban inspect` and as lines of text.
[[nodiscard]] Json describe_manifold(const manifold::PoseManifold& manifold);
[[nodiscard]] std::string manifold_text(const manifold::PoseManifold& manifold);

/// Maps by best-matching units and by principal components with their primitives, the map's
/// distances between neighbouring nodes, the transitions and, if given, the elbow: one picture.
[[nodiscard]] std::string manifold_picture(const manifold::PoseManifold& manifold,
                                           const std::vector<double>& elbow_errors,
                                           const std::string& title, bool svg);

}  // namespace laban::cli
