#include <algorithm>
#include <filesystem>
#include <span>

#include <fmt/core.h>

#include "laban/align/segment_input.h"
#include "laban/base/error.h"
#include "laban/draw/line_chart.h"
#include "laban/effort/observer.h"
#include "laban/motion/motion_quality.h"
#include "laban/motion/resample.h"
#include "laban/transfer/styled_clip.h"

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
  std::string against;
};

/// Bars of what a clip may lack in quality beside another one (DESIGN 7).
constexpr double kMostSkate = 1.1;
constexpr double kLeastSkateCm = 0.02;  // less is noise of the capture, whatever the ratio
constexpr double kDeepestToesM = 0.01;
constexpr double kMostJerk = 1.5;

/// A clip's quality figures beside those of another clip, on whose floor it has to stand.
struct QualityCheck {
  motion::MotionQuality clip;
  motion::MotionQuality against;
  effort::Effort against_effort;  ///< as what the clip shows
  /// Cost of aligning the two over the usual one between takes of that content, if it is known.
  std::optional<double> content_ratio;
  std::vector<std::string> found;  ///< bars that are broken
};

QualityCheck check_quality(const CapturedClip& clip, const CapturedClip& against,
                           const std::string& path) {
  const auto floor =
      motion::find_foot_contacts(against.capture.clip, against.capture.humanoid).floor;
  if (!floor) {
    throw base::Error(base::ErrorKind::kData,
                      path + ": no foot ever stands on the ground, so there is no floor");
  }
  // Jerk of two rates does not compare.
  const motion::Clip own =
      motion::resample(clip.capture.clip, against.capture.clip.frame_rate_hz());
  QualityCheck check{
      motion::measure_quality(own, clip.capture.humanoid, *floor),
      motion::measure_quality(against.capture.clip, against.capture.humanoid, *floor),
      {},
      {},
      {}};
  if (check.clip.foot_skate_cm >
      kMostSkate * std::max(check.against.foot_skate_cm, kLeastSkateCm)) {
    check.found.emplace_back("feet skate more than 1.1 times as much");
  }
  if (check.clip.toe_height_m < -kDeepestToesM) {
    check.found.emplace_back("toes sink more than 1 cm into the floor");
  }
  if (check.clip.jerk_m_s3 > kMostJerk * check.against.jerk_m_s3) {
    check.found.emplace_back("jerk is more than 1.5 times as large");
  }
  return check;
}

/// Adds what of the comparison takes a model: content kept, and the other clip's Effort.
void compare_content(const transfer::StyleModel& model, const motion::PoseMatrix& clip,
                     const motion::PoseMatrix& against, const std::string& content_asked,
                     QualityCheck& check) {
  const std::string content = content_of(model, clip, content_asked);
  check.content_ratio = transfer::content_ratio(model, clip, against, content);
  check.against_effort = effort::observe(effort::describe(against), model.observer, content).effort;
}

Json motion_quality_json(const motion::MotionQuality& quality) {
  return {{"foot_skate_cm_per_frame", quality.foot_skate_cm},
          {"toe_height_2nd_percentile_m", quality.toe_height_m},
          {"jerk_rms_m_s3", quality.jerk_m_s3},
          {"spectral_arc_length", quality.spectral_arc_length}};
}

void print_check(const MeasureVerb& verb, const QualityCheck& check) {
  fmt::print("\n{:<40} {:>14} {:>14}\n", "quality", "clip", "against");
  const auto line = [](const char* name, double own, double other) {
    fmt::print("{:<40} {:>14.3f} {:>14.3f}\n", name, own, other);
  };
  line("foot skate, cm per frame at 30 Hz", check.clip.foot_skate_cm, check.against.foot_skate_cm);
  line("toes over the floor, 2nd percentile, cm", 100.0 * check.clip.toe_height_m,
       100.0 * check.against.toe_height_m);
  line("jerk, rms, m/s^3", check.clip.jerk_m_s3, check.against.jerk_m_s3);
  line("spectral arc length of hands and feet", check.clip.spectral_arc_length,
       check.against.spectral_arc_length);
  if (check.content_ratio) {
    fmt::print("{:<40} {:>14.3f}\n", "content: cost over the usual one", *check.content_ratio);
  }
  fmt::print("{:<40} {}\n", "Effort of what it is compared with", to_text(check.against_effort));
  for (const std::string& found : check.found)
    warn(verb.common, verb.inputs.front() + ": " + found);
}

struct Measured {
  std::string path;
  std::string content;
  effort::Descriptors descriptors;
  effort::Observation observation;
};

