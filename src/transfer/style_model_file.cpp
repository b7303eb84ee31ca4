#include <cmath>

#include <nlohmann/json.hpp>

#include "laban/base/container.h"
#include "laban/base/error.h"
#include "laban/base/version.h"
#include "laban/transfer/style_model.h"

namespace laban::transfer {
namespace {

using base::Array;
using base::Container;
using base::Error;
using base::ErrorKind;
using nlohmann::ordered_json;

constexpr const char* kKind = "laban.style";
constexpr int kVersion = 3;

Array to_array(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  Array array{static_cast<int>(matrix.rows()), static_cast<int>(matrix.cols()), {}};
  array.values.resize(static_cast<std::size_t>(matrix.size()));
  Eigen::Map<Eigen::MatrixXd>(array.values.data(), matrix.rows(), matrix.cols()) = matrix;
  return array;
}

Eigen::MatrixXd to_matrix(const Array& array) {
  return Eigen::Map<const Eigen::MatrixXd>(array.values.data(), array.rows, array.cols);
}

// What a header may be: far above what is written, far below what would overflow the stack of
// ordered_json::dump, which recurses, or keep ordered_json, which looks a key up among all others,
// busy for seconds.
constexpr std::size_t kMaxHeaderDepth = 64;
constexpr std::size_t kMaxHeaderKeys = 4096;

// Angles are radians within a few turns, the rest metres and metres a frame.
constexpr double kMaxPoseValue = 1e6;

/// Goes through JSON text without keeping it and stops where it is too deep or an object has too
/// many keys.
class HeaderLimits : public nlohmann::json_sax<ordered_json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return open(); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_array() override { return close(); }
  bool key(string_t&) override { return ++key_counts_.back() <= kMaxHeaderKeys; }
  // Malformed text is reported by the parse that follows.
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    malformed_ = true;
    return false;
  }
  [[nodiscard]] bool malformed() const noexcept { return malformed_; }

 private:
  bool open() {
    key_counts_.push_back(0);
    return key_counts_.size() <= kMaxHeaderDepth;
  }
  bool close() {
    key_counts_.pop_back();
    return true;
  }

  std::vector<std::size_t> key_counts_;  // of the objects and arrays that are open
  bool malformed_ = false;
};

/// Reads the parts of one model file; every rule that a part breaks is told with the file's name.
class Reader {
 public:
  Reader(const Container& container, std::string_view name) : container_(container), name_(name) {}

  void require(bool holds, const std::string& what) const {
    if (!holds)
      throw Error(ErrorKind::kFormat, std::string(name_) + ": " + what + "; train the model again");
  }
  [[nodiscard]] Eigen::MatrixXd matrix(const std::string& array, Eigen::Index rows) const {
    Eigen::MatrixXd values = to_matrix(container_.array(array));
    require(values.rows() == rows,
            "array '" + array + "' should have " + std::to_string(rows) + " rows");
    return values;
  }
  [[nodiscard]] Eigen::MatrixXd matrix(const std::string& array, Eigen::Index rows,
                                       Eigen::Index cols) const {
    Eigen::MatrixXd values = matrix(array, rows);
    require(values.cols() == cols,
            "array '" + array + "' should have " + std::to_string(cols) + " columns");
    return values;
  }

 private:
  const Container& container_;
  std::string_view name_;
};

ordered_json parse_header(const Reader& reader, const std::string& text) {
  HeaderLimits limits;
  reader.require(ordered_json::sax_parse(text, &limits) || limits.malformed(),
                 "its header is nested more than 64 deep or has more than 4096 keys in one object");
  return ordered_json::parse(text);
}

std::string pose_key(std::size_t index) {
  return "fragment." + std::to_string(index);
}

void save_fragments(const StyleModel& model, Container& container, ordered_json& header) {
  for (std::size_t i = 0; i < model.fragments.size(); ++i) {
    const Fragment& fragment = model.fragments[i];
    const effort::EffortVector e =
        effort::to_vector(*fragment.effort, model.regressor.factor_count());
    header["fragments"].push_back({{"name", fragment.name},
                                   {"content", fragment.content},
                                   {"performer", fragment.performer},
                                   {"leg_length_m", fragment.pose.leg_length_m},
                                   {"effort", std::vector<double>(e.begin(), e.end())}});
    Eigen::MatrixXd rows(motion::kAngleRowCount + 4, fragment.pose.frame_count());
    rows << fragment.pose.angles, fragment.pose.height, fragment.pose.steps;
    container.arrays[pose_key(i)] = to_array(rows);
  }
}

