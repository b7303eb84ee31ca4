#include "texture_room.h"

#include <cmath>
#include <filesystem>

#include "laban/texture/texton_path.h"

#include "texture.h"
#include "texture_play.h"

namespace laban::studio {
namespace {

/// Textons of the state to begin with.
constexpr std::size_t kFirstTextons = 4;
constexpr double kPieceS = 4.0;
/// Pieces of a walk that are made again at most to come to one that is asked for.
constexpr int kMostPieces = 1000;
/// Pieces of a walk: weeks of it.
constexpr int kLastPiece = 1'000'000;
constexpr int kLongestPath = 1000;
/// Frames of a path that are kept at most, about 10 MB.
constexpr Eigen::Index kMostFramesKept = 20'000;

texture::MotionTexture read_texture(const std::string& path) {
  cli::InputRecord record;
  return cli::read_texture_file(path, record);
}

bool same(const texture::TextureMotionOptions& a, const texture::TextureMotionOptions& b) {
  return a.seed == b.seed && a.noise_level == b.noise_level && a.variation == b.variation &&
         a.hold_feet == b.hold_feet;
}

/// The cheapest path from a texton by others back to it; cheapest_path stays where it is.
std::optional<std::vector<int>> cheapest_round(const Eigen::MatrixXd& transitions, int texton) {
  std::optional<std::vector<int>> best;
  for (int next = 0; next < transitions.cols(); ++next) {
    if (next == texton || !(transitions(texton, next) > 0.0)) continue;
    auto path = texture::cheapest_path(transitions, next, texton);
    if (!path) continue;
    path->insert(path->begin(), texton);
    if (!best || texture::path_cost(transitions, *path) < texture::path_cost(transitions, *best))
      best = std::move(path);
  }
  return best;
}

}  // namespace

TextureRoom::TextureRoom(const Stage& stage, std::string path, Work& work)
    : stage_(stage), work_(work), path_(std::move(path)), texture_(read_texture(path_)) {}

Routes TextureRoom::routes() {
  return {
      {"GET /api/texture", [this](const Request&) { return json_response(open()); }},
      {"POST /api/texture/path", json_route([this](const Json& request) { return path(request); })},
      {"POST /api/texture/make",
       [this](const Request& request) { return made(parsed_body(request)); }},
      {"POST /api/texture/walk",
       [this](const Request& request) { return walk(parsed_body(request)); }},
      {"POST /api/texture/state", state_route(cli::read_texture_state)},
      {"POST /api/texture/export", [this](const Request& request) {
         return exported(parsed_body(request), query_value(request, "format"));
       }}};
}

Json TextureRoom::open() const {
  cli::TextureState state{path_, {}};
  for (const texture::Segment& segment : texture_.segments) {
    if (segment.begin >= texture_.takes.front().length ||
        state.choices.path.size() == kFirstTextons)
      break;
    state.choices.path.push_back({{segment.texton, std::nullopt}, {}});
  }
  Json json = {{"name", std::filesystem::path(path_).filename().string()},
               {"frame_rate_hz", texture_.frame_rate_hz},
               {"textons", Json::array()},
               {"transitions", Json::array()},
               {"state", to_json(state)}};
  std::vector<std::pair<int, int>> totals(texture_.textons.size());  // segments, frames
  for (const texture::Segment& segment : texture_.segments) {
    ++totals[static_cast<std::size_t>(segment.texton)].first;
    totals[static_cast<std::size_t>(segment.texton)].second += segment.length;
  }
  for (const auto& [segments, frames] : totals)
    json["textons"].push_back({{"segments", segments}, {"frames", frames}});
  const Eigen::MatrixXd transitions = texture::transition_matrix(texture_);
  for (int from = 0; from < texture_.texton_count(); ++from) {
    for (int to = 0; to < texture_.texton_count(); ++to)
      if (transitions(from, to) > 0.0)
        json["transitions"].push_back({from, to, transitions(from, to)});
  }
  return json;
}

Json TextureRoom::path(const Json& request) const {
  const int from = index_at(request, "from", texture_.texton_count());
  const int to = index_at(request, "to", texture_.texton_count());
  const Eigen::MatrixXd transitions = texture::transition_matrix(texture_);
  const auto find = [&]() -> std::optional<std::vector<int>> {
    if (!request.value("length", Json()).is_null())
      return texture::path_of_length(transitions, from, to,
                                     index_at(request, "length", kLongestPath + 1));
    return from == to && request.value("bridge", Json()) == true
               ? cheapest_round(transitions, from)
               : texture::cheapest_path(transitions, from, to);
  };
  const auto found = find();
  return {
      {"path", found ? Json(*found) : Json()},
      {"cost_nats", found ? cli::finite_or_null(texture::path_cost(transitions, *found)) : Json()}};
}

cli::TextureState TextureRoom::state_of(const Json& request) const {
  cli::TextureState state = cli::read_texture_state(at(request, "state"), "the state");
  if (state.texture != path_) {
    throw HttpError(409, "the state is of the texture '" + state.texture +
                             "'; open it with: laban studio --texture " + state.texture);
  }
  return state;
}

cli::MadeTexture TextureRoom::make(const cli::TextureState& state) {
  Json asked = to_json(state);
  for (Json& texton : asked["textons"]) texton.erase("pins");
  if (drawn_ && drawn_->asked == asked)
    return cli::play_path(texture_, state.choices, drawn_->motion, {}, {}, &work_);
  drawn_.reset();
  texture::PathMotion motion = cli::draw_path(texture_, state.choices, {}, &work_);
  if (motion.observations.cols() <= kMostFramesKept) drawn_ = Drawn{std::move(asked), motion};
  return cli::play_path(texture_, state.choices, std::move(motion), {}, {}, &work_);
}

Response TextureRoom::made(const Json& request) {
  const cli::MadeTexture made = make(state_of(request));
  const bool draft = request.value("draft", Json()) == true;
  Json pinned = Json::array();
  for (const cli::PinnedTexton& one : made.pinned) {
    pinned.push_back({{"part", one.part},
                      {"state_deviations", one.state_deviations},
                      {"residual_deviations", one.residual_deviations}});
  }
  MotionMessage message{made.clip, texture_.rig.humanoid};
  message.more = {{"parts", cli::to_json(made.parts)},
                  {"pinned", pinned},
                  {"quality", draft ? Json() : cli::quality_json(texture_, made.clip)}};
  return {200, "application/x-laban-motion", motion_bytes(message)};
}

Response TextureRoom::exported(const Json& request, const std::string& format) {
  require_clip_format(format);
  const std::string name = std::filesystem::path(path_).stem().string() + "." + format;
  const cli::MadeTexture made = make(state_of(request));
  return {200, "application/octet-stream", cli::clip_bytes(name, made.clip, stage_.common()), name};
}

Response TextureRoom::walk(const Json& request) {
  const texture::TextureMotionOptions options = state_of(request).choices.options;
  const int piece = index_at(request, "piece", kLastPiece + 1);
  if (!walk_ || !same(walk_->options, options) || walk_->given > piece)
    walk_.emplace(Walk{options, texture::TextureMotion(texture_, options), 0});
  if (piece - walk_->given > kMostPieces)
    throw HttpError(400, "the walk is too far back to be made again: begin another");
  const int frames = std::max(1, static_cast<int>(std::lround(kPieceS * texture_.frame_rate_hz)));
  for (; walk_->given < piece; ++walk_->given)
    static_cast<void>(walk_->motion.next(frames, &work_));
  ++walk_->given;
  const texture::TextureClip made = walk_->motion.next(frames, &work_);
  MotionMessage message{made.clip, texture_.rig.humanoid};
  message.more = {{"parts", cli::to_json(made.parts)}};
  return {200, "application/x-laban-motion", motion_bytes(message)};
}

}  // namespace laban::studio
