#pragma once

#include <string>
#include <string_view>

#include "loop_making.h"

namespace laban::cli {

/// What the studio's loop room is set to, and all that `laban loop synthesize --state` needs to
/// make the same clip again, byte for byte. As a file: one JSON object, schema "laban.loop-room/1",
/// whose keys are the options of that verb (DESIGN 9).
struct LoopState {
  std::string input;  ///< path of the clip
  ReadClipOptions reading;
  LoopChoices choices;  ///< a length in seconds
};

[[nodiscard]] Json to_json(const LoopState& state);

/// @param name  of the file, for messages.
/// @throws Error{kFormat} "name: ..." naming the key: no JSON, another schema, a key that is
///         missing, unknown or of the wrong type, a value beyond the option's limits.
[[nodiscard]] LoopState parse_loop_state(std::string_view text, const std::string& name);
[[nodiscard]] LoopState read_loop_state(const Json& json, const std::string& name);

}  // namespace laban::cli
