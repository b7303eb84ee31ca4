#include "laban/transfer/segmented_input.h"

#include <cmath>

#include "laban/base/error.h"

namespace laban::transfer {
namespace {

using base::Error;
using base::ErrorKind;

/// How far the work has come once the input is cut.
constexpr double kCut = 0.9;

void check_input(const StyleModel& model, const motion::PoseMatrix& input) {
  if (std::abs(input.frame_rate_hz - model.frame_rate_hz()) > 1e-6 * model.frame_rate_hz()) {
    throw Error(ErrorKind::kData, "the input has " + std::to_string(input.frame_rate_hz) +
                                      " frames a second, the model " +
                                      std::to_string(model.frame_rate_hz()));
  }
  const int shortest = static_cast<int>(std::ceil(kShortestInputS * model.frame_rate_hz()));
  if (input.frame_count() < shortest) {
    throw Error(ErrorKind::kData, "the input has " + std::to_string(input.frame_count()) +
                                      " frames of motion; style transfer needs at least " +
                                      std::to_string(shortest) + " (a quarter of a second)");
  }
}

InputSnippet describe_snippet(const StyleModel& model, const motion::PoseMatrix& input,
                              const align::Snippet& snippet) {
  const auto group =
      static_cast<std::size_t>(model.contents.numbers[static_cast<std::size_t>(snippet.fragment)]);
  InputSnippet described;
  described.begin = snippet.begin;
  described.end = snippet.end;
  described.fragment = snippet.fragment;
  described.content = model.contents.names[group];
  described.match_cost = snippet.mean_cost();
  described.match_threshold = model.match_costs[group].threshold;
  described.pose = input.slice(snippet.begin, snippet.end);
  described.before =
      effort::observe(effort::describe(described.pose), model.observer, described.content);
  described.contacts = motion::find_foot_contacts(described.pose).contacts;
  return described;
}

}  // namespace

SegmentedInput segment_input(const StyleModel& model, const motion::PoseMatrix& input,
                             const align::SegmentInputOptions& options, base::Progress* progress) {
  check_input(model, input);
  base::ProgressPart cutting(progress, 0.0, kCut);
  const auto segmentation = align::segment_input(input, model.database, options, &cutting);
  if (!segmentation) {
    throw Error(ErrorKind::kData,
                "the input cannot be cut into fragments within the slope limit; leave --slope out");
  }
  SegmentedInput segmented{input, {}};
  for (const align::Snippet& snippet : segmentation->snippets) {
    base::tell(progress, kCut + (1.0 - kCut) * snippet.begin / input.frame_count());
    segmented.snippets.push_back(describe_snippet(model, input, snippet));
  }
  return segmented;
}

}  // namespace laban::transfer
