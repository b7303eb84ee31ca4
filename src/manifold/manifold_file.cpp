#include "laban/manifold/manifold_file.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "laban/base/container.h"
#include "laban/base/version.h"
#include "laban/motion/stored_rig.h"

#include "manifold/pose_channels.h"

namespace laban::manifold {
namespace {

using base::Container;
using Eigen::Index;
using Eigen::MatrixXd;
using motion::PartReader;
using motion::to_array;
using nlohmann::json;

constexpr const char* kKind = "laban.manifold";
constexpr int kVersion = 1;

constexpr const char* kMend = "learn the manifold again";
constexpr Index kMaxPrimitives = 1000;

// ---- the plane ----

template <typename Kind>
Kind kind_named(const PartReader& reader, const std::string& name,
                std::initializer_list<Kind> kinds) {
  for (const Kind kind : kinds) {
    if (name == name_of(kind)) return kind;
  }
  reader.require(false, "it says '" + name + "', which this laban does not know");
  return {};
}

RadialBasis basis_named(const PartReader& reader, const std::string& name) {
  reader.require(name == "thin-plate" || name == "gaussian", "its radial basis is unknown");
  return name == "gaussian" ? RadialBasis::kGaussian : RadialBasis::kThinPlate;
}

SelfOrganizingMap load_som(const PartReader& reader, const json& header, MapKind kind) {
  const auto size = header.at("map_size").get<std::array<int, 2>>();
  SomOptions options;
  options.rows = size[0];
  options.columns = size[1];
  reader.require(options.problems().empty(), "its map must have 2 .. 1000 rows and columns");
  SelfOrganizingMap som{size[0], size[1], {}};
  if (kind == MapKind::kSom) {
    som.codebook =
        reader.matrix("som.codebook", kPoseRowCount, static_cast<Index>(size[0]) * size[1]);
  }
  return som;
}

math::Pca load_pca(const PartReader& reader, const json& header) {
  math::Pca pca;
  pca.mean = reader.matrix("pca.mean", kPoseRowCount, 1);
  pca.basis = reader.matrix("pca.basis", kPoseRowCount, -1);
  reader.require(pca.basis.cols() >= 1 && pca.basis.cols() <= kPoseRowCount,
                 "it has no principal plane");
  pca.variance = reader.matrix("pca.variance", pca.basis.cols(), 1);
  pca.total_variance = header.at("total_variance").get<double>();
  return pca;
}

Region load_region(const PartReader& reader) {
  const MatrixXd ends = reader.matrix("pca.region", 2, 2);
  const Region region{ends.col(0), ends.col(1)};
  reader.require(((region.high - region.low).array() > 0.0).all(),
                 "its principal plane has no inside");
  return region;
}

Primitives load_primitives(const PartReader& reader, const json& header, Index frames,
                           Index components) {
  Primitives primitives;
  primitives.method = kind_named(
      reader, header.at("primitives").get<std::string>(),
      {PrimitiveMethod::kKMeans, PrimitiveMethod::kFuzzyKMeans, PrimitiveMethod::kGaussianMixture});
  primitives.centers = reader.matrix("primitives.centers", 2, -1);
  const Index count = primitives.centers.cols();
  reader.require(count >= 1 && count <= kMaxPrimitives, "it must have 1 .. 1000 primitives");
  primitives.labels =
      reader.whole("primitives.labels", frames, 0.0, static_cast<double>(count) - 1.0);
  primitives.coordinates = reader.matrix("primitives.coordinates", components, count);
  primitives.counts = reader.matrix("primitives.counts", count, count);
  reader.require(primitives.counts.minCoeff() >= 0.0, "a count of transitions is negative");
  return primitives;
}

PoseManifold read_manifold_parts(const PartReader& reader) {
  const auto header = motion::parse_header<json>(reader);
  const double rate = reader.frame_rate(header.at("frame_rate_hz").get<double>());
  const auto kind =
      kind_named(reader, header.at("map").get<std::string>(), {MapKind::kSom, MapKind::kPca});
  SelfOrganizingMap som = load_som(reader, header, kind);
  ManifoldRig rig{motion::load_rig(reader, header, rate), {}};
  rig.free_joints = reader.whole("rig.free_joints", -1, 0.0, rig.stance.joint_count() - 1.0);
  const json& grbf = header.at("grbf");
  GrbfOptions options;
  options.basis = basis_named(reader, grbf.at("basis").get<std::string>());
  options.centers_a_side = grbf.at("centers_a_side").get<int>();
  options.width = grbf.at("width").get<double>();
  options.ridge = grbf.at("ridge").get<double>();
  const Region plane{Eigen::Vector2d::Zero(), Eigen::Vector2d(som.columns - 1.0, som.rows - 1.0)};
  Grbf generator(options, plane,
                 reader.matrix("grbf.coefficients",
                               channel_count(static_cast<int>(rig.free_joints.size())), -1));
  Eigen::Matrix2Xd points = reader.matrix("points", 2, -1);
  reader.require(points.cols() >= 1, "it has no frames");
  auto take_begins = reader.whole("take_begins", -1, 0.0, static_cast<double>(points.cols()) - 1.0);
  reader.require(!take_begins.empty() && take_begins.front() == 0 &&
                     std::is_sorted(take_begins.begin(), take_begins.end()),
                 "its takes are out of order");
  math::Pca pca = load_pca(reader, header);
  Primitives primitives = load_primitives(reader, header, points.cols(), pca.component_count());
  return {kind,
          rate,
          std::move(som),
          std::move(pca),
          load_region(reader),
          std::move(generator),
          std::move(primitives),
          std::move(points),
          std::move(take_begins),
          std::move(rig),
          header.at("record").get<std::string>()};
}

}  // namespace

std::string write_manifold(const PoseManifold& manifold) {
  Container container{kKind, kVersion, "", {}};
  const GrbfOptions& grbf = manifold.generator.options();
  json header = {{"schema", "laban.manifold/1"},
                 {"laban", base::version()},
                 {"frame_rate_hz", manifold.frame_rate_hz},
                 {"map", name_of(manifold.kind)},
                 {"map_size", {manifold.som.rows, manifold.som.columns}},
                 {"primitives", name_of(manifold.primitives.method)},
                 {"total_variance", manifold.pca.total_variance},
                 {"grbf",
                  {{"basis", grbf.basis == RadialBasis::kGaussian ? "gaussian" : "thin-plate"},
                   {"centers_a_side", grbf.centers_a_side},
                   {"width", grbf.width},
                   {"ridge", grbf.ridge}}},
                 // A text in the text: whoever reads the record bounds it himself.
                 {"record", manifold.record_json}};
  motion::save_rig(manifold.rig, container, header);
  container.arrays["rig.free_joints"] = to_array(manifold.rig.free_joints);
  if (manifold.kind == MapKind::kSom) {
    container.arrays["som.codebook"] = to_array(manifold.som.codebook);
  }
  container.arrays["pca.mean"] = to_array(manifold.pca.mean);
  container.arrays["pca.basis"] = to_array(manifold.pca.basis);
  container.arrays["pca.variance"] = to_array(manifold.pca.variance);
  MatrixXd ends(2, 2);
  ends << manifold.pca_region.low, manifold.pca_region.high;
  container.arrays["pca.region"] = to_array(ends);
  container.arrays["grbf.coefficients"] = to_array(manifold.generator.coefficients());
  container.arrays["points"] = to_array(manifold.points);
  container.arrays["take_begins"] = to_array(manifold.take_begins);
  container.arrays["primitives.centers"] = to_array(manifold.primitives.centers);
  container.arrays["primitives.labels"] = to_array(manifold.primitives.labels);
  container.arrays["primitives.counts"] = to_array(manifold.primitives.counts);
  container.arrays["primitives.coordinates"] = to_array(manifold.primitives.coordinates);
  container.header_json = header.dump();
  return base::write_container(container);
}

PoseManifold read_manifold(std::string_view bytes, std::string_view name) {
  const Container container = base::read_container(bytes, name, kKind, kVersion);
  return motion::read_parts<json>(container, name, kMend, read_manifold_parts);
}

}  // namespace laban::manifold
