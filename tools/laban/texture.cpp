#include "texture.h"

#include <algorithm>
#include <map>

#include <fmt/core.h>

#include "laban/base/sha256.h"
#include "laban/draw/chart_page.h"
#include "laban/texture/texture_file.h"

#include "texture_play.h"

namespace laban::cli {
namespace {

using texture::LearningReport;
using texture::MotionTexture;
using texture::Segment;

/// Segments, frames and lengths of one texton.
struct TextonFacts {
  int segments = 0;
  int frames = 0;
  int shortest = 0;
  int longest = 0;
};

std::vector<TextonFacts> facts_of(const MotionTexture& texture) {
  std::vector<TextonFacts> facts(texture.textons.size());
  for (const Segment& segment : texture.segments) {
    TextonFacts& one = facts[static_cast<std::size_t>(segment.texton)];
    one.shortest = one.segments == 0 ? segment.length : std::min(one.shortest, segment.length);
    one.longest = std::max(one.longest, segment.length);
    one.frames += segment.length;
    ++one.segments;
  }
  return facts;
}

/// The likeliest successor other than the texton itself; -1 if none.
int next_of(const MotionTexture& texture, int texton) {
  Eigen::RowVectorXd row = texture.transition_counts.row(texton);
  row[texton] = 0.0;
  Eigen::Index next = 0;
  return row.maxCoeff(&next) > 0.0 ? static_cast<int>(next) : -1;
}

draw::MatrixChart transition_chart(const MotionTexture& texture) {
  draw::MatrixChart chart;
  chart.title = "Transitions, row to column";
  chart.values = texture::transition_matrix(texture);
  for (int i = 0; i < texture.texton_count(); ++i) chart.row_labels.push_back(std::to_string(i));
  chart.column_labels = chart.row_labels;
  chart.value_label = "probability";
  chart.min = 0.0;
  chart.max = 1.0;
  return chart;
}

draw::ChartPanel likelihood_panel(const LearningReport& report, double frames) {
  draw::ChartPanel panel;
  panel.title = "Learning";
  panel.x.label = "round";
  panel.y.label = "nats a frame above the start";
  draw::Curve curve;
  curve.name = "log-likelihood";
  curve.markers = true;
  curve.x = {0.0};
  curve.y = {0.0};
  for (std::size_t n = 0; n < report.rounds.size(); ++n) {
    curve.x.push_back(static_cast<double>(n + 1));
    curve.y.push_back((report.rounds[n].log_likelihood - report.start_log_likelihood) / frames);
  }
  panel.curves = {std::move(curve)};
  return panel;
}

/// How many segments are at most so long.
draw::ChartPanel length_panel(const MotionTexture& texture) {
  std::vector<double> lengths;
  for (const Segment& segment : texture.segments)
    lengths.push_back(segment.length / texture.frame_rate_hz);
  std::sort(lengths.begin(), lengths.end());
  draw::ChartPanel panel;
  panel.title = "Lengths of segments";
  panel.x = {"s", 0.0, std::nullopt};
  panel.y = {"segments up to that long", 0.0, std::nullopt};
  draw::Curve curve;
  curve.name = "segments";
  for (std::size_t n = 0; n < lengths.size(); ++n) {
    curve.x.push_back(lengths[n]);
    curve.y.push_back(static_cast<double>(n + 1));
  }
  panel.curves = {std::move(curve)};
  return panel;
}

draw::ChartPanel start_panel(const LearningReport& report) {
  draw::ChartPanel panel;
  panel.title = fmt::format("Starts compared: {:.3f}", report.threshold);
  panel.x.label = "threshold";
  panel.y.label = "BIC";
  draw::Curve curve;
  curve.name = "BIC";
  curve.markers = true;
  for (const texture::LearningCandidate& candidate : report.candidates) {
    curve.x.push_back(candidate.threshold);
    curve.y.push_back(candidate.bic);
  }
  panel.curves = {std::move(curve)};
  panel.marks_x = {report.threshold};
  return panel;
}

}  // namespace

texture::MotionTexture read_texture_file(const std::string& path, InputRecord& record) {
  const std::string bytes = read_bytes(path);
  record = {path, base::sha256_hex(bytes)};
  return texture::read_texture(bytes, path);
}

Json describe_texture(const MotionTexture& texture) {
  Json json = {{"frame_rate_hz", texture.frame_rate_hz},
               {"frames", texture.observations.cols()},
               {"takes", texture.takes.size()},
               {"rig", texture.rig.humanoid.rig_name()},
               {"min_frames", texture.min_frames},
               {"segments", texture.segments.size()},
               {"textons", Json::array()}};
  const auto facts = facts_of(texture);
  for (int i = 0; i < texture.texton_count(); ++i) {
    const auto cell = static_cast<std::size_t>(i);
    const int next = next_of(texture, i);
    json["textons"].push_back({{"segments", facts[cell].segments},
                               {"frames", facts[cell].frames},
                               {"shortest", facts[cell].shortest},
                               {"longest", facts[cell].longest},
                               {"states", texture.textons[cell].dimension()},
                               {"next", next < 0 ? Json() : Json(next)}});
  }
  return json;
}

std::string texture_text(const MotionTexture& texture, bool each) {
  std::vector<int> lengths;
  for (const Segment& segment : texture.segments) lengths.push_back(segment.length);
  std::sort(lengths.begin(), lengths.end());
  const auto facts = facts_of(texture);
  const auto repeated = std::count_if(facts.begin(), facts.end(),
                                      [](const TextonFacts& one) { return one.segments > 1; });
  std::string text = fmt::format(
      "{} textons, {} of them seen more than once; {} frames at {:g} Hz of {} take{}, rig {}\n"
      "{} segments of {} to {} frames, half of them up to {}\n",
      texture.texton_count(), repeated, texture.observations.cols(), texture.frame_rate_hz,
      texture.takes.size(), texture.takes.size() == 1 ? "" : "s", texture.rig.humanoid.rig_name(),
      lengths.size(), lengths.front(), lengths.back(), lengths[lengths.size() / 2]);
  if (!each) return text;
  for (int i = 0; i < texture.texton_count(); ++i) {
    const auto cell = static_cast<std::size_t>(i);
    const int next = next_of(texture, i);
    text +=
        fmt::format("  {:>4}: {:>3} segment{} of {} to {} frames, {} states{}\n", i,
                    facts[cell].segments, facts[cell].segments == 1 ? " " : "s",
                    facts[cell].shortest, facts[cell].longest, texture.textons[cell].dimension(),
                    next < 0 ? ", then nothing" : fmt::format(", then mostly {}", next));
  }
  return text;
}

Json to_json(const LearningReport& report) {
  Json json = {{"converged", report.end == texture::LearningEnd::kConverged},
               {"threshold", report.threshold},
               {"bic", report.bic},
               {"start_log_likelihood", report.start_log_likelihood},
               {"start_textons", report.start_textons},
               {"starts", Json::array()},
               {"rounds", Json::array()}};
  for (const texture::LearningCandidate& one : report.candidates) {
    json["starts"].push_back({{"threshold", one.threshold},
                              {"textons", one.textons},
                              {"log_likelihood", one.log_likelihood},
                              {"bic", one.bic}});
  }
  for (const texture::LearningRound& round : report.rounds) {
    json["rounds"].push_back({{"log_likelihood", round.log_likelihood},
                              {"changed_frames", round.changed_frames},
                              {"changed_cuts", round.changed_cuts},
                              {"refits", round.refits},
                              {"refused_refits", round.refused_refits},
                              {"textons", round.textons}});
  }
  return json;
}

LearningReport learning_report(const std::string& record_json, const std::string& path) {
  try {
    const Json json = Json::parse(record_json).at("learning");
    LearningReport report;
    report.end = json.at("converged").get<bool>() ? texture::LearningEnd::kConverged
                                                  : texture::LearningEnd::kMaxRounds;
    report.threshold = json.at("threshold").get<double>();
    report.bic = json.at("bic").get<double>();
    report.start_log_likelihood = json.at("start_log_likelihood").get<double>();
    report.start_textons = json.at("start_textons").get<int>();
    for (const Json& one : json.at("starts")) {
      report.candidates.push_back({one.at("threshold").get<double>(), one.at("textons").get<int>(),
                                   one.at("log_likelihood").get<double>(),
                                   one.at("bic").get<double>()});
    }
    for (const Json& one : json.at("rounds")) {
      report.rounds.push_back({one.at("log_likelihood").get<double>(),
                               one.at("changed_frames").get<int>(),
                               one.at("changed_cuts").get<int>(), one.at("refits").get<int>(),
                               one.at("refused_refits").get<int>(), one.at("textons").get<int>()});
    }
    return report;
  } catch (const Json::exception&) {
    throw base::Error(base::ErrorKind::kFormat,
                      path + ": its record does not say how it was learnt; learn it again");
  }
}

std::string texture_picture(const MotionTexture& texture, const LearningReport& report,
                            const std::string& title, bool svg) {
  constexpr double kWidth = 1400.0;
  constexpr double kHeight = 900.0;
  constexpr double kMatrix = 880.0;
  draw::LineChart curves;
  curves.title = title;
  curves.columns = 1;
  const auto frames = static_cast<double>(texture.observations.cols());
  curves.panels = {likelihood_panel(report, frames), length_panel(texture)};
  if (!report.candidates.empty()) curves.panels.push_back(start_panel(report));
  const std::vector<draw::ChartTile> tiles = {
      {transition_chart(texture), 0.0, 0.0, kMatrix, kHeight},
      {std::move(curves), kMatrix, 0.0, kWidth - kMatrix, kHeight}};
  draw::ChartOptions options;
  options.format = svg ? draw::Format::kSvg : draw::Format::kPng;
  options.width = kWidth;
  options.height = kHeight;
  return draw::chart_page(tiles, options);
}

void add_texture(CLI::App& app) {
  CLI::App* verb = add_verb(
      app, "texture", "Learn a motion texture from hours of capture: textons and what follows what",
      "laban texture learn dance/*.bvh --rate 60 --threshold auto -o dance.texture\n"
      "  laban texture inspect dance.texture --picture transitions.png\n"
      "  laban texture fragments dance.texture --labels fragments.csv\n"
      "  laban texture synthesize dance.texture --seconds 60 -o new.bvh\n"
      "  laban texture synthesize dance.texture --from clip.bvh:0 --to clip.bvh:900 --frames 320 "
      "-o "
      "choreo.bvh\n"
      "  laban texture path dance.texture 12 57 --length 6\n"
      "  laban texture edit dance.texture --texton 12 --pin 40:pose.bvh:0 -o edited.bvh");
  verb->require_subcommand(1);
  add_texture_learn(verb);
  add_texture_inspect(verb);
  add_texture_fragments(verb);
  add_texture_synthesize(verb);
  add_texture_path(verb);
  add_texture_edit(verb);
}

}  // namespace laban::cli
