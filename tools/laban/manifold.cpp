#include "manifold.h"

#include <fmt/core.h>

#include "laban/base/sha256.h"
#include "laban/draw/chart_page.h"
#include "laban/manifold/manifold_file.h"
#include "laban/manifold/markov_chain.h"

namespace laban::cli {
namespace {

using Eigen::Index;

/// A point for each frame of the captures as a curve, takes apart.
draw::Curve trajectory(const manifold::PoseManifold& manifold, const Eigen::MatrixXd& points) {
  draw::Curve curve;
  curve.name = "captures";
  const auto& begins = manifold.take_begins;
  for (Index f = 0; f < points.cols(); ++f) {
    if (f > 0 && std::find(begins.begin(), begins.end(), static_cast<int>(f)) != begins.end()) {
      curve.x.push_back(std::nan(""));
      curve.y.push_back(std::nan(""));
    }
    curve.x.push_back(points(0, f));
    curve.y.push_back(points.rows() > 1 ? points(1, f) : 0.0);
  }
  return curve;
}

/// The same of the centres of the primitives, as dots.
draw::Curve centers(const Eigen::MatrixXd& points) {
  draw::Curve curve;
  curve.name = "centres of primitives";
  curve.line = false;
  curve.markers = true;
  for (Index k = 0; k < points.cols(); ++k) {
    curve.x.push_back(points(0, k));
    curve.y.push_back(points.rows() > 1 ? points(1, k) : 0.0);
  }
  return curve;
}

draw::ChartPanel map_panel(const manifold::PoseManifold& manifold) {
  draw::ChartPanel panel;
  panel.title = fmt::format("Map ({} x {})", manifold.som.columns, manifold.som.rows);
  panel.x = {"column", 0.0, manifold.som.columns - 1.0};
  panel.y = {"row", 0.0, manifold.som.rows - 1.0};
  panel.curves = {trajectory(manifold, manifold.points), centers(manifold.primitives.centers)};
  return panel;
}

/// The captures' poses, as the map gives them back, by their first two principal components.
draw::ChartPanel principal_panel(const manifold::PoseManifold& manifold) {
  draw::ChartPanel panel;
  panel.title =
      fmt::format("Principal components ({:.0f} % of variance)", 100.0 * manifold.plane_share());
  panel.x.label = "first, m";
  panel.y.label = "second, m";
  const Eigen::MatrixXd poses = manifold.generator.at_all(manifold.points, manifold::kPoseRowCount);
  panel.curves = {trajectory(manifold, manifold.pca.transform(poses)),
                  centers(manifold.primitives.coordinates)};
  return panel;
}

draw::ChartPanel elbow_panel(const std::vector<double>& errors, int chosen) {
  draw::ChartPanel panel;
  panel.title = fmt::format("Elbow at {} primitives", chosen);
  panel.x.label = "primitives";
  panel.y = {"rms distance, m", 0.0, std::nullopt};
  draw::Curve curve;
  curve.name = "k-means";
  curve.markers = true;
  for (std::size_t k = 0; k < errors.size(); ++k) {
    curve.x.push_back(static_cast<double>(k + 1));
    curve.y.push_back(errors[k]);
  }
  panel.curves = {std::move(curve)};
  panel.marks_x = {static_cast<double>(chosen)};
  return panel;
}

draw::MatrixChart transition_chart(const manifold::PoseManifold& manifold) {
  draw::MatrixChart chart;
  chart.title = "Transitions, row to column";
  chart.values = manifold::transition_matrix(manifold.primitives.counts);
  for (int k = 0; k < manifold.primitives.count(); ++k) {
    chart.row_labels.push_back(std::to_string(k));
  }
  chart.column_labels = chart.row_labels;
  chart.value_label = "probability from frame to frame";
  chart.min = 0.0;
  chart.max = 1.0;
  return chart;
}

/// Row 0 at the bottom, as on the map's own axes.
draw::MatrixChart distance_chart(const manifold::PoseManifold& manifold) {
  draw::MatrixChart chart;
  chart.title = "Distance of neighbouring nodes";
  chart.values = manifold::unit_distances(manifold.som).colwise().reverse();
  chart.value_label = "m";
  return chart;
}

}  // namespace

manifold::PoseManifold read_manifold_file(const std::string& path, InputRecord& record) {
  const std::string bytes = read_bytes(path);
  record = {path, base::sha256_hex(bytes)};
  return manifold::read_manifold(bytes, path);
}

Json describe_manifold(const manifold::PoseManifold& manifold) {
  Json json = {{"map", manifold::name_of(manifold.kind)},
               {"rows", manifold.som.rows},
               {"columns", manifold.som.columns},
               {"frame_rate_hz", manifold.frame_rate_hz},
               {"frames", manifold.points.cols()},
               {"takes", manifold.take_begins.size()},
               {"rig", manifold.rig.humanoid.rig_name()},
               {"explained_share", manifold.plane_share()},
               {"primitive_method", manifold::name_of(manifold.primitives.method)},
               {"primitives", Json::array()}};
  const Eigen::VectorXd stay = manifold::mean_stay(manifold.primitives.counts);
  for (Index k = 0; k < manifold.primitives.count(); ++k) {
    json["primitives"].push_back(
        {{"center", {manifold.primitives.centers(0, k), manifold.primitives.centers(1, k)}},
         {"stay_s", stay[k] / manifold.frame_rate_hz}});
  }
  return json;
}

std::string manifold_text(const manifold::PoseManifold& manifold) {
  std::string text = fmt::format(
      "{} map of {} x {} places, {} frames at {:g} Hz of {} take{}, rig {}\n{} primitives ({}):\n",
      manifold::name_of(manifold.kind), manifold.som.columns, manifold.som.rows,
      manifold.points.cols(), manifold.frame_rate_hz, manifold.take_begins.size(),
      manifold.take_begins.size() == 1 ? "" : "s", manifold.rig.humanoid.rig_name(),
      manifold.primitives.count(), manifold::name_of(manifold.primitives.method));
  const Eigen::VectorXd stay = manifold::mean_stay(manifold.primitives.counts);
  for (Index k = 0; k < manifold.primitives.count(); ++k) {
    std::string next;
    Eigen::RowVectorXd row = manifold.primitives.counts.row(k);
    row[k] = 0.0;
    Index likeliest = 0;
    if (row.maxCoeff(&likeliest) > 0.0) next = fmt::format(", then mostly {}", likeliest);
    text += fmt::format("  {:>3} at {:5.1f},{:<5.1f} {:5.2f} s{}\n", k,
                        manifold.primitives.centers(0, k), manifold.primitives.centers(1, k),
                        stay[k] / manifold.frame_rate_hz, next);
  }
  return text;
}

std::string manifold_picture(const manifold::PoseManifold& manifold,
                             const std::vector<double>& elbow_errors, const std::string& title,
                             bool svg) {
  constexpr double kWidth = 1200.0;
  constexpr double kMaps = 560.0;
  constexpr double kBelow = 430.0;
  draw::LineChart maps;
  maps.title = title;
  maps.panels = {map_panel(manifold), principal_panel(manifold)};
  std::vector<draw::ChartTile> tiles = {{std::move(maps), 0.0, 0.0, kWidth, kMaps},
                                        {transition_chart(manifold), 0.0, kMaps, 430.0, kBelow}};
  double left = 430.0;
  if (manifold.kind == manifold::MapKind::kSom) {
    tiles.push_back({distance_chart(manifold), left, kMaps, 430.0, kBelow});
    left += 430.0;
  }
  if (!elbow_errors.empty()) {
    draw::LineChart elbow;
    elbow.panels = {elbow_panel(elbow_errors, manifold.primitives.count())};
    tiles.push_back({std::move(elbow), left, kMaps, kWidth - left, kBelow});
  }
  draw::ChartOptions options;
  options.format = svg ? draw::Format::kSvg : draw::Format::kPng;
  options.width = kWidth;
  options.height = kMaps + kBelow;
  return draw::chart_page(tiles, options);
}

void add_manifold(CLI::App& app) {
  CLI::App* verb = add_verb(
      app, "manifold", "Learn a map of poses from clips, and make motion by walking on it",
      "laban manifold learn ballet.bvh -o ballet.manifold --picture som.png\n"
      "  laban manifold synthesize ballet.manifold --through 10,12 40,31 20,55 --frames 80 -o "
      "out.bvh\n"
      "  laban manifold synthesize ballet.manifold --keys clip.bvh:0 clip.bvh:60 -o out.bvh\n"
      "  laban manifold synthesize ballet.manifold --start clip.bvh:0 --seconds 30 -o out.bvh");
  verb->require_subcommand(1);
  add_manifold_learn(verb);
  add_manifold_synthesize(verb);
}

}  // namespace laban::cli
