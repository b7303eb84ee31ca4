#include "laban/manifold/manifold_file.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "laban/base/container.h"
#include "laban/base/error.h"
#include "laban/base/version.h"

#include "manifold/pose_channels.h"

namespace laban::manifold {
namespace {

using base::Array;
using base::Container;
using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using motion::kStandardJointCount;
using nlohmann::json;

constexpr const char* kKind = "laban.manifold";
constexpr int kVersion = 1;

// Metres, radians, map units: far above any body, far below what overflows.
constexpr double kMaxValue = 1e9;
constexpr double kMaxRate = 1e6;
constexpr Index kMaxPrimitives = 1000;
constexpr std::size_t kMaxHeaderDepth = 64;
constexpr std::size_t kMaxHeaderKeys = 1U << 16U;

Array to_array(const Eigen::Ref<const MatrixXd>& matrix) {
  Array array{static_cast<int>(matrix.rows()), static_cast<int>(matrix.cols()), {}};
  array.values.resize(static_cast<std::size_t>(matrix.size()));
  Eigen::Map<MatrixXd>(array.values.data(), matrix.rows(), matrix.cols()) = matrix;
  return array;
}

/// Whole numbers as an array of one row.
Array to_array(const std::vector<int>& values) {
  Array array{1, static_cast<int>(values.size()), {}};
  array.values.assign(values.begin(), values.end());
  return array;
}

/// Reads the parts of one file; every rule that a part breaks is told with the file's name.
class Reader {
 public:
  Reader(const Container& container, std::string_view name) : container_(container), name_(name) {}

  void require(bool holds, const std::string& what) const {
    if (!holds) {
      throw Error(ErrorKind::kFormat,
                  std::string(name_) + ": " + what + "; learn the manifold again");
    }
  }
  /// A size of -1 may be any.
  [[nodiscard]] MatrixXd matrix(const std::string& array, Index rows, Index cols) const {
    const Array& found = container_.array(array);
    require((rows < 0 || found.rows == rows) && (cols < 0 || found.cols == cols),
            "array '" + array + "' is " + std::to_string(found.rows) + " x " +
                std::to_string(found.cols) + ", which does not fit the others");
    MatrixXd values = Eigen::Map<const MatrixXd>(found.values.data(), found.rows, found.cols);
    require(values.size() == 0 || values.cwiseAbs().maxCoeff() <= kMaxValue,
            "array '" + array + "' holds values beyond all measure");
    return values;
  }
  /// Whole numbers in [low, high].
  [[nodiscard]] std::vector<int> whole(const std::string& array, Index count, double low,
                                       double high) const {
    const MatrixXd values = matrix(array, 1, count);
    std::vector<int> numbers;
    for (const double value : values.reshaped()) {
      require(value >= low && value <= high && value == std::floor(value),
              "array '" + array + "' holds a number out of range");
      numbers.push_back(static_cast<int>(value));
    }
    return numbers;
  }

