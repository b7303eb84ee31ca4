#include "styling.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>

#include <fmt/core.h>

#include "laban/base/error.h"

#include "report.h"

namespace laban::cli {
namespace {

/// Effort points beyond the reachable range that are worth a warning.
constexpr double kFarBeyond = 0.25;

/// How far an asked value lies beyond a range; 0 inside.
double beyond(double asked, const transfer::FactorRange& range) {
  return std::max({0.0, range.low - asked, asked - range.high});
}

/// One line a factor that is asked for far beyond what any snippet's neighbours reach, of the
/// snippet where it is farthest.
std::vector<std::string> unreachable(const Styling& styling, const transfer::AppliedStyle& applied,
                                     const std::string& path) {
  std::vector<std::string> lines;
  for (const effort::Factor factor : styling.model.factors()) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    const transfer::AppliedSnippet* worst = nullptr;
    double farthest = kFarBeyond;
    int count = 0;
    for (const transfer::AppliedSnippet& snippet : applied.snippets) {
      if (snippet.kept || !snippet.asked.factors[f]) continue;
      const double distance = beyond(*snippet.asked.factors[f], snippet.choice.reachable[f]);
      if (distance > kFarBeyond) ++count;
      if (distance <= farthest) continue;
      farthest = distance;
      worst = &snippet;
    }
    if (worst == nullptr) continue;
    const transfer::FactorRange& range = worst->choice.reachable[f];
    const double asked = *worst->asked.factors[f];
    lines.push_back(fmt::format(
        "{}: {} {:+.2f} is out of reach of {} of {} snippets; the nearest that the model has "
        "for '{}' at {:.2f} s is {:+.2f}",
        path, effort::name_of(factor), asked, count, applied.snippets.size(), worst->content,
        worst->begin / styling.model.frame_rate_hz(), asked < range.low ? range.low : range.high));
  }
  return lines;
}

/// One line a stretch of the input that matches no content: its snippets on end.
std::vector<std::string> unmatched(const Styling& styling, const transfer::AppliedStyle& applied,
                                   const std::string& path) {
  const double rate_hz = styling.model.frame_rate_hz();
  const auto matches = [](const transfer::AppliedSnippet& snippet) {
    return snippet.match_cost <= snippet.match_threshold;
  };
  std::vector<std::string> lines;
  const auto end = applied.snippets.end();
  auto from = std::find_if_not(applied.snippets.begin(), end, matches);
  while (from != end) {
    const auto to = std::find_if(from, end, matches);
    lines.push_back(
        fmt::format("{}: {:.2f} s to {:.2f} s match no content of the model; kept as captured",
                    path, from->begin / rate_hz, std::prev(to)->end / rate_hz));
    from = std::find_if_not(to, end, matches);
  }
  return lines;
}

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double skate_over_own_floor_cm(const motion::Capture& capture) {
  const auto floor = motion::find_foot_contacts(capture.clip, capture.humanoid).floor;
  return motion::foot_skate_cm(motion::foot_paths(capture.clip, capture.humanoid),
                               floor.value_or(motion::FootFloor{}).toe_m);
}

}  // namespace

