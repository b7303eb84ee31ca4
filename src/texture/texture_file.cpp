#include "laban/texture/texture_file.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "laban/base/container.h"
#include "laban/base/version.h"
#include "laban/motion/stored_rig.h"

namespace laban::texture {
namespace {

using base::Container;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using motion::kStandardJointCount;
using motion::PartReader;
using motion::to_array;
using nlohmann::json;

constexpr const char* kKind = "laban.texture";
constexpr int kVersion = 1;

constexpr const char* kMend = "learn the texture again";
constexpr double kMaxRate = 1e6;
constexpr double kMaxFrames = 1e9;
constexpr Index kMaxTextons = 100000;

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
std::vector<int> whole_row(const PartReader& reader, const MatrixXd& values, Index row, double low,
                           double high) {
  return reader.whole(values.row(row), low, high, "a frame or texton of it is out of range");
}

ObservationSpace load_space(const PartReader& reader) {
  ObservationSpace space;
  const MatrixXd reference = reader.matrix("space.reference", 4, kStandardJointCount);
  for (int s = 0; s < kStandardJointCount; ++s)
    space.reference[static_cast<std::size_t>(s)] = reader.rotation(reference.col(s));
  space.scale = reader.matrix("space.scale", kObservationRows, 1);
  // Both ways, so that observations divided by it stay finite.
  reader.require(space.scale.minCoeff() >= 1.0 / PartReader::kMaxValue,
                 "a scale of it is not positive");
  return space;
}

std::vector<Take> load_takes(const PartReader& reader, const json& header, Index frames) {
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

std::vector<Segment> load_segments(const PartReader& reader, const std::vector<Take>& takes,
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

void require_covariance(const PartReader& reader, const MatrixXd& covariance) {
  const double scale = covariance.cwiseAbs().maxCoeff();
  reader.require((covariance - covariance.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * scale &&
                     Eigen::LLT<MatrixXd>(covariance).info() == Eigen::Success,
                 "a covariance of a texton is not symmetric and positive definite");
}

Texton load_texton(const PartReader& reader, std::size_t number) {
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

MotionTexture read_texture_parts(const PartReader& reader) {
  const auto header = motion::parse_header<json>(reader);
  const double rate = reader.frame_rate(header.at("frame_rate_hz").get<double>());
  const double leg = reader.leg_length(header.at("leg_length_m").get<double>());
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
          motion::load_rig(reader, header, rate),
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
  motion::save_rig(texture.rig, container, header);
  save_corpus(texture, container, header);
  for (std::size_t i = 0; i < texture.textons.size(); ++i)
    save_texton(texture.textons[i], i, container);
  container.arrays["transition_counts"] = to_array(texture.transition_counts);
  container.header_json = header.dump();
  return base::write_container(container);
}

MotionTexture read_texture(std::string_view bytes, std::string_view name) {
  const Container container = base::read_container(bytes, name, kKind, kVersion);
  return motion::read_parts<json>(container, name, kMend, read_texture_parts);
}

}  // namespace laban::texture
