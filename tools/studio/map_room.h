#pragma once

#include "laban/manifold/pose_manifold.h"

#include "map_state.h"
#include "stage.h"
#include "work.h"

namespace laban::studio {

/// Makes motion on a map of poses: what each request asks for stands in a state (cli::MapState),
/// and nothing of it is remembered here.
class MapRoom {
 public:
  /// @param path  of the manifold. @throws as cli::read_manifold_file.
  MapRoom(const Stage& stage, std::string path, Work& work);

  [[nodiscard]] Routes routes();

  /// The map: its size, distances of neighbouring nodes, captures, primitives, and the state to
  /// begin with: a walk from where the captures begin.
  [[nodiscard]] Json open() const;
  /// Where the frames of a clip lie on the map, thinned where it is long.
  [[nodiscard]] Json clip_path(const Json& request) const;
  /// Where one frame of a clip lies, and how far the pose there is from it.
  [[nodiscard]] Json place(const Json& request) const;
  /// The pose at a point, as a motion of one frame.
  [[nodiscard]] Response pose(const Json& request) const;
  /// The motion, and its place on the map in each frame.
  [[nodiscard]] Response made(const Json& request) const;
  /// The motion as a file, byte for byte what `laban manifold synthesize --state` writes.
  [[nodiscard]] Response exported(const Json& request, const std::string& format) const;

 private:
  [[nodiscard]] cli::MadeMapMotion make(const Json& request) const;

  const Stage& stage_;
  Work& work_;
  std::string path_;
  manifold::PoseManifold manifold_;
};

}  // namespace laban::studio
