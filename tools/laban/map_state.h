#pragma once

#include <string>
#include <string_view>

#include "files.h"
#include "map_making.h"

namespace laban::cli {

/// What the studio's map room is set to, and all that `laban manifold synthesize --state` needs to
/// make the same clip again, byte for byte. As a file: one JSON object, schema "laban.map-room/1"
/// (DESIGN 9).
struct MapState {
  std::string manifold;  ///< path
  MapChoices choices;
  /// What each point was pinned by, "walk.bvh:60", for the eye; empty: by hand. One a point.
  std::vector<std::string> keys;
};

[[nodiscard]] Json to_json(const MapState& state);

/// @param name  of the file, for messages.
/// @throws Error{kFormat} "name: ..." naming the key: no JSON, another schema, a key that is
///         missing, unknown or of the wrong type, a value beyond the option's limits.
[[nodiscard]] MapState parse_map_state(std::string_view text, const std::string& name);
[[nodiscard]] MapState read_map_state(const Json& json, const std::string& name);

}  // namespace laban::cli
