#include <fmt/core.h>

#include "laban/align/content_groups.h"
#include "laban/base/csv.h"
#include "laban/base/error.h"
#include "laban/draw/line_chart.h"
#include "laban/effort/observer.h"

#include "files.h"
#include "report.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct MeasureVerb {
  Common common;
  ReadClipOptions reading;
  std::vector<std::string> inputs;
  std::string model;
  std::string content;
  std::string over_time;
  std::string picture;
  double window_s = 1.0;
};

/// The content named, or that of the fragment nearest to the clip if it is near enough; else empty,
/// so that the clip is measured against all contents pooled.
std::string content_of(const MeasureVerb& verb, const transfer::StyleModel& model,
                       const motion::PoseMatrix& pose) {
  if (!verb.content.empty()) {
    if (!model.observer.find(verb.content)) {
      throw base::Error(base::ErrorKind::kUsage, "the model knows no content '" + verb.content +
                                                     "'; 'laban inspect' lists them");
    }
    return verb.content;
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

struct Measured {
  std::string path;
  std::string content;
  effort::Descriptors descriptors;
  effort::Observation observation;
};

void print(const MeasureVerb& verb, const std::vector<Measured>& all) {
  if (verb.common.json) {
    Json json = {{"schema", "laban.measure/1"}, {"clips", Json::array()}};
    for (const Measured& one : all) {
      json["clips"].push_back({{"clip", one.path},
                               {"content", one.content.empty() ? Json() : Json(one.content)},
                               {"pooled_reference", one.observation.pooled},
                               {"effort", to_json(one.observation.effort)},
                               {"unclipped", to_json(one.observation.unclipped)},
                               {"descriptors",
                                {{"flow", one.descriptors.flow},
                                 {"weight", one.descriptors.weight},
                                 {"time", one.descriptors.time}}}});
    }
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{:<40} {:<12} {:>6} {:>6} {:>6}\n", "clip", "content", "flow", "weight", "time");
  for (const Measured& one : all) {
    const effort::Effort& e = one.observation.effort;
    fmt::print("{:<40} {:<12} {:+6.2f} {:+6.2f} {:+6.2f}\n", one.path,
               one.content.empty() ? "(pooled)" : one.content, e.flow, e.weight, e.time);
  }
}

void write_over_time(const MeasureVerb& verb, const motion::PoseMatrix& pose,
                     const Eigen::Matrix3Xd& curves) {
  if (!verb.over_time.empty()) {
    std::string text = base::format_csv_row({"time_s", "flow", "weight", "time"});
    for (Eigen::Index f = 0; f < curves.cols(); ++f) {
      text += base::format_csv_row(
          {base::format_number(static_cast<double>(f) / pose.frame_rate_hz),
           base::format_number(curves(0, f)), base::format_number(curves(1, f)),
           base::format_number(curves(2, f))});
    }
    write_bytes(verb.over_time, text, verb.common);
  }
  if (verb.picture.empty()) return;
  draw::ChartPanel panel;
  panel.x.label = "seconds";
  panel.y = {"Effort", effort::kEffortMin, effort::kEffortMax};
  for (const effort::Factor factor : effort::kFactors) {
    draw::Curve curve;
    curve.name = std::string(effort::name_of(factor));
    for (Eigen::Index f = 0; f < curves.cols(); ++f) {
      curve.x.push_back(static_cast<double>(f) / pose.frame_rate_hz);
      curve.y.push_back(curves(effort::index_of(factor), f));
    }
    panel.curves.push_back(std::move(curve));
  }
  draw::LineChart chart;
  chart.title = "Effort over time, as measured: " + verb.inputs.front();
  chart.panels.push_back(std::move(panel));
  draw::ChartOptions options;
  options.format = is_svg(verb.picture) ? draw::Format::kSvg : draw::Format::kPng;
  write_bytes(verb.picture, draw::line_chart(chart, options), verb.common);
}

void run(const MeasureVerb& verb) {
  check_outputs(verb.common, {verb.over_time, verb.picture});
  const bool over_time = !verb.over_time.empty() || !verb.picture.empty();
  if (over_time && verb.inputs.size() != 1) {
    throw base::Error(base::ErrorKind::kUsage, "--over-time and --picture take one clip");
  }
  InputRecord record;
  const transfer::StyleModel model = read_model(verb.model, record);
  std::vector<Measured> all;
  for (const std::string& path : verb.inputs) {
    const motion::PoseMatrix pose =
        read_captured_clip(path, verb.reading, verb.common).pose(model.frame_rate_hz());
    Measured one{path, content_of(verb, model, pose), effort::describe(pose), {}};
    one.observation = effort::observe(one.descriptors, model.observer, one.content);
    if (one.observation.pooled) {
      warn(verb.common,
           path + ": it matches no content of the model; measured against all contents pooled");
    }
    if (over_time) {
      write_over_time(verb, pose,
                      effort::observe_over_time(pose, model.observer, one.content, verb.window_s));
    }
    all.push_back(std::move(one));
  }
  if (verb.over_time != "-") print(verb, all);
}

}  // namespace

void add_measure(CLI::App& app) {
  auto verb = std::make_shared<MeasureVerb>();
  CLI::App* sub = add_verb(app, "measure",
                           "Measure Effort by the kinematic observer, of whole clips or over time",
                           "laban measure walk.bvh --content walk");
  sub->add_option("INPUT", verb->inputs, "clips")->required();
  sub->add_option(
      "--model", verb->model,
      "style model whose reference is measured against (default: the embedded corpus's)");
  sub->add_option("--content", verb->content,
                  "what is done in the clips (default: found by the nearest fragment)");
  sub->add_option("--over-time", verb->over_time, "curve over time to write (CSV)");
  sub->add_option("--picture", verb->picture, "curve over time to draw (.png or .svg)");
  sub->add_option("--window", verb->window_s, "window of the curve, seconds")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
