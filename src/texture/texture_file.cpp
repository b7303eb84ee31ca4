#include "laban/texture/texture_file.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "laban/base/container.h"
#include "laban/base/error.h"
#include "laban/base/version.h"

namespace laban::texture {
namespace {

using base::Array;
using base::Container;
using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using motion::kStandardJointCount;
using nlohmann::json;

constexpr const char* kKind = "laban.texture";
constexpr int kVersion = 1;

// Metres, radians and their squares: far above any body, far below what overflows.
constexpr double kMaxValue = 1e9;
constexpr double kMaxRate = 1e6;
constexpr double kMaxFrames = 1e9;
constexpr Index kMaxTextons = 100000;
constexpr std::size_t kMaxHeaderDepth = 64;
constexpr std::size_t kMaxHeaderKeys = 1U << 20U;

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
                  std::string(name_) + ": " + what + "; learn the texture again");
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

void save_rig(const TextureRig& rig, Container& container, json& header) {
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

TextureRig load_rig(const Reader& reader, const json& header, double rate_hz) {
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
  TextureRig rig{std::move(stance), std::move(humanoid), std::nullopt};
  if (facts.contains("floor_m")) {
    const auto floor = facts.at("floor_m").get<std::array<double, 2>>();
    reader.require(std::abs(floor[0]) <= kMaxValue && std::abs(floor[1]) <= kMaxValue,
                   "its floor lies beyond all measure");
    rig.floor = motion::FootFloor{floor[0], floor[1]};
  }
  return rig;
}

// ---- corpus ----

void save_corpus(const MotionTexture& texture, Container& container, json& header) {
  MatrixXd reference(4, kStandardJointCount);
  for (int s = 0; s < kStandardJointCount; ++s) {
    const Eigen::Quaterniond& q = texture.space.reference[static_cast<std::size_t>(s)];
    reference.col(s) << q.w(), q.x(), q.y(), q.z();
  }
  MatrixXd takes(4, std::ssize(texture.takes));
  header["takes"] = json::array();
  for (std::size_t n = 0; n < texture.takes.size(); ++n) {
    const Take& take = texture.takes[n];
    header["takes"].push_back(take.name);
    takes.col(static_cast<Index>(n)) << take.begin, take.length, take.first_file_frame,
        take.file_frames_per_frame;
  }
  MatrixXd segments(3, std::ssize(texture.segments));
  for (std::size_t n = 0; n < texture.segments.size(); ++n) {
    const Segment& segment = texture.segments[n];
    segments.col(static_cast<Index>(n)) << segment.begin, segment.length, segment.texton;
  }
  container.arrays["space.reference"] = to_array(reference);
  container.arrays["space.scale"] = to_array(texture.space.scale);
  container.arrays["observations"] = to_array(texture.observations);
  container.arrays["takes"] = to_array(takes);
  container.arrays["segments"] = to_array(segments);
}

/// Whole numbers of a row of an array, in [low, high].
std::vector<int> whole_row(const Reader& reader, const MatrixXd& values, Index row, double low,
                           double high) {
  std::vector<int> numbers;
  for (Index n = 0; n < values.cols(); ++n) {
    const double value = values(row, n);
    reader.require(value >= low && value <= high && value == std::floor(value),
                   "a frame or texton of it is out of range");
    numbers.push_back(static_cast<int>(value));
  }
  return numbers;
}

ObservationSpace load_space(const Reader& reader) {
  ObservationSpace space;
  const MatrixXd reference = reader.matrix("space.reference", 4, kStandardJointCount);
  for (int s = 0; s < kStandardJointCount; ++s)
    space.reference[static_cast<std::size_t>(s)] = rotation_of(reader, reference.col(s));
  space.scale = reader.matrix("space.scale", kObservationRows, 1);
  // Both ways, so that observations divided by it stay finite.
  reader.require(space.scale.minCoeff() >= 1.0 / kMaxValue, "a scale of it is not positive");
  return space;
}

std::vector<Take> load_takes(const Reader& reader, const json& header, Index frames) {
  const auto names = header.at("takes").get<std::vector<std::string>>();
  const MatrixXd values = reader.matrix("takes", 4, std::ssize(names));
  const auto most = static_cast<double>(frames);
  const auto begins = whole_row(reader, values, 0, 0.0, most);
  const auto lengths = whole_row(reader, values, 1, 1.0, most);
  const auto firsts = whole_row(reader, values, 2, 0.0, kMaxFrames);
  std::vector<Take> takes;
  Index at = 0;
  for (std::size_t n = 0; n < names.size(); ++n) {
    reader.require(begins[n] == at && lengths[n] <= frames - at, "its takes do not join");
    at += lengths[n];
    const double step = values(3, static_cast<Index>(n));
    reader.require(step > 0.0 && step <= kMaxRate, "a take's rate is out of range");
    takes.push_back({names[n], begins[n], lengths[n], firsts[n], step});
  }
  reader.require(!takes.empty() && at == frames, "its takes do not cover its frames");
  return takes;
}

std::vector<Segment> load_segments(const Reader& reader, const std::vector<Take>& takes,
                                   Index textons, int min_frames) {
  const MatrixXd values = reader.matrix("segments", 3, -1);
  const auto most = static_cast<double>(takes.back().begin + takes.back().length);
  const auto begins = whole_row(reader, values, 0, 0.0, most);
  const auto lengths = whole_row(reader, values, 1, 1.0, most);
  const auto labels = whole_row(reader, values, 2, 0.0, static_cast<double>(textons) - 1.0);
  std::vector<Segment> segments;
  std::size_t take = 0;
  int at = 0;
  for (std::size_t n = 0; n < begins.size(); ++n) {
    reader.require(take < takes.size() && begins[n] == at, "its segments do not join");
    const int end = takes[take].begin + takes[take].length;
    reader.require(lengths[n] <= end - at, "a segment of it runs over its take's end");
    reader.require(lengths[n] >= std::min(min_frames, takes[take].length) && lengths[n] >= 3,
                   "a segment of it is shorter than they may be");
    segments.push_back({begins[n], lengths[n], labels[n]});
    at += lengths[n];
    if (at == end) ++take;
  }
  reader.require(take == takes.size(), "its segments do not cover its takes");
  return segments;
}

// ---- textons ----

std::string texton_array(std::size_t texton, const char* part) {
  return "texton" + std::to_string(texton) + "." + part;
}

// Eight small arrays a texton would be eight names each: all of one texton is one array instead,
// columns beside each other, as tall as an observation.
//
//   mean | basis (m) | a1 (m) a2 (m) offset covariance (m) | start mean (2) covariance (4 m) | s^2
//
// What has m rows fills the top of its columns; what has 2 m rows stands in two columns of m.
void save_texton(const Texton& texton, std::size_t number, Container& container) {
  const Index d = texton.mean.size();
  const Index m = texton.dimension();
  MatrixXd all = MatrixXd::Zero(d, 8 * m + 5);
  Index at = 0;
  const auto put = [&](const Eigen::Ref<const MatrixXd>& part) {
    all.block(0, at, part.rows(), part.cols()) = part;
    at += part.cols();
  };
  put(texton.mean);
  put(texton.basis);
  put(texton.dynamics.a1);
  put(texton.dynamics.a2);
  put(texton.dynamics.offset);
  put(texton.dynamics.covariance);
  put(texton.start_mean.head(m));
  put(texton.start_mean.tail(m));
  put(texton.start_covariance.topRows(m));
  put(texton.start_covariance.bottomRows(m));
  all(0, at) = texton.residual_variance;
  container.arrays[texton_array(number, "system")] = to_array(all);
}

void require_covariance(const Reader& reader, const MatrixXd& covariance) {
  const double scale = covariance.cwiseAbs().maxCoeff();
  reader.require((covariance - covariance.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * scale &&
                     Eigen::LLT<MatrixXd>(covariance).info() == Eigen::Success,
                 "a covariance of a texton is not symmetric and positive definite");
}

Texton load_texton(const Reader& reader, std::size_t number) {
  const MatrixXd all = reader.matrix(texton_array(number, "system"), kObservationRows, -1);
  const Index m = (all.cols() - 5) / 8;
  reader.require(m >= 1 && m <= kObservationRows && all.cols() == 8 * m + 5,
                 "a texton of it has an impossible number of states");
  Index at = 0;
  const auto get = [&](Index rows, Index columns) {
    MatrixXd part = all.block(0, at, rows, columns);
    at += columns;
    return part;
  };
  Texton texton;
  texton.mean = get(kObservationRows, 1);
  texton.basis = get(kObservationRows, m);
  texton.dynamics.a1 = get(m, m);
  texton.dynamics.a2 = get(m, m);
  texton.dynamics.offset = get(m, 1);
  texton.dynamics.covariance = get(m, m);
  texton.start_mean.resize(2 * m);
  texton.start_mean << get(m, 1), get(m, 1);
  texton.start_covariance.resize(2 * m, 2 * m);
  texton.start_covariance << get(m, 2 * m), get(m, 2 * m);
  texton.residual_variance = all(0, at);
  reader.require(texton.residual_variance > 0.0, "a texton's residual variance is not positive");
  reader.require(
      (texton.basis.transpose() * texton.basis - MatrixXd::Identity(m, m)).cwiseAbs().maxCoeff() <=
          1e-6,
      "a texton's basis is not orthonormal");
  require_covariance(reader, texton.dynamics.covariance);
  require_covariance(reader, texton.start_covariance);
  return texton;
}

MotionTexture read_parts(const Container& container, std::string_view name) {
  const Reader reader(container, name);
  const json header = parse_header(reader, container.header_json);
  const double rate = header.at("frame_rate_hz").get<double>();
  reader.require(rate > 0.0 && rate <= kMaxRate, "the frame rate must be positive, at most 1e6 Hz");
  const double leg = header.at("leg_length_m").get<double>();
  reader.require(leg > 0.0 && leg <= kMaxValue, "a leg length must be positive, in metres");
  const int min_frames = header.at("min_frames").get<int>();
  reader.require(min_frames >= 3, "its segments must have at least three frames");
  MatrixXd observations = reader.matrix("observations", kObservationRows, -1);
  auto takes = load_takes(reader, header, observations.cols());
  MatrixXd counts = reader.matrix("transition_counts", -1, -1);
  const Index textons = counts.rows();
  reader.require(textons >= 1 && textons <= kMaxTextons && counts.cols() == textons,
                 "it must have 1 .. 100000 textons and as many rows of transitions");
  reader.require(counts.minCoeff() >= 0.0, "a count of transitions is negative");
  std::vector<Texton> list;
  for (Index i = 0; i < textons; ++i)
    list.push_back(load_texton(reader, static_cast<std::size_t>(i)));
  auto segments = load_segments(reader, takes, textons, min_frames);
  return {load_space(reader),
          rate,
          leg,
          min_frames,
          std::move(observations),
          std::move(takes),
          std::move(segments),
          std::move(list),
          std::move(counts),
          load_rig(reader, header, rate),
          header.at("record").get<std::string>()};
}

}  // namespace

std::string write_texture(const MotionTexture& texture) {
  Container container{kKind, kVersion, "", {}};
  json header = {{"schema", "laban.texture/1"},
                 {"laban", base::version()},
                 {"frame_rate_hz", texture.frame_rate_hz},
                 {"leg_length_m", texture.leg_length_m},
                 {"min_frames", texture.min_frames},
                 // A text in the text: whoever reads the record bounds it himself.
                 {"record", texture.record_json}};
  save_rig(texture.rig, container, header);
  save_corpus(texture, container, header);
  for (std::size_t i = 0; i < texture.textons.size(); ++i)
    save_texton(texture.textons[i], i, container);
  container.arrays["transition_counts"] = to_array(texture.transition_counts);
  container.header_json = header.dump();
  return base::write_container(container);
}

MotionTexture read_texture(std::string_view bytes, std::string_view name) {
  const Container container = base::read_container(bytes, name, kKind, kVersion);
  try {
    return read_parts(container, name);
  } catch (const json::exception& error) {
    throw Error(ErrorKind::kFormat, std::string(name) + ": its header is malformed (" +
                                        error.what() + "); learn the texture again");
  } catch (const Error& error) {
    // A part that is not sound does not know of which file it is.
    const std::string place = std::string(name) + ": ";
    if (std::string_view(error.what()).starts_with(place)) throw;
    throw Error(ErrorKind::kFormat, place + error.what() + "; learn the texture again");
  }
}

}  // namespace laban::texture