void print(const MeasureVerb& verb, const std::vector<Measured>& all,
           const std::optional<QualityCheck>& check) {
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
    if (check) {
      json["quality"] = motion_quality_json(check->clip);
      json["against"] = motion_quality_json(check->against);
      json["against"]["clip"] = verb.against;
      json["against"]["effort"] = to_json(check->against_effort);
      json["quality"]["content_cost_ratio"] =
          check->content_ratio ? Json(*check->content_ratio) : Json();
      json["found"] = check->found;
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
  if (check) print_check(verb, *check);
}

/// Snippets of the clip as segmentation sees them, each under the name of what is done in it.
std::vector<draw::ShadedSpan> segments_of(const transfer::StyleModel& model,
                                          const motion::PoseMatrix& pose) {
  std::vector<draw::ShadedSpan> spans;
  const auto cut = align::segment_input(pose, model.database);
  if (!cut) return spans;
  for (const align::Snippet& snippet : cut->snippets) {
    const int group = model.contents.numbers[static_cast<std::size_t>(snippet.fragment)];
    spans.push_back({snippet.begin / pose.frame_rate_hz, snippet.end / pose.frame_rate_hz,
                     model.contents.names[static_cast<std::size_t>(group)]});
  }
  return spans;
}

/// What the curves are measured against, in words.
std::string reference_name(const MeasureVerb& verb, const std::string& content) {
  const std::string corpus = verb.effort.model.empty()
                                 ? "the default model"
                                 : std::filesystem::path(verb.effort.model).filename().string();
  return fmt::format("0 is the middle of {} in {}; window {:g} s",
                     content.empty() ? "all contents" : "'" + content + "'", corpus,
                     verb.effort.window_s);
}

draw::LineChart effort_chart(const MeasureVerb& verb, const transfer::StyleModel& model,
                             const motion::PoseMatrix& pose, const io::MotionTable& curves,
                             const std::string& content) {
  draw::ChartPanel panel;
  panel.title = reference_name(verb, content);
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
  panel.spans = segments_of(model, pose);
  for (std::size_t n = 1; n < panel.spans.size(); ++n)
    panel.marks_x.push_back(panel.spans[n].begin);
  draw::LineChart chart;
  chart.title = "Effort over time, as measured: " + verb.inputs.front();
  chart.panels.push_back(std::move(panel));
  return chart;
}

void write_over_time(const MeasureVerb& verb, const transfer::StyleModel& model,
                     const motion::PoseMatrix& pose, const std::string& content) {
  const io::MotionTable curves = effort_table(model, pose, content, verb.effort.window_s);
  if (!verb.over_time.empty()) write_table(verb.over_time, curves, verb.common);
  if (verb.picture.empty()) return;
  draw::ChartOptions options;
  options.format = is_svg(verb.picture) ? draw::Format::kSvg : draw::Format::kPng;
  write_bytes(verb.picture,
              draw::line_chart(effort_chart(verb, model, pose, curves, content), options),
              verb.common);
}

void run(const MeasureVerb& verb) {
  check_outputs(verb.common, {verb.over_time, verb.picture});
  const bool over_time = !verb.over_time.empty() || !verb.picture.empty();
  if (over_time && verb.inputs.size() != 1) {
    throw base::Error(base::ErrorKind::kUsage, "--over-time and --picture take one clip");
  }
  if (!verb.against.empty() && verb.inputs.size() != 1) {
    throw base::Error(base::ErrorKind::kUsage, "--against compares one clip");
  }
  InputRecord record;
  const transfer::StyleModel model = read_model(verb.effort.model, record);
  std::vector<Measured> all;
  std::optional<QualityCheck> check;
  if (!verb.against.empty()) {
    const CapturedClip clip = read_captured_clip(verb.inputs.front(), verb.reading, verb.common);
    const CapturedClip against = read_captured_clip(verb.against, verb.reading, verb.common);
    check = check_quality(clip, against, verb.against);
    compare_content(model, clip.pose(model.frame_rate_hz()), against.pose(model.frame_rate_hz()),
                    verb.effort.content, *check);
  }
  for (const std::string& path : verb.inputs) {
    const motion::PoseMatrix pose =
        read_captured_clip(path, verb.reading, verb.common).pose(model.frame_rate_hz());
    Measured one{path, content_of(model, pose, verb.effort.content), effort::describe(pose), {}};
    one.observation = effort::observe(one.descriptors, model.observer, one.content);
    if (one.observation.pooled) {
      warn(verb.common,
           path + ": it matches no content of the model; measured against all contents pooled");
    }
    if (over_time) write_over_time(verb, model, pose, one.content);
    all.push_back(std::move(one));
  }
  if (verb.over_time != "-") print(verb, all, check);
  if (check && !check->found.empty()) throw CheckFailed();
}

}  // namespace

void add_measure(CLI::App& app) {
  auto verb = std::make_shared<MeasureVerb>();
  CLI::App* sub = add_verb(app, "measure",
                           "Measure Effort by the kinematic observer, of whole clips or over time",
                           "laban measure walk.bvh --content walk");
  sub->add_option("INPUT", verb->inputs, "clips")->required();
  add_effort_curve_options(sub, verb->effort);
  sub->add_option("--over-time", verb->over_time,
                  "Effort in a window about each frame to write (.csv or .npy)");
  sub->add_option("--picture", verb->picture,
                  "the same to draw, with the snippets of the clip (.png or .svg)");
  sub->add_option("--against", verb->against,
                  "clip to compare feet and smoothness with; exit code 7 if they are worse");
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
