#include "map_room.h"

#include <filesystem>

#include "laban/manifold/markov_chain.h"
#include "laban/manifold/pose_vector.h"
#include "laban/motion/retarget.h"

#include "manifold.h"

namespace laban::studio {
namespace {

/// Points of captures and of a clip that are drawn: more would not show.
constexpr Eigen::Index kMostDrawn = 3000;

manifold::PoseManifold read_manifold(const std::string& path) {
  cli::InputRecord record;
  return cli::read_manifold_file(path, record);
}

Eigen::Index stride_of(Eigen::Index count) {
  return std::max<Eigen::Index>(1, (count + kMostDrawn - 1) / kMostDrawn);
}

Json point_json(const Eigen::Vector2d& point) {
  return {point.x(), point.y()};
}

Json points_json(const Eigen::Ref<const Eigen::Matrix2Xd>& points) {
  Json json = Json::array();
  for (Eigen::Index n = 0; n < points.cols(); ++n) json.push_back(point_json(points.col(n)));
  return json;
}

/// The captures' ways over the map, a list a take.
Json takes_json(const manifold::PoseManifold& manifold) {
  const Eigen::Index stride = stride_of(manifold.points.cols());
  Json takes = Json::array();
  for (std::size_t n = 0; n < manifold.take_begins.size(); ++n) {
    const Eigen::Index begin = manifold.take_begins[n];
    const Eigen::Index end =
        n + 1 < manifold.take_begins.size() ? manifold.take_begins[n + 1] : manifold.points.cols();
    Json take = {{"points", Json::array()}, {"primitives", Json::array()}};
    for (Eigen::Index f = begin; f < end; f += stride) {
      take["points"].push_back(point_json(manifold.points.col(f)));
      take["primitives"].push_back(manifold.primitives.labels[static_cast<std::size_t>(f)]);
    }
    takes.push_back(std::move(take));
  }
  return takes;
}

Json primitives_json(const manifold::PoseManifold& manifold) {
  const Eigen::VectorXd stay = manifold::mean_stay(manifold.primitives.counts);
  Json primitives = Json::array();
  for (int k = 0; k < manifold.primitives.count(); ++k) {
    primitives.push_back({{"center", point_json(manifold.primitives.centers.col(k))},
                          {"stay_s", cli::finite_or_null(stay[k] / manifold.frame_rate_hz)}});
  }
  return primitives;
}

/// Row by row, from row 0 on; null for a map that has no nodes.
Json node_distances_json(const manifold::PoseManifold& manifold) {
  if (manifold.kind != manifold::MapKind::kSom) return {};
  const Eigen::MatrixXd distances = manifold::unit_distances(manifold.som);
  Json json = Json::array();
  for (Eigen::Index row = 0; row < distances.rows(); ++row)
    for (Eigen::Index column = 0; column < distances.cols(); ++column)
      json.push_back(distances(row, column));
  return json;
}

Eigen::Vector2d point_of(const Json& request) {
  const Json& point = at(request, "point");
  if (!point.is_array() || point.size() != 2 || !point[0].is_number() || !point[1].is_number())
    throw HttpError(400, "'point' is no list of two numbers");
  return {point[0].get<double>(), point[1].get<double>()};
}

}  // namespace

MapRoom::MapRoom(const Stage& stage, std::string path, Work& work)
    : stage_(stage), work_(work), path_(std::move(path)), manifold_(read_manifold(path_)) {}

Routes MapRoom::routes() {
  return {
      {"GET /api/map", [this](const Request&) { return json_response(open()); }},
      {"POST /api/map/clip",
       json_route([this](const Json& request) { return clip_path(request); })},
      {"POST /api/map/place", json_route([this](const Json& request) { return place(request); })},
      {"POST /api/map/pose", [this](const Request& request) { return pose(parsed_body(request)); }},
      {"POST /api/map/make", [this](const Request& request) { return made(parsed_body(request)); }},
      {"POST /api/map/state", state_route(cli::read_map_state)},
      {"POST /api/map/export", [this](const Request& request) {
         return exported(parsed_body(request), query_value(request, "format"));
       }}};
}

Json MapRoom::open() const {
  cli::MapState state;
  state.manifold = path_;
  state.choices.walks = true;
  state.choices.points = manifold_.points.leftCols(1);
  state.keys = {""};
  return {{"name", std::filesystem::path(path_).filename().string()},
          {"kind", manifold::name_of(manifold_.kind)},
          {"columns", manifold_.som.columns},
          {"rows", manifold_.som.rows},
          {"node_distances_m", node_distances_json(manifold_)},
          {"takes", takes_json(manifold_)},
          {"primitives", primitives_json(manifold_)},
          {"state", to_json(state)}};
}

Json MapRoom::clip_path(const Json& request) const {
  const motion::PoseMatrix pose = stage_.at(text_at(request, "clip")).clip.pose();
  const Eigen::Index stride = stride_of(pose.frame_count());
  std::vector<Eigen::Index> frames;
  for (Eigen::Index f = 0; f < pose.frame_count(); f += stride) frames.push_back(f);
  const Eigen::MatrixXd vectors = manifold::pose_vectors(pose);
  return {{"stride", stride},
          {"points", points_json(manifold_.places(vectors(Eigen::all, frames)))}};
}

Json MapRoom::place(const Json& request) const {
  const OpenClip& open = stage_.at(text_at(request, "clip"));
  const motion::Capture& capture = open.clip.capture;
  const int frame = index_at(request, "frame", capture.clip.frame_count());
  const Eigen::VectorXd vector =
      manifold::pose_vectors(
          motion::to_pose_matrix(capture.clip.slice(frame, frame + 1), capture.humanoid))
          .col(0);
  const Eigen::Vector2d point = manifold_.place(vector);
  const double away_m =
      manifold::mean_joint_distance(vector, manifold_.generator.at(point, manifold::kPoseRowCount));
  return {{"point", point_json(point)},
          {"away_cm", 100.0 * away_m},
          {"key", open.path + ":" + std::to_string(frame + open.clip.first_frame())}};
}

Response MapRoom::pose(const Json& request) const {
  const Eigen::Matrix2Xd point = point_of(request);
  const motion::Clip clip = manifold::play(manifold_, manifold::path_along(manifold_, point),
                                           {.travel = manifold::Travel::kNone});
  MotionMessage message{clip, manifold_.rig.humanoid};
  message.more = {{"primitive", manifold_.primitive_at(point)}};
  return {200, "application/x-laban-motion", motion_bytes(message)};
}

cli::MadeMapMotion MapRoom::make(const Json& request) const {
  const cli::MapState state = cli::read_map_state(at(request, "state"), "the state");
  if (state.manifold != path_) {
    throw HttpError(409, "the state is of the manifold '" + state.manifold +
                             "'; open it with: laban studio --manifold " + state.manifold);
  }
  return cli::make_map_motion(manifold_, state.choices, &work_);
}

Response MapRoom::made(const Json& request) const {
  const cli::MadeMapMotion made = make(request);
  MotionMessage message{made.clip, manifold_.rig.humanoid};
  message.more = {{"path", points_json(made.path.points)},
                  {"passed", made.path.passed},
                  {"primitives", made.path.primitives},
                  {"cuts", made.path.cuts},
                  {"jumps", made.path.jumps}};
  return {200, "application/x-laban-motion", motion_bytes(message)};
}

Response MapRoom::exported(const Json& request, const std::string& format) const {
  require_clip_format(format);
  const std::string name = std::filesystem::path(path_).stem().string() + "." + format;
  return {200, "application/octet-stream",
          cli::clip_bytes(name, make(request).clip, stage_.common()), name};
}

}  // namespace laban::studio
