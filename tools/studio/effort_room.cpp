#include "effort_room.h"

#include <algorithm>

#include "effort_curve.h"
#include "report.h"

namespace laban::studio {
namespace {

/// Pairs that are told as runners-up.
constexpr int kRunnersUp = 12;
/// Points of a curve of Effort against alpha.
constexpr int kCurvePoints = 61;
/// Window in which Effort over time is measured, seconds; `laban measure`'s.
constexpr double kWindowS = 1.0;

cli::Styling styling_of(const Stage& stage, const std::string& model) {
  cli::StylingOptions options;
  options.model = model;
  options.reading = stage.reading();
  std::vector<cli::InputRecord> inputs(1);
  transfer::StyleModel read = cli::read_model(model, inputs.front());
  return {std::move(options), {}, std::move(read), std::move(inputs)};
}

std::optional<effort::Effort> standard_error_of(const transfer::StyleModel& model,
                                                const transfer::AppliedSnippet& snippet) {
  return transfer::standard_errors(model, std::span(&snippet.choice, 1)).front();
}

std::vector<double> curve_alphas() {
  std::vector<double> alphas;
  for (int n = 0; n < kCurvePoints; ++n) {
    alphas.push_back(blend::kMinAlpha +
                     (blend::kMaxAlpha - blend::kMinAlpha) * n / (kCurvePoints - 1));
  }
  return alphas;
}

}  // namespace

EffortRoom::EffortRoom(const Stage& stage, const std::string& model, Work& work)
    : stage_(stage), work_(work), styling_(styling_of(stage, model)), memory_(styling_.model) {}

Routes EffortRoom::routes() {
  return {{"POST /api/effort/open",
           json_route([this](const Json& request) { return open(text_at(request, "clip")); })},
          {"POST /api/effort/style",
           [this](const Request& request) { return style(parsed_body(request)); }},
          {"POST /api/effort/snippet",
           json_route([this](const Json& request) { return snippet(request); })},
          {"POST /api/effort/over-time",
           json_route([this](const Json& request) { return over_time(request); })},
          {"POST /api/effort/state", state_route(cli::read_effort_state)},
          {"POST /api/effort/export", [this](const Request& request) {
             return exported(parsed_body(request), query_value(request, "format"));
           }}};
}

const cli::SegmentedClip& EffortRoom::segmented(const std::string& clip) {
  const auto known = segmented_.find(clip);
  if (known != segmented_.end()) return known->second;
  const OpenClip& open = stage_.at(clip);
  return segmented_
      .emplace(clip, cli::naming(open.path,
                                 [&] {
                                   return cli::segment_clip(styling_.model, open.clip,
                                                            styling_.options.apply, &work_);
                                 }))
      .first->second;
}

void EffortRoom::take(const Json& json) {
  cli::EffortState state = cli::read_effort_state(json, "the state");
  if (state.styling.model != styling_.options.model) {
    throw HttpError(409, "the state is of the model '" + state.styling.model +
                             "'; open it with: laban studio --model " + state.styling.model);
  }
  styling_.asked =
      cli::read_asked(state.styling.asked, state.styling.may_ask_nothing, styling_.inputs);
  styling_.options = std::move(state.styling);
  styling_.options.apply.by_hand = cli::find_blends(styling_.options.by_hand, styling_.model);
}

transfer::AppliedStyle EffortRoom::applied(const cli::SegmentedClip& clip) {
  return cli::restyled(styling_, clip.segmented, memory_, &work_);
}

transfer::StyledClip EffortRoom::played(const cli::SegmentedClip& clip,
                                        const transfer::AppliedStyle& applied) const {
  return transfer::play_style(styling_.model, applied, clip.input.capture,
                              {.hold_feet = !styling_.options.no_foot_fix});
}

Json EffortRoom::open(const std::string& id) {
  const cli::SegmentedClip& clip = segmented(id);
  const transfer::StyleModel& model = styling_.model;
  cli::EffortState state{stage_.at(id).path, {}};
  state.styling.model = styling_.options.model;
  state.styling.reading = stage_.reading();
  state.styling.asked.weights.assign(model.factors().size(), 1.0);
  Json json = {{"factors", Json::array()},
               {"model",
                {{"name", styling_.inputs.front().path},
                 {"contents", model.contents.names},
                 {"frame_rate_hz", model.frame_rate_hz()},
                 {"labels_measured", model.labels_measured}}},
               {"state", to_json(state)},
               {"snippets", Json::array()}};
  for (const effort::Factor factor : model.factors())
    json["factors"].push_back(effort::name_of(factor));
  const double rate_hz = model.frame_rate_hz();
  for (const transfer::InputSnippet& snippet : clip.segmented.snippets) {
    json["snippets"].push_back({{"begin_s", snippet.begin / rate_hz},
                                {"end_s", snippet.end / rate_hz},
                                {"content", snippet.content},
                                {"matches", snippet.matches()},
                                {"match_cost", snippet.match_cost},
                                {"match_threshold", cli::finite_or_null(snippet.match_threshold)},
                                {"before", cli::to_json(snippet.before.effort)}});
  }
  return json;
}

Json EffortRoom::report(const cli::SegmentedClip& clip, const transfer::AppliedStyle& applied,
                        const transfer::StyledClip& styled, bool draft) const {
  Json json = {{"asked", cli::to_json(styling_.asked.target, styling_.model.factors())},
               {"snippets", Json::array()}};
  std::vector<transfer::BlendChoice> choices;
  for (const transfer::AppliedSnippet& snippet : applied.snippets)
    choices.push_back(snippet.choice);
  const auto errors = transfer::standard_errors(styling_.model, choices);
  for (std::size_t n = 0; n < applied.snippets.size(); ++n)
    json["snippets"].push_back(cli::to_json(applied.snippets[n], errors[n], styling_.model));
  if (!draft) {
    const motion::Capture& capture = clip.input.capture;
    json["quality"] = cli::to_json(transfer::measure_styled(
        styled, transfer::play_sources(styling_.model, applied, capture), capture.humanoid));
  }
  return json;
}

Response EffortRoom::style(const Json& request) {
  const std::string id = text_at(request, "clip");
  const bool draft = request.value("draft", false);
  const cli::SegmentedClip& clip = segmented(id);
  take(at(request, "state"));
  if (draft) {
    styling_.options.apply.tries = 1;
    styling_.options.apply.rounds = 0;
  }
  const transfer::AppliedStyle applied = this->applied(clip);
  const transfer::StyledClip styled = played(clip, applied);
  MotionMessage message{styled.clip, clip.input.capture.humanoid, styled.source_frames};
  message.more = {{"report", report(clip, applied, styled, draft)},
                  {"joins", styled.joins},
                  {"cautions", cli::cautions(styling_, applied, stage_.at(id).name())}};
  return {200, "application/x-laban-motion", motion_bytes(message)};
}

Json EffortRoom::snippet(const Json& request) {
  const cli::SegmentedClip& clip = segmented(text_at(request, "clip"));
  const auto n = static_cast<std::size_t>(
      index_at(request, "snippet", static_cast<int>(clip.segmented.snippets.size())));
  take(at(request, "state"));
  const transfer::AppliedSnippet chosen = applied(clip).snippets[n];
  const transfer::StyleModel& model = styling_.model;
  const auto name = [&](int fragment) {
    return model.fragments[static_cast<std::size_t>(fragment)].name;
  };
  Json json = {{"played", cli::to_json(chosen, standard_error_of(model, chosen), model)},
               {"runners_up", Json::array()},
               {"curves", Json()}};
  if (!chosen.asked.is_free()) {
    const transfer::BlendSearch& search =
        memory_.search(chosen.fragment, styling_.options.apply.search);
    for (const transfer::BlendChoice& choice : search.nearest_pairs(chosen.asked, kRunnersUp)) {
      json["runners_up"].push_back(
          {{"fragments", {name(choice.fragment_i), name(choice.fragment_j)}},
           {"alpha", choice.alpha},
           {"predicted", cli::to_json(choice.predicted, model.factors())},
           {"distance", choice.distance}});
    }
  }
  if (chosen.kept || chosen.choice.is_seed()) return json;
  const std::vector<double> alphas = curve_alphas();
  const int i = chosen.choice.fragment_i;
  const int j = chosen.choice.fragment_j;
  const effort::EffortMatrix curves = transfer::effort_curve(model, i, j, alphas);
  const auto with_error = transfer::effort_curve_with_error(model, i, j, alphas);
  json["curves"] = {{"fragments", {name(i), name(j)}}, {"alphas", alphas}, {"error", Json()}};
  for (const effort::Factor factor : model.factors()) {
    const std::string key(effort::name_of(factor));
    const int row = effort::index_of(factor);
    for (Eigen::Index m = 0; m < curves.cols(); ++m) {
      json["curves"]["predicted"][key].push_back(curves(row, m));
      if (with_error) json["curves"]["error"][key].push_back(with_error->standard_error(row, m));
    }
  }
  return json;
}

Json EffortRoom::over_time(const Json& request) {
  const cli::SegmentedClip& clip = segmented(text_at(request, "clip"));
  const transfer::StyleModel& model = styling_.model;
  const std::string content = cli::content_of(clip.segmented);
  const auto measured = [&](const motion::PoseMatrix& pose) {
    const io::MotionTable table = cli::effort_table(model, pose, content, kWindowS);
    Json json = {{"seconds", Json::array()}, {"effort", Json::object()}};
    for (Eigen::Index f = 0; f < table.values.cols(); ++f)
      json["seconds"].push_back(static_cast<double>(f) / table.frame_rate_hz);
    for (const effort::Factor factor : effort::kFactors) {
      Json& row = json["effort"][std::string(effort::name_of(factor))];
      for (Eigen::Index f = 0; f < table.values.cols(); ++f)
        row.push_back(cli::finite_or_null(table.values(effort::index_of(factor), f)));
    }
    return json;
  };
  if (at(request, "state").is_null()) return measured(clip.segmented.input);
  take(at(request, "state"));
  return measured(applied(clip).pose);
}

Response EffortRoom::exported(const Json& request, const std::string& format) {
  require_clip_format(format);
  const std::string id = text_at(request, "clip");
  const cli::SegmentedClip& clip = segmented(id);
  take(at(request, "state"));
  const transfer::AppliedStyle applied = this->applied(clip);
  const std::string name = stage_.at(id).made_name("styled", format);
  return {200, "application/octet-stream",
          cli::styled_bytes(clip.input, played(clip, applied), name, {}, stage_.common()), name};
}

}  // namespace laban::studio
