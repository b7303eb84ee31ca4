#pragma once

#include "loop_state.h"
#include "stage.h"
#include "work.h"

namespace laban::studio {

/// Makes loops of the clips that are open: what each request asks for stands in a state
/// (cli::LoopState), and nothing of it is remembered here.
class LoopRoom {
 public:
  LoopRoom(const Stage& stage, Work& work) : stage_(stage), work_(work) {}

  [[nodiscard]] Routes routes();

  /// The state to begin with.
  [[nodiscard]] Json open(const std::string& clip) const;
  /// How symmetrical in time each frame of a clip is, and its turning points.
  [[nodiscard]] Json turns(const Json& request) const;
  /// The loop, with what `laban loop synthesize` reports of it, and its seams' joints by name.
  [[nodiscard]] Response made(const Json& request) const;
  /// The loop as a file, byte for byte what `laban loop synthesize --state` writes.
  [[nodiscard]] Response exported(const Json& request, const std::string& format) const;

 private:
  [[nodiscard]] cli::MadeLoop make(const Json& request) const;

  const Stage& stage_;
  Work& work_;
};

}  // namespace laban::studio
