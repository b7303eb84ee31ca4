#include <algorithm>

#include <fmt/core.h>

#include "laban/draw/chart_page.h"
#include "laban/loop/distance_map.h"
#include "laban/loop/turning_points.h"

#include "loop.h"

namespace laban::cli {
namespace {

// Cells a side of a map in a picture: more would not show.
constexpr int kMostCells = 500;

struct LoopTurnsVerb {
  Common common;
  ReadClipOptions reading;
  TurningChoices turning;
  std::string input;
  std::string picture;
};

/// The whole clip, or every n-th frame where that is more than a picture shows.
struct Thinned {
  Eigen::MatrixXd angles;
  int stride = 1;
};

Thinned thinned(const Eigen::MatrixXd& angles) {
  Thinned thin;
  const auto frames = static_cast<int>(angles.cols());
  thin.stride = std::max(1, (frames + kMostCells - 1) / kMostCells);
  thin.angles.resize(angles.rows(), (frames + thin.stride - 1) / thin.stride);
  for (Eigen::Index f = 0; f < thin.angles.cols(); ++f) {
    thin.angles.col(f) = angles.col(f * thin.stride);
  }
  return thin;
}

draw::LineChart symmetry_chart(const loop::Turning& turning, double threshold) {
  draw::Curve curve{"symmetry", {}, {}, {}, {}};
  for (Eigen::Index f = 0; f < turning.symmetry.size(); ++f) {
    curve.x.push_back(static_cast<double>(f));
    curve.y.push_back(turning.symmetry[f] < 0.0 ? std::nan("") : turning.symmetry[f]);
  }
  draw::Curve points{"turning points", {}, {}, {}, {}};
  points.line = false;
  points.markers = true;
  for (const loop::TurningPoint& point : turning.points) {
    points.x.push_back(point.frame);
    points.y.push_back(point.symmetry);
  }
  draw::Curve least{"threshold",
                    {0.0, static_cast<double>(turning.symmetry.size() - 1)},
                    {threshold, threshold},
                    {},
                    {}};
  least.dashed = true;
  draw::ChartPanel panel;
  panel.x = {"frame", 0.0,
             static_cast<double>(std::max<Eigen::Index>(1, turning.symmetry.size() - 1))};
  panel.y = {"symmetry", 0.0, 1.0};
  panel.curves = {std::move(curve), std::move(points), std::move(least)};
  draw::LineChart chart;
  chart.title = "Symmetry in time of each frame";
  chart.panels = {std::move(panel)};
  return chart;
}

std::string picture(const LoopTurnsVerb& verb, const Eigen::MatrixXd& angles, double rate_hz,
                    const loop::Turning& turning) {
  const Thinned thin = thinned(angles);
  const std::string every =
      thin.stride > 1 ? fmt::format(" (every {}th frame)", thin.stride) : std::string();
  draw::MatrixChart l2;
  l2.title = "L2" + every;
  l2.values = Eigen::MatrixXd::Ones(thin.angles.cols(), thin.angles.cols()) -
              loop::l2_similarity(thin.angles);
  l2.value_label = "1 - similarity";
  draw::MatrixChart mahalanobis;
  mahalanobis.title = "Mahalanobis" + every;
  // Of the velocities of all frames, not of those that are left.
  mahalanobis.values =
      loop::mahalanobis_distance(thin.angles, loop::velocity_variance(angles, rate_hz));
  mahalanobis.value_label = "distance, s^2";
  constexpr double kMapWidth = 500.0;
  constexpr double kMapHeight = 440.0;
  constexpr double kCurveHeight = 300.0;
  const draw::ChartTile tiles[] = {{l2, 0.0, 0.0, kMapWidth, kMapHeight},
                                   {mahalanobis, kMapWidth, 0.0, kMapWidth, kMapHeight},
                                   {symmetry_chart(turning, verb.turning.options.threshold), 0.0,
                                    kMapHeight, 2.0 * kMapWidth, kCurveHeight}};
  draw::ChartOptions options;
  options.format = is_svg(verb.picture) ? draw::Format::kSvg : draw::Format::kPng;
  options.width = 2.0 * kMapWidth;
  options.height = kMapHeight + kCurveHeight;
  return draw::chart_page(tiles, options);
}

void run(const LoopTurnsVerb& verb) {
  check_outputs(verb.common, {verb.picture});
  if (!verb.picture.empty()) (void)is_svg(verb.picture);
  const CapturedClip input = read_captured_clip(verb.input, verb.reading, verb.common);
  const motion::PoseMatrix pose = input.pose();
  const loop::Turning turning =
      loop::find_turning_points(pose.angles, pose.frame_rate_hz, verb.turning.resolved());
  if (!verb.picture.empty()) {
    write_bytes(verb.picture, picture(verb, pose.angles, pose.frame_rate_hz, turning), verb.common);
  }
  if (verb.common.json) {
    Json json = {{"schema", "laban.loop_turns/1"},
                 {"frames", pose.frame_count()},
                 {"frame_rate_hz", pose.frame_rate_hz},
                 {"first_symmetry", turning.first_symmetry},
                 {"last_symmetry", turning.last_symmetry},
                 {"turning_points", Json::array()},
                 {"symmetry", Json::array()}};
    for (const loop::TurningPoint& point : turning.points) {
      json["turning_points"].push_back({{"frame", point.frame},
                                        {"seconds", point.frame / pose.frame_rate_hz},
                                        {"symmetry", point.symmetry},
                                        {"most_probability", point.most_probability()}});
    }
    for (const double value : turning.symmetry) {
      json["symmetry"].push_back(value < 0.0 ? Json() : Json(value));
    }
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("frame  seconds  symmetry  P_max\n");
  for (const loop::TurningPoint& point : turning.points) {
    fmt::print("{:5d}  {:7.2f}  {:8.3f}  {:5.3f}\n", point.frame, point.frame / pose.frame_rate_hz,
               point.symmetry, point.most_probability());
  }
  fmt::print("ends: first {:.3f}, last {:.3f}\n", turning.first_symmetry, turning.last_symmetry);
}

}  // namespace

void add_loop_turns(CLI::App* loop) {
  auto verb = std::make_shared<LoopTurnsVerb>();
  CLI::App* sub = add_verb(*loop, "turns", "Tell where a clip can be played backwards from",
                           "laban loop turns clip.bvh --picture turns.png");
  sub->add_option("INPUT", verb->input, "clip, '-' for stdin")->required();
  sub->add_option("--picture", verb->picture,
                  "picture to write (.png or .svg): both distance maps, symmetry, turning points");
  add_turning_options(sub, verb->turning);
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
