#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/draw/line_chart.h"
#include "laban/effort/observer.h"

#include "effort_curve.h"
#include "files.h"
#include "report.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct MeasureVerb {
  Common common;
  ReadClipOptions reading;
  std::vector<std::string> inputs;
  EffortCurveOptions effort;
  std::string over_time;
  std::string picture;
};

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

void write_over_time(const MeasureVerb& verb, const io::MotionTable& curves) {
  if (!verb.over_time.empty()) write_table(verb.over_time, curves, verb.common);
  if (verb.picture.empty()) return;
  draw::ChartPanel panel;
  panel.x.label = "seconds";
  panel.y = {"Effort", effort::kEffortMin, effort::kEffortMax};
  for (const effort::Factor factor : effort::kFactors) {
    draw::Curve curve;
    curve.name = std::string(effort::name_of(factor));
    for (Eigen::Index f = 0; f < curves.values.cols(); ++f) {
      curve.x.push_back(static_cast<double>(f) / curves.frame_rate_hz);
      curve.y.push_back(curves.values(effort::index_of(factor), f));
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
  const transfer::StyleModel model = read_model(verb.effort.model, record);
  std::vector<Measured> all;
  for (const std::string& path : verb.inputs) {
    const motion::PoseMatrix pose =
        read_captured_clip(path, verb.reading, verb.common).pose(model.frame_rate_hz());
    Measured one{path, content_of(model, pose, verb.effort.content), effort::describe(pose), {}};
    one.observation = effort::observe(one.descriptors, model.observer, one.content);
    if (one.observation.pooled) {
      warn(verb.common,
           path + ": it matches no content of the model; measured against all contents pooled");
    }
    if (over_time) {
      write_over_time(verb, effort_table(model, pose, one.content, verb.effort.window_s));
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
  add_effort_curve_options(sub, verb->effort);
  sub->add_option("--over-time", verb->over_time, "curve over time to write (.csv or .npy)");
  sub->add_option("--picture", verb->picture, "curve over time to draw (.png or .svg)");
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
