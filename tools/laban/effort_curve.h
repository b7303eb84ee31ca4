#pragma once

#include "laban/io/motion_table.h"
#include "laban/transfer/apply_style.h"

#include "files.h"

namespace laban::cli {

/// How Effort is measured over time.
struct EffortCurveOptions {
  std::string model;      ///< path; empty: the default model
  std::string content;    ///< what is done in the clip; empty: found by segmentation
  double window_s = 1.0;  ///< length of the window that slides over the clip
};

/// Adds --model, --content and --window.
void add_effort_curve_options(CLI::App* verb, EffortCurveOptions& options);

/// The content named, or the one that more than half of the clip's frames match; else empty, so
/// that the clip is measured against all contents pooled.
/// @param pose  at the model's frame rate.
/// @throws Error{kUsage} if the model does not know the content named.
[[nodiscard]] std::string content_of(const transfer::StyleModel& model,
                                     const motion::PoseMatrix& pose, const std::string& named);

/// The same of a clip that is cut already.
[[nodiscard]] std::string content_of(const transfer::SegmentedInput& segmented);

/// Flow, Weight and Time over time, as the kinematic observer sees them.
[[nodiscard]] io::MotionTable effort_table(const transfer::StyleModel& model,
                                           const motion::PoseMatrix& pose,
                                           const std::string& content, double window_s);

}  // namespace laban::cli
