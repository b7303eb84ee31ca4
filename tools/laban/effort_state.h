#pragma once

#include <string>
#include <string_view>

#include "styling.h"

namespace laban::cli {

/// What the studio's Effort room is set to, and all that `laban apply --state` needs to make the
/// same clip again, byte for byte. As a file: one JSON object, schema "laban.effort-room/1", whose
/// keys are the options of `laban apply` (DESIGN 9).
struct EffortState {
  std::string input;       ///< path of the clip
  StylingOptions styling;  ///< asked for in numbers: no Effort curve
};

[[nodiscard]] Json to_json(const EffortState& state);

/// @param name  of the file, for messages.
/// @throws Error{kFormat} "name: ..." naming the key: no JSON, another schema, a key that is
/// missing,
///         unknown or of the wrong type, a value beyond the option's limits.
[[nodiscard]] EffortState parse_effort_state(std::string_view text, const std::string& name);
[[nodiscard]] EffortState read_effort_state(const Json& json, const std::string& name);

}  // namespace laban::cli
