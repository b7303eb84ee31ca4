#include <fmt/core.h>

#include "laban/align/segment_input.h"
#include "laban/base/error.h"

#include "files.h"
#include "number_checks.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct SegmentVerb {
  Common common;
  ReadClipOptions reading;
  std::string input;
  std::string model;
  align::SegmentInputOptions options;
};

void run(const SegmentVerb& verb) {
  InputRecord record;
  const transfer::StyleModel model = read_model(verb.model, record);
  const CapturedClip clip = read_captured_clip(verb.input, verb.reading, verb.common);
  const auto result =
      align::segment_input(clip.pose(model.frame_rate_hz()), model.database, verb.options);
  if (!result) {
    throw base::Error(base::ErrorKind::kData,
                      verb.input + ": no chain of fragments fits within --slope; leave it out");
  }
  Json json = {{"schema", "laban.segment/1"},
               {"frame_rate_hz", model.frame_rate_hz()},
               {"cost", result->cost},
               {"rounds", result->rounds},
               {"snippets", Json::array()}};
  if (!verb.common.json) {
    fmt::print("{:>7} {:>7}  {:<12} {:<32} {:>12} {:>12}\n", "begin s", "end s", "content",
               "fragment", "mean cost", "threshold");
  }
  for (const align::Snippet& snippet : result->snippets) {
    const auto fragment = static_cast<std::size_t>(snippet.fragment);
    const double threshold =
        model.match_costs[static_cast<std::size_t>(model.contents.numbers[fragment])].threshold;
    const bool matches = snippet.mean_cost() <= threshold;
    json["snippets"].push_back({{"begin_frame", snippet.begin},
                                {"end_frame", snippet.end},
                                {"content", model.fragments[fragment].content},
                                {"fragment", model.fragments[fragment].name},
                                {"cost", snippet.cost},
                                {"mean_cost", snippet.mean_cost()},
                                {"matches", matches}});
    if (verb.common.json) continue;
    fmt::print("{:7.2f} {:7.2f}  {:<12} {:<32} {:>12.4f} {:>12.4f}{}\n",
               snippet.begin / model.frame_rate_hz(), snippet.end / model.frame_rate_hz(),
               model.fragments[fragment].content, model.fragments[fragment].name,
               snippet.mean_cost(), threshold, matches ? "" : "  no content match");
  }
  if (verb.common.json) fmt::print("{}\n", json.dump(2));
}

}  // namespace

void add_segment(CLI::App& app) {
  auto verb = std::make_shared<SegmentVerb>();
  CLI::App* sub = add_verb(
      app, "segment", "Cut a clip into fragments of the database by one-stage dynamic programming",
      "laban segment dance.bvh --model dance.laban");
  sub->add_option("INPUT", verb->input, "clip")->required();
  sub->add_option("--model", verb->model, "style model (default: the embedded corpus's)");
  sub->add_option("--snippet-cost", verb->options.steps.snippet_cost,
                  "added once a snippet, in units of the distance")
      ->check(number_from_0())
      ->capture_default_str();
  sub->add_option("--slope", verb->options.steps.slope_limit,
                  "a snippet runs at most so many times faster or slower")
      ->check(CLI::Range(2, 100));
  sub->add_option("--offset-rounds", verb->options.offset_rounds,
                  "rounds of estimating the performer's mean pose")
      ->check(CLI::Range(0, 100))
      ->capture_default_str();
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common);
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
