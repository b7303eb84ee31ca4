#include "effort_curve.h"

#include "laban/align/content_groups.h"
#include "laban/base/error.h"
#include "laban/effort/observer.h"

namespace laban::cli {

void add_effort_curve_options(CLI::App* verb, EffortCurveOptions& options) {
  const std::string group = "Measuring Effort";
  verb->add_option(
          "--model", options.model,
          "style model whose reference is measured against (default: the embedded corpus's)")
      ->group(group);
  verb->add_option("--content", options.content,
                   "what is done in the clips (default: found by the nearest fragment)")
      ->group(group);
  verb->add_option("--window", options.window_s, "window of a curve over time, seconds")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group(group);
}

std::string content_of(const transfer::StyleModel& model, const motion::PoseMatrix& pose,
                       const std::string& named) {
  if (!named.empty()) {
    if (!model.observer.find(named)) {
      throw base::Error(base::ErrorKind::kUsage,
                        "the model knows no content '" + named + "'; 'laban inspect' lists them");
    }
    return named;
  }
  const align::ContentMetric& metric = model.database.metric();
  const auto nearest = align::nearest(metric.features(pose, metric.mean_pose(std::span(&pose, 1))),
                                      model.database.features(), 1);
  const auto fragment = static_cast<std::size_t>(nearest.front().fragment);
  const int group = model.contents.numbers[fragment];
  const bool near =
      nearest.front().mean_cost <= model.match_costs[static_cast<std::size_t>(group)].threshold;
  return near ? model.fragments[fragment].content : "";
}

io::MotionTable effort_table(const transfer::StyleModel& model, const motion::PoseMatrix& pose,
                             const std::string& content, double window_s) {
  return {"Effort over time, [-3, 3]",
          pose.frame_rate_hz,
          {"flow", "weight", "time"},
          effort::observe_over_time(pose, model.observer, content, window_s)};
}

}  // namespace laban::cli
