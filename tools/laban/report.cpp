#include "report.h"

#include <cmath>

#include <fmt/core.h>

namespace laban::cli {
namespace {

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

}  // namespace

Json to_json(const effort::Effort& effort) {
  Json json;
  for (const effort::Factor factor : effort::kFactors)
    json[std::string(effort::name_of(factor))] = number(effort[factor]);
  return json;
}

Json to_json(const transfer::EffortTarget& target) {
  Json json;
  for (const effort::Factor factor : effort::kFactors) {
    const auto& asked = target.factors[static_cast<std::size_t>(effort::index_of(factor))];
    json[std::string(effort::name_of(factor))] = asked ? Json(*asked) : Json();
  }
  return json;
}

Json to_json(const transfer::AppliedSnippet& snippet, const transfer::StyleModel& model) {
  const auto name = [&](int fragment) {
    return model.fragments[static_cast<std::size_t>(fragment)].name;
  };
  Json json = {{"begin_frame", snippet.begin},
               {"end_frame", snippet.end},
               {"output_begin_frame", snippet.output_begin},
               {"output_end_frame", snippet.output_end},
               {"content", snippet.kept ? Json() : Json(snippet.content)},
               {"nearest_fragment", name(snippet.fragment)},
               {"match_cost", snippet.match_cost},
               {"match_threshold", number(snippet.match_threshold)},
               {"kept_as_captured", snippet.kept}};
  if (!snippet.kept) {
    const transfer::BlendChoice& choice = snippet.choice;
    json["fragment_i"] = name(choice.fragment_i);
    json["fragment_j"] = name(choice.fragment_j);
    json["alpha"] = choice.alpha;
    json["predicted"] = to_json(choice.predicted);
    for (const effort::Factor factor : effort::kFactors) {
      const auto& range = choice.reachable[static_cast<std::size_t>(effort::index_of(factor))];
      json["reachable"][std::string(effort::name_of(factor))] = {range.low, range.high};
    }
  }
  json["measured_before"] = to_json(snippet.before.effort);
  json["measured"] = to_json(snippet.measured.effort);
  return json;
}

Json to_json(const transfer::StyledQuality& quality) {
  return {{"foot_skate_cm_per_frame", number(quality.output.foot_skate_cm)},
          {"foot_skate_sources", number(quality.source_skate_cm)},
          {"toe_height_2nd_percentile_m", number(quality.output.toe_height_m)},
          {"toe_height_sources_m", number(quality.source_toe_height_m)},
          {"jerk_rms_m_s3", number(quality.output.jerk_m_s3)},
          {"jerk_sources_m_s3", number(quality.source_jerk_m_s3)},
          {"spectral_arc_length", number(quality.output.spectral_arc_length)},
          {"spectral_arc_length_sources", number(quality.source_spectral_arc_length)},
          {"join_acceleration_percentile",
           quality.join_percentile ? number(*quality.join_percentile) : Json()}};
}

std::string to_text(const transfer::StyledQuality& quality) {
  const double ratio =
      quality.source_jerk_m_s3 > 0.0 ? quality.output.jerk_m_s3 / quality.source_jerk_m_s3 : 1.0;
  return fmt::format(
      "quality: foot skate {:.3f} cm/frame (sources {:.3f}), toes {:+.1f} cm over the floor, jerk "
      "{:.2f} times the sources', joins {}",
      quality.output.foot_skate_cm, quality.source_skate_cm, 100.0 * quality.output.toe_height_m,
      ratio,
      quality.join_percentile ? fmt::format("at the {:.0f}th percentile of their accelerations",
                                            *quality.join_percentile)
                              : "none");
}

std::string to_text(const transfer::EffortTarget& target) {
  std::string text;
  for (const effort::Factor factor : effort::kFactors) {
    const auto& asked = target.factors[static_cast<std::size_t>(effort::index_of(factor))];
    text += fmt::format("{}{} {}", text.empty() ? "" : "  ", effort::name_of(factor),
                        asked ? fmt::format("{:+.2f}", *asked) : "free");
  }
  return text;
}

std::string to_text(const effort::Effort& effort) {
  return fmt::format("{:+.2f} {:+.2f} {:+.2f}", effort.flow, effort.weight, effort.time);
}

void add_target_options(CLI::App* verb, transfer::EffortTarget& target) {
  const std::string group = "Target Effort";
  const char* poles[] = {"-3 Free .. +3 Bound; left out: free to vary", "-3 Light .. +3 Strong",
                         "-3 Sustained .. +3 Sudden"};
  for (const effort::Factor factor : effort::kFactors) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    verb->add_option("--" + std::string(effort::name_of(factor)), target.factors[f], poles[f])
        ->check(CLI::Range(effort::kEffortMin, effort::kEffortMax))
        ->group(group);
  }
}

void add_search_options(CLI::App* verb, transfer::SearchOptions& options) {
  const std::string group = "Search";
  verb->add_option("--neighbours,--neighbors", options.neighbors,
                   "content neighbours of a fragment that are paired")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str()
      ->group(group);
  verb->add_option("--samples", options.samples,
                   "samples of the blend weight a pair, before golden-section search")
      ->check(CLI::Range(2, 10000))
      ->capture_default_str()
      ->group(group);
}

}  // namespace laban::cli
