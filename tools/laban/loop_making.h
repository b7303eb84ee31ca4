#pragma once

#include <vector>

#include "loop.h"
#include "stream.h"

namespace laban::cli {

/// What is to be made of a clip: a seamless loop, or endless motion of a length.
struct LoopChoices {
  SeamChoices seam;
  TurningChoices turning;
  loop::LoopOptions options;
  AskedLength length;
  bool seamless = false;
  bool no_turns = false;
  bool no_seams = false;
  bool no_foot_fix = false;

  /// @throws Error{kUsage} for choices that do not go together.
  [[nodiscard]] loop::LoopOptions resolved() const;
};

/// A loop, and what it is reported by.
struct MadeLoop {
  motion::Clip clip;
  std::vector<double> source_frames;
  std::vector<loop::FoundSeam> seams;
  std::vector<double> marks_s;  ///< where seams begin
  int foot_stances = 0;
  Json details;  ///< of the kind
};

/// @throws Error{kUsage} if the choices do not go together, Error{kData} as the library.
[[nodiscard]] MadeLoop make_loop(const LoopChoices& choices, const CapturedClip& input,
                                 base::Progress* progress = nullptr);

/// The bytes of a loop as the file of that path holds them.
[[nodiscard]] std::string loop_bytes(const CapturedClip& input, const MadeLoop& made,
                                     const std::string& path, const WriteClipOptions& writing,
                                     const Common& common);

/// Lengths, use of the capture, quality and seams: a report but for "output" and "run".
[[nodiscard]] Json loop_report(const CapturedClip& input, const MadeLoop& made);

}  // namespace laban::cli