std::vector<Fragment> load_fragments(const Reader& reader, const ordered_json& header) {
  std::vector<Fragment> fragments;
  const double rate = header.at("frame_rate_hz").get<double>();
  reader.require(rate > 0.0 && rate <= 1e6, "the frame rate must be positive and at most 1e6 Hz");
  for (const ordered_json& entry : header.at("fragments")) {
    const Eigen::MatrixXd rows =
        reader.matrix(pose_key(fragments.size()), motion::kAngleRowCount + 4);
    reader.require(rows.cols() > 0, "a fragment has no frames");
    reader.require(rows.cwiseAbs().maxCoeff() <= kMaxPoseValue, "a fragment holds no poses");
    const double leg = entry.at("leg_length_m").get<double>();
    reader.require(leg > 0.0 && leg <= kMaxPoseValue, "a leg length must be positive, in metres");
    const auto effort = entry.at("effort").get<std::vector<double>>();
    reader.require(
        effort.size() == effort::kFactorCount || effort.size() == effort::kMaxFactorCount,
        "a fragment's Effort must be three or four numbers");
    const Eigen::Map<const Eigen::VectorXd> e(effort.data(), std::ssize(effort));
    fragments.push_back({entry.at("name").get<std::string>(),
                         entry.at("content").get<std::string>(),
                         entry.at("performer").get<std::string>(),
                         motion::PoseMatrix{rate, leg, rows.topRows(motion::kAngleRowCount),
                                            rows.row(motion::kAngleRowCount), rows.bottomRows<3>()},
                         effort::to_effort(e)});
  }
  reader.require(!fragments.empty(), "it has no fragments");
  return fragments;
}

Eigen::MatrixXd neighbor_matrix(const std::vector<std::vector<int>>& neighbors) {
  std::size_t most = 0;
  for (const auto& list : neighbors) most = std::max(most, list.size());
  // One column a fragment, padded with -1: groups differ in size.
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Constant(
      static_cast<Eigen::Index>(most), static_cast<Eigen::Index>(neighbors.size()), -1.0);
  for (std::size_t i = 0; i < neighbors.size(); ++i) {
    for (std::size_t k = 0; k < neighbors[i].size(); ++k) {
      matrix(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)) = neighbors[i][k];
    }
  }
  return matrix;
}

std::vector<std::vector<int>> load_neighbors(const Reader& reader, const std::vector<int>& contents,
                                             const Eigen::MatrixXd& matrix) {
  reader.require(matrix.cols() == std::ssize(contents), "its neighbours do not fit its fragments");
  std::vector<std::vector<int>> neighbors(contents.size());
  for (std::size_t i = 0; i < contents.size(); ++i) {
    const auto column = matrix.col(static_cast<Eigen::Index>(i));
    for (Eigen::Index k = 0; k < column.size() && column[k] >= 0.0; ++k) {
      reader.require(column[k] < static_cast<double>(contents.size()),
                     "a neighbour is out of range");
      const auto neighbor = static_cast<std::size_t>(column[k]);
      reader.require(contents[neighbor] == contents[i], "a neighbour has another content");
      neighbors[i].push_back(static_cast<int>(neighbor));
    }
    reader.require(!neighbors[i].empty(), "a fragment has no neighbours");
  }
  return neighbors;
}

// A group of one has no threshold of its own; infinity is not written, -1 stands for it.
Eigen::MatrixXd match_cost_matrix(const std::vector<align::GroupCostStatistics>& costs) {
  Eigen::MatrixXd matrix(2, static_cast<Eigen::Index>(costs.size()));
  for (std::size_t g = 0; g < costs.size(); ++g) {
    const auto column = static_cast<Eigen::Index>(g);
    matrix(0, column) = costs[g].median;
    matrix(1, column) = std::isfinite(costs[g].threshold) ? costs[g].threshold : -1.0;
  }
  return matrix;
}

std::vector<align::GroupCostStatistics> load_match_costs(const Eigen::MatrixXd& matrix) {
  std::vector<align::GroupCostStatistics> costs;
  for (Eigen::Index g = 0; g < matrix.cols(); ++g) {
    const double threshold = matrix(1, g);
    costs.push_back(
        {matrix(0, g), threshold < 0.0 ? std::numeric_limits<double>::infinity() : threshold});
  }
  return costs;
}

align::ContentMetric load_metric(const Reader& reader, const Container& container,
                                 const ordered_json& header) {
  if (header.at("metric") == "raw") return align::ContentMetric::raw();
  reader.require(header.at("metric") == "content", "its metric is unknown");
  Eigen::MatrixXd map = to_matrix(container.array("metric.map"));
  // Older versions looked at less: 1 at the angles alone, 2 at angles and height. What came later
  // counts nothing there.
  const Eigen::Index known = map.cols();
  if (known == motion::kAngleRowCount || known == motion::kAngleRowCount + 1) {
    map.conservativeResize(Eigen::NoChange, align::kContentRowCount);
    map.rightCols(align::kContentRowCount - known).setZero();
  }
  return {std::move(map), reader.matrix("metric.reference", motion::kAngleRowCount, 1)};
}