 private:
  const Container& container_;
  std::string_view name_;
};

/// The header, refused before it is kept if it is nested too deep or has too many keys.
json parse_header(const Reader& reader, const std::string& text) {
  std::size_t keys = 0;
  bool bounded = true;
  const auto mind = [&](int depth, json::parse_event_t event, json& /*parsed*/) {
    if (event == json::parse_event_t::key) ++keys;
    bounded =
        bounded && static_cast<std::size_t>(depth) <= kMaxHeaderDepth && keys <= kMaxHeaderKeys;
    return bounded;
  };
  json header = json::parse(text, mind);
  reader.require(bounded, "its header is nested too deep or has too many keys");
  reader.require(header.is_object(), "its header is no object");
  return header;
}

// ---- the rig ----

void save_rig(const ManifoldRig& rig, Container& container, json& header) {
  const motion::Skeleton& skeleton = rig.stance.skeleton();
  const Index joints = skeleton.joint_count();
  MatrixXd offsets(3, joints);
  MatrixXd ends(4, joints);  // the last row says whether there is one
  MatrixXd stance(7, joints);
  std::vector<int> parents;
  header["joints"] = json::array();
  for (int j = 0; j < joints; ++j) {
    const motion::Joint& joint = skeleton.joint(j);
    header["joints"].push_back(joint.name);
    parents.push_back(joint.parent);
    offsets.col(j) = joint.rest_offset;
    ends.col(j) << joint.end_site.value_or(Eigen::Vector3d::Zero()), joint.end_site ? 1.0 : 0.0;
    const Eigen::Quaterniond& q = rig.stance.rotation(0, j);
    stance.col(j) << q.w(), q.x(), q.y(), q.z(), rig.stance.translation(0, j);
  }
  MatrixXd mapped(5, kStandardJointCount);  // rig joint (-1: none), reference rotation
  for (int s = 0; s < kStandardJointCount; ++s) {
    const auto& joint = rig.humanoid.mapped(static_cast<motion::StandardJoint>(s));
    const Eigen::Quaterniond q = joint ? joint->reference : Eigen::Quaterniond::Identity();
    mapped.col(s) << (joint ? joint->joint : -1), q.w(), q.x(), q.y(), q.z();
  }
  container.arrays["rig.parents"] = to_array(parents);
  container.arrays["rig.offsets"] = to_array(offsets);
  container.arrays["rig.end_sites"] = to_array(ends);
  container.arrays["rig.stance"] = to_array(stance);
  container.arrays["rig.mapped"] = to_array(mapped);
  container.arrays["rig.root_point"] = to_array(rig.humanoid.root_point());
  container.arrays["rig.free_joints"] = to_array(rig.free_joints);
  header["rig"] = {{"name", rig.humanoid.rig_name()},
                   {"leg_length_m", rig.humanoid.leg_length_m()},
                   {"animates_translations", rig.stance.has_translations()}};
  if (rig.floor) header["rig"]["floor_m"] = {rig.floor->heel_m, rig.floor->toe_m};
}

Eigen::Quaterniond rotation_of(const Reader& reader, const Eigen::Vector4d& wxyz) {
  const Eigen::Quaterniond q(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  reader.require(std::abs(q.squaredNorm() - 1.0) <= 1e-9, "a rotation of its rig has not length 1");
  return q;
}

std::shared_ptr<const motion::Skeleton> load_skeleton(const Reader& reader, const json& header) {
  const auto names = header.at("joints").get<std::vector<std::string>>();
  const auto joints = static_cast<Index>(names.size());
  const auto parents = reader.whole("rig.parents", joints, -1.0, static_cast<double>(joints) - 1.0);
  const MatrixXd offsets = reader.matrix("rig.offsets", 3, joints);
  const MatrixXd ends = reader.matrix("rig.end_sites", 4, joints);
  std::vector<motion::Joint> list;
  for (Index j = 0; j < joints; ++j) {
    const auto cell = static_cast<std::size_t>(j);
    motion::Joint joint{names[cell], parents[cell], offsets.col(j), std::nullopt};
    if (ends(3, j) != 0.0) joint.end_site = Eigen::Vector3d(ends.col(j).head<3>());
    list.push_back(std::move(joint));
  }
  return std::make_shared<const motion::Skeleton>(std::move(list));
}

ManifoldRig load_rig(const Reader& reader, const json& header, double rate_hz) {
  const auto skeleton = load_skeleton(reader, header);
  const json& facts = header.at("rig");
  const Index joints = skeleton->joint_count();
  const MatrixXd values = reader.matrix("rig.stance", 7, joints);
  std::vector<Eigen::Quaterniond> rotations;
  for (Index j = 0; j < joints; ++j) {
    rotations.push_back(rotation_of(reader, values.col(j).head<4>()));
  }
  Eigen::Matrix3Xd translations;
  if (facts.at("animates_translations").get<bool>()) translations = values.bottomRows<3>();
  motion::Clip stance(skeleton, rate_hz, values.col(0).tail<3>(), std::move(rotations),
                      std::move(translations));
  const MatrixXd mapped = reader.matrix("rig.mapped", 5, kStandardJointCount);
  motion::Humanoid::Mapping mapping;
  for (int s = 0; s < kStandardJointCount; ++s) {
    const double joint = mapped(0, s);
    reader.require(
        joint >= -1.0 && joint < static_cast<double>(joints) && joint == std::floor(joint),
        "its rig maps a joint that it does not have");
    if (joint < 0.0) continue;
    mapping[static_cast<std::size_t>(s)] =
        motion::MappedJoint{static_cast<int>(joint), rotation_of(reader, mapped.col(s).tail<4>())};
  }
  const double leg = facts.at("leg_length_m").get<double>();
  reader.require(leg > 0.0 && leg <= kMaxValue, "a leg length must be positive, in metres");
  const Eigen::Vector3d root_point = reader.matrix("rig.root_point", 3, 1);
  motion::Humanoid humanoid(facts.at("name").get<std::string>(), *skeleton, mapping, leg,
                            root_point, 0);
  ManifoldRig rig{std::move(stance), std::move(humanoid),
                  reader.whole("rig.free_joints", -1, 0.0, static_cast<double>(joints) - 1.0),
                  std::nullopt};
  if (facts.contains("floor_m")) {
    const auto floor = facts.at("floor_m").get<std::array<double, 2>>();
    reader.require(std::abs(floor[0]) <= kMaxValue && std::abs(floor[1]) <= kMaxValue,
                   "its floor lies beyond all measure");
    rig.floor = motion::FootFloor{floor[0], floor[1]};
  }
  return rig;
}

// ---- the plane ----

template <typename Kind>
Kind kind_named(const Reader& reader, const std::string& name, std::initializer_list<Kind> kinds) {
  for (const Kind kind : kinds) {
    if (name == name_of(kind)) return kind;
  }
  reader.require(false, "it says '" + name + "', which this laban does not know");
  return {};
}

RadialBasis basis_named(const Reader& reader, const std::string& name) {
  reader.require(name == "thin-plate" || name == "gaussian", "its radial basis is unknown");
  return name == "gaussian" ? RadialBasis::kGaussian : RadialBasis::kThinPlate;
}

SelfOrganizingMap load_som(const Reader& reader, const json& header, MapKind kind) {
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

math::Pca load_pca(const Reader& reader, const json& header) {
  math::Pca pca;
  pca.mean = reader.matrix("pca.mean", kPoseRowCount, 1);
  pca.basis = reader.matrix("pca.basis", kPoseRowCount, -1);
  reader.require(pca.basis.cols() >= 1 && pca.basis.cols() <= kPoseRowCount,
                 "it has no principal plane");
  pca.variance = reader.matrix("pca.variance", pca.basis.cols(), 1);
  pca.total_variance = header.at("total_variance").get<double>();
  return pca;
}

Region load_region(const Reader& reader) {
  const MatrixXd ends = reader.matrix("pca.region", 2, 2);
  const Region region{ends.col(0), ends.col(1)};
  reader.require(((region.high - region.low).array() > 0.0).all(),
                 "its principal plane has no inside");
  return region;
}

Primitives load_primitives(const Reader& reader, const json& header, Index frames,
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

PoseManifold read_parts(const Container& container, std::string_view name) {
  const Reader reader(container, name);
  const json header = parse_header(reader, container.header_json);
  const double rate = header.at("frame_rate_hz").get<double>();
  reader.require(rate > 0.0 && rate <= kMaxRate, "the frame rate must be positive, at most 1e6 Hz");
  const auto kind =
      kind_named(reader, header.at("map").get<std::string>(), {MapKind::kSom, MapKind::kPca});
  SelfOrganizingMap som = load_som(reader, header, kind);
  ManifoldRig rig = load_rig(reader, header, rate);
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
  save_rig(manifold.rig, container, header);
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
  try {
    return read_parts(container, name);
  } catch (const json::exception& error) {
    throw Error(ErrorKind::kFormat, std::string(name) + ": its header is malformed (" +
                                        error.what() + "); learn the manifold again");
  } catch (const Error& error) {
    // A part that is not sound does not know of which file it is.
    const std::string place = std::string(name) + ": ";
    if (std::string_view(error.what()).starts_with(place)) throw;
    throw Error(ErrorKind::kFormat, place + error.what() + "; learn the manifold again");
  }
}

}  // namespace laban::manifold
