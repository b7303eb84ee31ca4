#include "effort_curve.h"

#include <map>

#include "laban/align/segment_input.h"
#include "laban/base/error.h"
#include "laban/effort/observer.h"

#include "number_checks.h"

namespace laban::cli {
namespace {

/// What more than half of the frames show; empty: nothing does.
std::string content_of_most(const std::map<std::string, int>& frames_of, int frame_count) {
  for (const auto& [content, frames] : frames_of)
    if (2 * frames > frame_count) return content;
  return {};
}

}  // namespace

void add_effort_curve_options(CLI::App* verb, EffortCurveOptions& options) {
  const std::string group = "Measuring Effort";
  verb->add_option(
          "--model", options.model,
          "style model whose reference is measured against (default: the embedded corpus's)")
      ->group(group);
  verb->add_option("--content", options.content,
                   "what is done in the clips (default: found by segmentation)")
      ->group(group);
  verb->add_option("--window", options.window_s, "window of a curve over time, seconds")
      ->check(positive_number())
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
  // The performer's mean pose is not known from one action; segmentation estimates it.
  const auto cut = align::segment_input(pose, model.database);
  if (!cut) return {};
  std::map<std::string, int> frames_of;
  for (const align::Snippet& snippet : cut->snippets) {
    const auto group = static_cast<std::size_t>(
        model.contents.numbers[static_cast<std::size_t>(snippet.fragment)]);
    if (snippet.mean_cost() <= model.match_costs[group].threshold)
      frames_of[model.contents.names[group]] += snippet.end - snippet.begin;
  }
  return content_of_most(frames_of, pose.frame_count());
}

std::string content_of(const transfer::SegmentedInput& segmented) {
  std::map<std::string, int> frames_of;
  for (const transfer::InputSnippet& snippet : segmented.snippets)
    if (snippet.matches()) frames_of[snippet.content] += snippet.end - snippet.begin;
  return content_of_most(frames_of, segmented.input.frame_count());
}

io::MotionTable effort_table(const transfer::StyleModel& model, const motion::PoseMatrix& pose,
                             const std::string& content, double window_s) {
  return {"Effort over time, [-3, 3]",
          pose.frame_rate_hz,
          {"flow", "weight", "time"},
          effort::observe_over_time(pose, model.observer, content, window_s)};
}

}  // namespace laban::cli