void add_styling_options(CLI::App* verb, StylingOptions& options) {
  add_asked_options(verb, options.asked);
  verb->add_option("--model", options.model, "style model (default: the embedded corpus's)");
  const std::string group = "Style";
  verb->add_option_function<std::string>(
          "--detail",
          [&options](const std::string& detail) {
            options.apply.detail =
                detail == "residual" ? transfer::Detail::kResidual : transfer::Detail::kReplace;
          },
          "what lives on of the performer's own manner: replace (nothing, the paper's way) or "
          "residual (posture and slow manner of the upper body)")
      ->check(CLI::IsMember({"replace", "residual"}))
      ->default_str("replace")
      ->group(group);
  verb->add_option("--strength", options.apply.strength, "from the input, 0, to the full style, 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group(group);
  verb->add_flag("--keep-timing", options.apply.keep_timing,
                 "as many frames as the input, each showing the same moment as the input's")
      ->group(group);
  verb->add_flag("--strict", options.apply.strict, "a part that matches no content is an error")
      ->group(group);
  verb->add_flag("--no-foot-fix", options.no_foot_fix,
                 "leave feet as they are blended: do not hold them where they touch the ground")
      ->group(group);
  add_search_options(verb, options.apply.search, options.apply.tries);
  verb->add_option("--rounds", options.apply.rounds,
                   "rounds in which each snippet is measured where it is joined to the others and "
                   "tried once more; 0 joins what was best by itself, as the paper does")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str()
      ->group("Search");
  add_read_options(verb, options.reading);
}

Styling read_styling(const StylingOptions& options) {
  std::vector<InputRecord> inputs(1);
  transfer::AskedEffort asked = read_asked(options.asked, options.may_ask_nothing, inputs);
  Styling styling{options, std::move(asked), read_model(options.model, inputs.front()), {}};
  styling.options.apply.by_hand = find_blends(options.by_hand, styling.model);
  styling.inputs = std::move(inputs);
  return styling;
}

std::vector<transfer::BlendByHand> find_blends(const std::vector<HandSetBlend>& by_hand,
                                               const transfer::StyleModel& model) {
  const auto index_of = [&](const std::string& name) {
    const auto found =
        std::find_if(model.fragments.begin(), model.fragments.end(),
                     [&](const transfer::Fragment& known) { return known.name == name; });
    if (found == model.fragments.end())
      throw base::Error(base::ErrorKind::kUsage, "the model has no fragment '" + name + "'");
    return static_cast<int>(found - model.fragments.begin());
  };
  std::vector<transfer::BlendByHand> blends;
  for (const HandSetBlend& set : by_hand)
    blends.push_back({set.snippet, index_of(set.fragment_i), index_of(set.fragment_j), set.alpha});
  return blends;
}

double StyledFile::speed() const {
  return seconds_taken > 0.0 ? styled.clip.duration_s() / seconds_taken : 0.0;
}

SegmentedClip segment_clip(const transfer::StyleModel& model, CapturedClip input,
                           const transfer::ApplyOptions& options, base::Progress* progress) {
  const auto begin = Clock::now();
  transfer::SegmentedInput segmented = transfer::segment_input(
      model, input.pose(model.frame_rate_hz()), options.segmentation, progress);
  return {std::move(input), std::move(segmented), seconds_since(begin)};
}

transfer::AppliedStyle restyled(const Styling& styling, const transfer::SegmentedInput& segmented,
                                transfer::PlayMemory& memory, base::Progress* progress) {
  transfer::AppliedStyle applied =
      transfer::restyle(memory, segmented, styling.asked, styling.options.apply, progress);
  const auto measured = transfer::measure_snippets(styling.model, applied);
  for (std::size_t n = 0; n < measured.size(); ++n) applied.snippets[n].measured = measured[n];
  return applied;
}

StyledFile style_segmented(const Styling& styling, SegmentedClip clip, transfer::PlayMemory& memory,
                           base::Progress* progress) {
  const transfer::StyleModel& model = styling.model;
  const motion::Capture& capture = clip.input.capture;
  const auto begin = Clock::now();
  transfer::AppliedStyle applied = restyled(styling, clip.segmented, memory, progress);
  transfer::StyledClip styled =
      transfer::play_style(model, applied, capture, {.hold_feet = !styling.options.no_foot_fix});
  const double seconds_taken = clip.seconds_taken + seconds_since(begin);
  const transfer::StyledQuality quality = transfer::measure_styled(
      styled, transfer::play_sources(model, applied, capture), capture.humanoid);
  const std::optional<double> content =
      transfer::content_ratio(model, applied, clip.segmented.input);
  const double input_skate_cm = skate_over_own_floor_cm(capture);
  std::vector<transfer::BlendChoice> choices;
  for (const transfer::AppliedSnippet& snippet : applied.snippets)
    choices.push_back(snippet.choice);
  auto errors = transfer::standard_errors(model, choices);
  return {std::move(clip.input), std::move(applied),
          std::move(styled),     quality,
          std::move(errors),     content,
          input_skate_cm,        seconds_taken};
}

StyledFile style_file(const Styling& styling, const std::string& path, const Common& common,
                      base::Progress* progress) {
  CapturedClip input = read_captured_clip(path, styling.options.reading, common);
  transfer::PlayMemory memory(styling.model);
  base::ProgressPart cutting(progress, 0.0, 0.5);
  base::ProgressPart choosing(progress, 0.5, 1.0);
  return style_segmented(
      styling, segment_clip(styling.model, std::move(input), styling.options.apply, &cutting),
      memory, &choosing);
}

std::string styled_bytes(const CapturedClip& input, const transfer::StyledClip& styled,
                         const std::string& path, const WriteClipOptions& writing,
                         const Common& common) {
  // The character's file counts its frames from a T-pose, if it has one.
  std::vector<double> source_frames = styled.source_frames;
  for (double& frame : source_frames) frame += input.first_frame();
  return clip_bytes(path, styled.clip, common,
                    {input.file.unit_m, input.file.asset, std::move(source_frames)}, writing);
}

void write_styled(const StyledFile& file, const std::string& path, const WriteClipOptions& writing,
                  const Common& common) {
  write_bytes(path, styled_bytes(file.input, file.styled, path, writing, common), common);
}

std::vector<std::string> cautions(const Styling& styling, const transfer::AppliedStyle& applied,
                                  const std::string& path) {
  std::vector<std::string> lines = unmatched(styling, applied, path);
  const std::vector<std::string> far = unreachable(styling, applied, path);
  lines.insert(lines.end(), far.begin(), far.end());
  return lines;
}

Json options_json(const Styling& styling) {
  const transfer::ApplyOptions& options = styling.options.apply;
  Json json = {{"asked", to_json(styling.options.asked, styling.asked)},
               {"neighbours", options.search.neighbors},
               {"samples", options.search.samples},
               {"caution", options.search.caution},
               {"stay", options.search.stay},
               {"way", options.search.way},
               {"tries", options.tries},
               {"rounds", options.rounds},
               {"detail", transfer::name_of(options.detail)},
               {"strength", options.strength},
               {"keep_timing", options.keep_timing},
               {"strict", options.strict},
               {"join_halflife_s", options.join.halflife_s},
               {"fastest_play", options.fastest_play},
               {"foot_fix", !styling.options.no_foot_fix}};
  for (const HandSetBlend& set : styling.options.by_hand) {
    json["by_hand"].push_back({{"snippet", set.snippet},
                               {"fragments", {set.fragment_i, set.fragment_j}},
                               {"alpha", set.alpha}});
  }
  return json;
}

Json report_json(const Styling& styling, const StyledFile& file) {
  Json json = {{"schema", "laban.apply/1"},
               {"asked", to_json(styling.asked.target)},
               {"snippets", Json::array()}};
  for (std::size_t n = 0; n < file.applied.snippets.size(); ++n) {
    json["snippets"].push_back(
        to_json(file.applied.snippets[n], file.standard_errors[n], styling.model));
  }
  json["quality"] = to_json(file.quality);
  json["quality"]["foot_skate_input"] = file.input_skate_cm;
  json["quality"]["content_cost_ratio"] = file.content_ratio ? Json(*file.content_ratio) : Json();
  json["frame_rate_hz"] = styling.model.frame_rate_hz();
  json["regressor"] = effort::name_of(styling.model.regressor.kind());
  std::vector<InputRecord> inputs = styling.inputs;
  inputs.push_back(file.input.record);
  json["run"] = run_record("apply", options_json(styling), inputs);
  return json;
}

std::string report_text(const Styling& styling, const StyledFile& file) {
  std::string text = fmt::format("asked: {}\n", to_text(styling.options.asked, styling.asked));
  for (std::size_t n = 0; n < file.applied.snippets.size(); ++n)
    text += to_text(file.applied.snippets[n], file.standard_errors[n], styling.model);
  text += to_text(file.quality);
  text += fmt::format(" (input's foot skate {:.3f})\n", file.input_skate_cm);
  if (file.content_ratio) {
    text += fmt::format("content: {:.2f} times the usual cost between two takes of one action\n",
                        *file.content_ratio);
  }
  return text + fmt::format("speed: {:.0f} seconds of motion made per second\n", file.speed());
}

}  // namespace laban::cli
