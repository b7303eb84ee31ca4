#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "laban/base/progress.h"
#include "laban/manifold/map_path.h"
#include "laban/manifold/pose_manifold.h"

namespace laban::cli {

/// What is to be made on a map of poses: a motion through points, or a walk from one.
struct MapChoices {
  bool walks = false;
  Eigen::Matrix2Xd points{2, 0};  ///< columns and rows of the map; a walk begins at the first
  std::optional<int> frames;      ///< of a motion through points; nullopt: as the captures move
  manifold::WalkOptions walk;
  std::string travel = "contacts";  ///< "contacts", "primitives" or "none"
  bool no_foot_fix = false;
  std::uint64_t seed = 1;  ///< of a walk
};

struct MadeMapMotion {
  manifold::MapPath path;
  motion::Clip clip;
};

/// @throws as manifold::path_through, manifold::markov_path and manifold::play.
[[nodiscard]] MadeMapMotion make_map_motion(const manifold::PoseManifold& manifold,
                                            const MapChoices& choices,
                                            base::Progress* progress = nullptr);

}  // namespace laban::cli
