#pragma once

#include "laban/loop/endless_loop.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {

/// The parts of `laban loop`, a file each.
void add_loop_synthesize(CLI::App* loop);
void add_loop_turns(CLI::App* loop);
void add_loop_join(CLI::App* loop);

/// Adds --texton-frames, --overlap, --blend-frames, --seam-metric, --no-poisson.
struct SeamChoices {
  loop::SeamOptions options;
  std::string metric = "difference";
  bool no_poisson = false;

  [[nodiscard]] loop::SeamOptions resolved() const;
};
void add_seam_options(CLI::App* verb, SeamChoices& choices);

/// Adds --distance, --window, --falloff, --threshold.
struct TurningChoices {
  loop::TurningPointOptions options;
  std::string distance = "mahalanobis";

  [[nodiscard]] loop::TurningPointOptions resolved() const;
};
void add_turning_options(CLI::App* verb, TurningChoices& choices);

/// A seam for reports; `joints` are those of the rig's names that have a switch frame.
[[nodiscard]] Json to_json(const loop::FoundSeam& seam);
[[nodiscard]] Json to_json(const SeamChoices& choices);
[[nodiscard]] Json to_json(const TurningChoices& choices);
/// The same in one line.
[[nodiscard]] std::string to_text(const loop::FoundSeam& seam);

/// A contact sheet: one clip above another, seams marked.
[[nodiscard]] std::string loop_picture(const std::string& path, const motion::Humanoid& humanoid,
                                       const motion::Clip& input, const std::string& input_title,
                                       const motion::Clip& output, const std::string& output_title,
                                       const std::vector<double>& marks_s);

}  // namespace laban::cli