StyleModel read_parts(const Container& container, std::string_view name) {
  const Reader reader(container, name);
  const ordered_json header = parse_header(reader, container.header_json);
  std::vector<Fragment> fragments = load_fragments(reader, header);
  Numbering contents = number_contents(fragments);
  const auto groups = static_cast<Eigen::Index>(contents.names.size());
  align::FragmentSet database(load_metric(reader, container, header), poses_of(fragments),
                              contents.numbers, number_performers(fragments).numbers);
  auto neighbors =
      load_neighbors(reader, contents.numbers, to_matrix(container.array("neighbors")));
  effort::ContentMap content_map = effort::ContentMap::load(container, "content_map");
  std::vector<Eigen::VectorXd> coordinates = content_coordinates(fragments, content_map);
  for (const Eigen::VectorXd& coordinate : coordinates) {
    reader.require(coordinate.allFinite(), "its content map gives coordinates that are not finite");
  }
  effort::StyleRegressor regressor = effort::StyleRegressor::load(container, "regressor");
  reader.require(regressor.feature_rows() ==
                     effort::feature_count(static_cast<int>(coordinates.front().size()),
                                           regressor.factor_count()),
                 "its regressor does not fit its content map");
  effort::ObserverReference observer{
      header.at("observer_groups").get<std::vector<std::string>>(), {}, {}};
  const auto columns = static_cast<Eigen::Index>(observer.groups.size()) + 1;
  observer.center = reader.matrix("observer.center", 3, columns);
  observer.scale = reader.matrix("observer.scale", 3, columns);
  reader.require((observer.scale.array() > 0.0).all(),
                 "its observer has a scale that is not positive");
  std::vector<double> content_margins(fragments.size(), 0.0);
  if (container.arrays.contains("content_margins")) {
    const Eigen::VectorXd margins =
        reader.matrix("content_margins", std::ssize(content_margins), 1);
    content_margins.assign(margins.begin(), margins.end());
  }
  auto match_costs = load_match_costs(reader.matrix("match_costs", 2, groups));
  return {std::move(fragments),
          std::move(contents),
          std::move(database),
          std::move(neighbors),
          std::move(content_margins),
          std::move(match_costs),
          std::move(content_map),
          std::move(coordinates),
          std::move(regressor),
          std::move(observer),
          header.value("labels_measured", false),
          header.at("record").dump()};
}

}  // namespace

std::string write_style_model(const StyleModel& model) {
  Container container{kKind, kVersion, "", {}};
  ordered_json header = {
      {"schema", "laban.style/1"},
      {"laban", base::version()},
      {"frame_rate_hz", model.frame_rate_hz()},
      {"metric", model.database.metric().kind() == align::MetricKind::kRaw ? "raw" : "content"},
      {"regressor", effort::name_of(model.regressor.kind())},
      {"observer_groups", model.observer.groups},
      {"labels_measured", model.labels_measured},
      {"record", ordered_json::parse(model.record_json)},
      {"fragments", ordered_json::array()}};
  save_fragments(model, container, header);
  container.arrays["metric.map"] = to_array(model.database.metric().map());
  container.arrays["metric.reference"] = to_array(model.database.metric().reference());
  container.arrays["neighbors"] = to_array(neighbor_matrix(model.neighbors));
  container.arrays["content_margins"] = to_array(Eigen::Map<const Eigen::VectorXd>(
      model.content_margins.data(), std::ssize(model.content_margins)));
  container.arrays["match_costs"] = to_array(match_cost_matrix(model.match_costs));
  container.arrays["observer.center"] = to_array(model.observer.center);
  container.arrays["observer.scale"] = to_array(model.observer.scale);
  model.content_map.save(container, "content_map");
  model.regressor.save(container, "regressor");
  container.header_json = header.dump();
  return base::write_container(container);
}

StyleModel read_style_model(std::string_view bytes, std::string_view name) {
  const Container container = base::read_container(bytes, name, kKind, kVersion);
  try {
    return read_parts(container, name);
  } catch (const ordered_json::exception& error) {
    throw Error(ErrorKind::kFormat, std::string(name) + ": its header is malformed (" +
                                        error.what() + "); train the model again");
  } catch (const Error& error) {
    // A part that is not sound does not know of which file it is.
    const std::string place = std::string(name) + ": ";
    if (std::string_view(error.what()).starts_with(place)) throw;
    throw Error(ErrorKind::kFormat, place + error.what() + "; train the model again");
  }
}

}  // namespace laban::transfer
