#include "report.h"

#include <cmath>

#include <fmt/core.h>

#include "number_checks.h"

namespace laban::cli {
Json to_json(const effort::Effort& effort, std::span<const effort::Factor> factors) {
  Json json;
  for (const effort::Factor factor : factors)
    json[std::string(effort::name_of(factor))] = finite_or_null(effort[factor]);
  return json;
}

Json to_json(const transfer::EffortTarget& target, std::span<const effort::Factor> factors) {
  Json json;
  for (const effort::Factor factor : factors) {
    const auto& asked = target.factors[static_cast<std::size_t>(effort::index_of(factor))];
    json[std::string(effort::name_of(factor))] = asked ? Json(*asked) : Json();
  }
  return json;
}

Json to_json(const transfer::AppliedSnippet& snippet,
             const std::optional<effort::Effort>& standard_error,
             const transfer::StyleModel& model) {
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
               {"match_threshold", finite_or_null(snippet.match_threshold)},
               {"kept_as_captured", snippet.kept},
               {"asked", to_json(snippet.asked, model.factors())}};
  if (!snippet.kept) {
    const transfer::BlendChoice& choice = snippet.choice;
    json["fragment_i"] = name(choice.fragment_i);
    json["fragment_j"] = name(choice.fragment_j);
    json["alpha"] = choice.alpha;
    for (const transfer::BlendShare& share : choice.shares())
      json["fragments"].push_back({{"fragment", name(share.fragment)}, {"weight", share.weight}});
    json["predicted"] = to_json(choice.predicted, model.factors());
    json["predicted_standard_error"] =
        standard_error ? to_json(*standard_error, model.factors()) : Json();
    for (const effort::Factor factor : model.factors()) {
      const auto& range = choice.reachable[static_cast<std::size_t>(effort::index_of(factor))];
      json["reachable"][std::string(effort::name_of(factor))] = {range.low, range.high};
    }
  }
  json["measured_before"] = to_json(snippet.before.effort);
  json["measured"] = to_json(snippet.measured.effort);
  return json;
}

std::string to_text(const transfer::AppliedSnippet& snippet,
                    const std::optional<effort::Effort>& standard_error,
                    const transfer::StyleModel& model) {
  const double rate_hz = model.frame_rate_hz();
  std::string blend;
  for (const transfer::BlendShare& share : snippet.choice.shares()) {
    blend += fmt::format("{}{:.3f} {}", blend.empty() ? "" : " + ", share.weight,
                         model.fragments[static_cast<std::size_t>(share.fragment)].name);
  }
  if (snippet.kept) {
    blend = std::string(snippet.asked.is_free() ? "nothing asked" : "no content match") +
            ": kept as captured";
  }
  std::string text =
      fmt::format("{:.2f} s to {:.2f} s  {}  {}\n", snippet.begin / rate_hz, snippet.end / rate_hz,
                  snippet.kept ? "-" : snippet.content, blend);
  text += fmt::format("  {:<8}{:>8}  {:<16}{:<18}{:>8}{:>8}\n", "", "asked", "predicted",
                      "reachable", "measured", "input");
  for (const effort::Factor factor : model.factors()) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    const auto& asked = snippet.asked.factors[f];
    std::string predicted;
    std::string reachable;
    if (!snippet.kept) {
      const transfer::FactorRange& range = snippet.choice.reachable[f];
      predicted = fmt::format("{:+.2f}", snippet.choice.predicted[factor]);
      if (standard_error) predicted += fmt::format(" +- {:.2f}", (*standard_error)[factor]);
      reachable = fmt::format("{:+.2f} .. {:+.2f}", range.low, range.high);
    }
    const auto measured = [&](const effort::Observation& seen) {
      return factor == effort::Factor::kSpace ? "-" : fmt::format("{:+.2f}", seen.effort[factor]);
    };
    text += fmt::format("  {:<8}{:>8}  {:<16}{:<18}{:>8}{:>8}\n", effort::name_of(factor),
                        asked ? fmt::format("{:+.2f}", *asked) : "free", predicted, reachable,
                        measured(snippet.measured), measured(snippet.before));
  }
  return text;
}

Json to_json(const transfer::StyledQuality& quality) {
  return {{"foot_skate_cm_per_frame", finite_or_null(quality.output.foot_skate_cm)},
          {"foot_skate_sources", finite_or_null(quality.source_skate_cm)},
          {"toe_height_2nd_percentile_m", finite_or_null(quality.output.toe_height_m)},
          {"toe_height_sources_m", finite_or_null(quality.source_toe_height_m)},
          {"jerk_rms_m_s3", finite_or_null(quality.output.jerk_m_s3)},
          {"jerk_sources_m_s3", finite_or_null(quality.source_jerk_m_s3)},
          {"spectral_arc_length", finite_or_null(quality.output.spectral_arc_length)},
          {"spectral_arc_length_sources", finite_or_null(quality.source_spectral_arc_length)},
          {"join_acceleration_percentile",
           quality.join_percentile ? finite_or_null(*quality.join_percentile) : Json()}};
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

std::string to_text(const effort::Effort& effort) {
  return fmt::format("{:+.2f} {:+.2f} {:+.2f}", effort.flow, effort.weight, effort.time);
}

void add_search_options(CLI::App* verb, transfer::SearchOptions& options, int& tries) {
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
  verb->add_option(
          "--way", options.way,
          "most fragments of one blend; more than the paper's two are tried where two miss "
          "the target")
      ->check(CLI::Range(2, transfer::kMostWays))
      ->capture_default_str()
      ->group(group);
  verb->add_option("--caution", options.caution,
                   "weight of a prediction's expected error: 0 takes the nearest prediction, "
                   "however unsure, as the paper does")
      ->check(number_from_0())
      ->capture_default_str()
      ->group(group);
  verb->add_option("--stay", options.stay,
                   "weight of factors that are not asked for, to stay near the input's; 0 leaves "
                   "them free to go anywhere, as the paper does")
      ->check(number_from_0())
      ->capture_default_str()
      ->group(group);
  verb->add_option("--tries", tries,
                   "blends that are played and measured for one target, the nearest being kept; 1 "
                   "takes the first answer, as the paper does")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str()
      ->group(group);
}

}  // namespace laban::cli
