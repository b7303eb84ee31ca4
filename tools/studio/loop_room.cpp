#include "loop_room.h"

#include "report.h"

namespace laban::studio {

Routes LoopRoom::routes() {
  return {
      {"POST /api/loop/open",
       json_route([this](const Json& request) { return open(text_at(request, "clip")); })},
      {"POST /api/loop/turns", json_route([this](const Json& request) { return turns(request); })},
      {"POST /api/loop/make",
       [this](const Request& request) { return made(parsed_body(request)); }},
      {"POST /api/loop/state", state_route(cli::read_loop_state)},
      {"POST /api/loop/export", [this](const Request& request) {
         return exported(parsed_body(request), query_value(request, "format"));
       }}};
}

Json LoopRoom::open(const std::string& id) const {
  cli::LoopState state;
  state.input = stage_.at(id).path;
  state.reading = stage_.reading();
  state.choices.seamless = true;
  return {{"state", to_json(state)}};
}

Json LoopRoom::turns(const Json& request) const {
  const OpenClip& open = stage_.at(text_at(request, "clip"));
  const cli::LoopState state = cli::read_loop_state(at(request, "state"), "the state");
  const motion::PoseMatrix pose = open.clip.pose();
  const loop::Turning turning =
      loop::find_turning_points(pose.angles, pose.frame_rate_hz, state.choices.turning.resolved());
  Json json = {{"frame_rate_hz", pose.frame_rate_hz},
               {"symmetry", Json::array()},
               {"points", Json::array()}};
  for (const double value : turning.symmetry)
    json["symmetry"].push_back(value < 0.0 ? Json() : Json(value));
  for (const loop::TurningPoint& point : turning.points)
    json["points"].push_back({{"frame", point.frame}, {"symmetry", point.symmetry}});
  return json;
}

cli::MadeLoop LoopRoom::make(const Json& request) const {
  const OpenClip& open = stage_.at(text_at(request, "clip"));
  const cli::LoopState state = cli::read_loop_state(at(request, "state"), "the state");
  return cli::naming(open.path, [&] { return cli::make_loop(state.choices, open.clip, &work_); });
}

Response LoopRoom::made(const Json& request) const {
  const cli::CapturedClip& input = stage_.at(text_at(request, "clip")).clip;
  const cli::MadeLoop loop = make(request);
  MotionMessage message{loop.clip, input.capture.humanoid, loop.source_frames};
  message.more = {{"report", cli::loop_report(input, loop)}};
  return {200, "application/x-laban-motion", motion_bytes(message)};
}

Response LoopRoom::exported(const Json& request, const std::string& format) const {
  require_clip_format(format);
  const OpenClip& open = stage_.at(text_at(request, "clip"));
  const std::string name = open.made_name("loop", format);
  return {200, "application/octet-stream",
          cli::loop_bytes(open.clip, make(request), name, {}, stage_.common()), name};
}

}  // namespace laban::studio
