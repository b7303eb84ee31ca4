#include "loop_state.h"

#include "laban/base/error.h"

#include "state_reader.h"

namespace laban::cli {
namespace {

constexpr const char* kLoopSchema = "laban.loop-room/1";
constexpr const char* kLoopRoom = "the loop room";
/// An hour: more is for --stream.
constexpr double kMostSeconds = 3600.0;
/// While a seamless loop is asked for.
constexpr double kUsualSeconds = 20.0;

SeamChoices read_seam(const Json& json, const std::string& where) {
  ObjectReader reader(json, where + ": 'seam'");
  SeamChoices seam;
  seam.options.texton_frames = reader.count("texton_frames", 8, 2000);
  seam.options.texton_s = reader.number("texton_s", 0.0, 60.0);
  seam.options.overlap_frames = reader.count("overlap", 4, 2000);
  seam.options.blend_frames = reader.count("blend_frames", 1, 2000);
  seam.metric = reader.text_of("seam_metric", {"difference", "gradient"});
  seam.no_poisson = !reader.flag("poisson");
  seam.options.joint_weight = reader.number("joint_weight", 0.0, 1e6);
  reader.require_no_more();
  return seam;
}

TurningChoices read_turning(const Json& json, const std::string& where) {
  ObjectReader reader(json, where + ": 'turning'");
  TurningChoices turning;
  turning.distance = reader.text_of("distance", {"mahalanobis", "l2"});
  turning.options.threshold = reader.number("threshold", 0.0, 1.0);
  turning.options.window_s = reader.number("window_s", 0.01, 60.0);
  turning.options.falloff = reader.count("falloff", 1, 1000);
  turning.options.apart_s = reader.number("apart_s", 0.0, 60.0);
  reader.require_no_more();
  return turning;
}

}  // namespace

Json to_json(const LoopState& state) {
  const LoopChoices& choices = state.choices;
  return {{"schema", kLoopSchema},
          {"input", state.input},
          {"kind", choices.seamless ? "seamless" : "endless"},
          {"seconds", choices.length.seconds.value_or(kUsualSeconds)},
          {"in_place", choices.options.in_place},
          {"turns", !choices.no_turns},
          {"seams", !choices.no_seams},
          {"seam_count", choices.options.seam_count},
          {"probability_step", choices.options.probability_step},
          {"foot_fix", !choices.no_foot_fix},
          {"seed", choices.options.seed},
          {"seam", to_json(choices.seam)},
          {"turning", to_json(choices.turning)},
          {"reading", to_json(state.reading)}};
}

LoopState read_loop_state(const Json& json, const std::string& name) {
  ObjectReader reader(json, name);
  reader.require_schema(kLoopSchema, kLoopRoom);
  LoopState state;
  state.input = reader.text("input");
  LoopChoices& choices = state.choices;
  choices.seamless = reader.text_of("kind", {"seamless", "endless"}) == "seamless";
  // Kept by the room while a seamless loop is shown.
  const double seconds = reader.number("seconds", 0.1, kMostSeconds);
  if (!choices.seamless) choices.length.seconds = seconds;
  choices.options.in_place = reader.flag("in_place");
  choices.no_turns = !reader.flag("turns");
  choices.no_seams = !choices.seamless && !reader.flag("seams");
  choices.options.seam_count = reader.count("seam_count", 1, 100);
  choices.options.probability_step = reader.number("probability_step", 0.0, 2.0);
  choices.no_foot_fix = !reader.flag("foot_fix");
  choices.options.seed = static_cast<std::uint64_t>(reader.count("seed", 0, 1000000));
  choices.seam = read_seam(reader.at("seam"), name);
  choices.turning = read_turning(reader.at("turning"), name);
  state.reading = read_reading(reader.at("reading"), name);
  (void)reader.find("seams");
  reader.require_no_more();
  try {
    (void)choices.resolved();
  } catch (const base::Error& error) {
    throw base::Error(base::ErrorKind::kFormat, name + ": " + error.what());
  }
  return state;
}

LoopState parse_loop_state(std::string_view text, const std::string& name) {
  return read_loop_state(parse_state(text, name), name);
}

}  // namespace laban::cli
