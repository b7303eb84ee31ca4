#include "map_state.h"

#include "laban/base/error.h"

#include "state_reader.h"

namespace laban::cli {
namespace {

constexpr const char* kMapSchema = "laban.map-room/1";
constexpr const char* kMapRoom = "the map room";
constexpr std::size_t kMostPoints = 10'000;
/// Beyond any map: points are clamped to their own.
constexpr double kFarthestPoint = 1e6;

void read_points(ObjectReader& state, MapState& read, const std::string& where) {
  const Json& points = state.at("points");
  if (!points.is_array() || points.empty() || points.size() > kMostPoints)
    state.fail_at("points", "is no list of 1 to 10000 points");
  read.choices.points.resize(2, static_cast<Eigen::Index>(points.size()));
  for (std::size_t n = 0; n < points.size(); ++n) {
    ObjectReader point(points[n], where + ": a point");
    const double column = point.number("column", -kFarthestPoint, kFarthestPoint);
    const double row = point.number("row", -kFarthestPoint, kFarthestPoint);
    read.choices.points.col(static_cast<Eigen::Index>(n)) = Eigen::Vector2d(column, row);
    read.keys.push_back(point.find("key") == nullptr ? std::string() : point.text("key"));
    point.require_no_more();
  }
}

}  // namespace

Json to_json(const MapState& state) {
  const MapChoices& choices = state.choices;
  Json points = Json::array();
  for (Eigen::Index n = 0; n < choices.points.cols(); ++n) {
    const std::string& key = state.keys[static_cast<std::size_t>(n)];
    points.push_back({{"column", choices.points(0, n)},
                      {"row", choices.points(1, n)},
                      {"key", key.empty() ? Json() : Json(key)}});
  }
  return {{"schema", kMapSchema},
          {"manifold", state.manifold},
          {"way", choices.walks ? "walk" : "path"},
          {"points", points},
          {"frames", choices.frames ? Json(*choices.frames) : Json()},
          {"seconds", choices.walk.seconds},
          {"perturb", choices.walk.perturb},
          {"seed", choices.seed},
          {"travel", choices.travel},
          {"foot_fix", !choices.no_foot_fix}};
}

MapState read_map_state(const Json& json, const std::string& name) {
  ObjectReader reader(json, name);
  reader.require_schema(kMapSchema, kMapRoom);
  MapState state;
  state.manifold = reader.text("manifold");
  MapChoices& choices = state.choices;
  choices.walks = reader.text_of("way", {"path", "walk"}) == "walk";
  read_points(reader, state, name);
  if (reader.find("frames") != nullptr) {
    if (choices.walks) reader.fail_at("frames", "is of a path; a walk is as long as its 'seconds'");
    choices.frames = reader.count("frames", 1, 1'000'000);
  }
  choices.walk.seconds = reader.number("seconds", 0.1, 3600.0);
  choices.walk.perturb = reader.number("perturb", 0.0, 1e3);
  choices.seed = static_cast<std::uint64_t>(reader.count("seed", 0, 1'000'000));
  choices.travel = reader.text_of("travel", {"contacts", "primitives", "none"});
  choices.no_foot_fix = !reader.flag("foot_fix");
  reader.require_no_more();
  return state;
}

MapState parse_map_state(std::string_view text, const std::string& name) {
  return read_map_state(parse_state(text, name), name);
}

}  // namespace laban::cli
