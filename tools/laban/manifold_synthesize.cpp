#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/draw/contact_sheet.h"
#include "laban/manifold/map_path.h"
#include "laban/motion/retarget.h"

#include "manifold.h"
#include "map_state.h"
#include "number_checks.h"
#include "state_reader.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

struct ManifoldSynthesizeVerb {
  Common common;
  ReadClipOptions reading;
  WriteClipOptions writing;
  std::string input;
  std::string output;
  std::string picture;
  std::vector<std::string> through;
  std::vector<std::string> keys;
  std::string start;
  std::string state;
  MapChoices choices;
};

/// All of `text` as a number; not a number if it is none.
double parse_coordinate(std::string_view text) {
  double value = 0.0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failed == std::errc() && end == text.data() + text.size() ? value : std::nan("");
}

/// All of `text` as a whole number; -1 if it is none.
int parse_frame(std::string_view text) {
  int value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failed == std::errc() && end == text.data() + text.size() ? value : -1;
}

Eigen::Matrix2Xd parse_points(const ManifoldSynthesizeVerb& verb,
                              const manifold::PoseManifold& manifold) {
  Eigen::Matrix2Xd points(2, std::ssize(verb.through));
  const Eigen::Vector2d end = manifold.region().high;
  for (std::size_t n = 0; n < verb.through.size(); ++n) {
    const std::string& text = verb.through[n];
    const std::size_t comma = std::min(text.find(','), text.size());
    const double x = parse_coordinate(std::string_view(text).substr(0, comma));
    const double y =
        parse_coordinate(std::string_view(text).substr(std::min(comma + 1, text.size())));
    // Not a number fails every comparison.
    if (!(x >= 0.0 && x <= end.x() && y >= 0.0 && y <= end.y())) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("--through {}: a point is COLUMN,ROW on the map, 0,0 to {:g},{:g}",
                              text, end.x(), end.y()));
    }
    points.col(static_cast<Eigen::Index>(n)) << x, y;
  }
  return points;
}

/// Where poses CLIP:FRAME lie on the map; each clip is read once.
class KeyPlaces {
 public:
  KeyPlaces(const ManifoldSynthesizeVerb& verb, const manifold::PoseManifold& manifold)
      : verb_(verb), manifold_(manifold) {}

  Eigen::Vector2d place(const std::string& option, const std::string& key) {
    const std::size_t colon = key.rfind(':');
    const int frame =
        colon == std::string::npos ? -1 : parse_frame(std::string_view(key).substr(colon + 1));
    if (frame < 0 || colon == 0) {
      throw Error(ErrorKind::kUsage, fmt::format("{} {}: a pose is CLIP:FRAME", option, key));
    }
    const CapturedClip& clip = read(key.substr(0, colon));
    const int count = clip.file.clip.frame_count();
    if (frame >= count) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("{} {}: the clip has frames 0 to {}", option, key, count - 1));
    }
    int in_motion = frame - clip.first_frame();
    if (in_motion < 0) {
      warn(verb_.common, fmt::format("{}: frame {} is a T-pose and no motion; frame {} is taken",
                                     key, frame, clip.first_frame()));
      in_motion = 0;
    }
    const motion::PoseMatrix pose = motion::to_pose_matrix(
        clip.capture.clip.slice(in_motion, in_motion + 1), clip.capture.humanoid);
    const Eigen::VectorXd vector = manifold::pose_vectors(pose).col(0);
    const Eigen::Vector2d point = manifold_.place(vector);
    const double away = manifold::mean_joint_distance(
        vector, manifold_.generator.at(point, manifold::kPoseRowCount));
    tell(verb_.common, fmt::format("{} lies at {:g},{:g}; the pose there is {:.1f} cm a joint away",
                                   key, point.x(), point.y(), 100.0 * away));
    return point;
  }
  [[nodiscard]] const std::vector<InputRecord>& records() const { return records_; }

 private:
  const CapturedClip& read(const std::string& path) {
    const auto found = clips_.find(path);
    if (found != clips_.end()) return found->second;
    CapturedClip clip = read_captured_clip(path, verb_.reading, verb_.common);
    records_.push_back(clip.record);
    return clips_.emplace(path, std::move(clip)).first->second;
  }

  const ManifoldSynthesizeVerb& verb_;
  const manifold::PoseManifold& manifold_;
  std::map<std::string, CapturedClip> clips_;
  std::vector<InputRecord> records_;
};

/// The points that --through, --keys or --start name.
Eigen::Matrix2Xd asked_points(const ManifoldSynthesizeVerb& verb,
                              const manifold::PoseManifold& manifold, KeyPlaces& keys) {
  if (!verb.through.empty()) return parse_points(verb, manifold);
  if (!verb.start.empty()) return keys.place("--start", verb.start);
  Eigen::Matrix2Xd places(2, std::ssize(verb.keys));
  for (std::size_t n = 0; n < verb.keys.size(); ++n)
    places.col(static_cast<Eigen::Index>(n)) = keys.place("--keys", verb.keys[n]);
  return places;
}

void check_request(const ManifoldSynthesizeVerb& verb) {
  const int ways =
      (verb.through.empty() ? 0 : 1) + (verb.keys.empty() ? 0 : 1) + (verb.start.empty() ? 0 : 1);
  if (ways != 1 && verb.state.empty()) {
    throw Error(ErrorKind::kUsage, "say where to go: either --through, --keys or --start");
  }
  if (verb.choices.frames && !verb.start.empty()) {
    throw Error(ErrorKind::kUsage, "--frames is for --through and --keys; a walk takes --seconds");
  }
  static_cast<void>(check_clip_output(verb.output, verb.writing));
  if (!verb.picture.empty()) static_cast<void>(is_svg(verb.picture));
  check_outputs(verb.common, {verb.output, verb.picture});
}

void write_picture(const ManifoldSynthesizeVerb& verb, const manifold::PoseManifold& manifold,
                   const motion::Clip& clip, const manifold::MapPath& path) {
  if (verb.picture.empty()) return;
  draw::Strip strip{with_standard_names(clip, manifold.rig.humanoid),
                    std::filesystem::path(verb.output).stem().string(),
                    {},
                    fmt::format("{} frames at {:g} Hz", clip.frame_count(), clip.frame_rate_hz())};
  for (const int frame : path.passed) strip.marks_s.push_back(frame / clip.frame_rate_hz());
  draw::ContactSheetOptions options;
  options.format = is_svg(verb.picture) ? draw::Format::kSvg : draw::Format::kPng;
  write_bytes(verb.picture, draw::contact_sheet({&strip, 1}, options), verb.common);
}

Json points_json(const Eigen::Matrix2Xd& points) {
  Json json = Json::array();
  for (Eigen::Index n = 0; n < points.cols(); ++n) json.push_back({points(0, n), points(1, n)});
  return json;
}

void print(const ManifoldSynthesizeVerb& verb, const manifold::MapPath& path,
           const motion::Clip& clip, const std::vector<InputRecord>& records) {
  if (path.jumps > 0) {
    warn(verb.common,
         fmt::format("{} time{} nothing was known to follow a primitive; the walk went "
                     "on to the one of nearest pose",
                     path.jumps, path.jumps == 1 ? "" : "s"));
  }
  if (verb.common.json) {
    Json json = {{"schema", "laban.manifold_synthesize/1"},
                 {"output", verb.output},
                 {"frames", clip.frame_count()},
                 {"frame_rate_hz", clip.frame_rate_hz()},
                 {"primitives", path.primitives},
                 {"waypoint_frames", path.passed},
                 {"jumps", path.jumps},
                 {"run", run_record("manifold synthesize",
                                    {{"seed", verb.choices.seed},
                                     {"through", verb.through},
                                     {"keys", verb.keys},
                                     {"start", verb.start},
                                     {"seconds", verb.choices.walk.seconds},
                                     {"perturb", verb.choices.walk.perturb},
                                     {"travel", verb.choices.travel},
                                     {"points", points_json(verb.choices.points)},
                                     {"foot_fix", !verb.choices.no_foot_fix}},
                                    records)}};
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: {} frames at {:g} Hz ({:.2f} s)\n", verb.output, clip.frame_count(),
             clip.frame_rate_hz(), clip.duration_s());
  if (path.primitives.empty()) return;
  std::string walked;
  for (std::size_t n = 0; n < path.primitives.size() && n < 40; ++n) {
    walked += " " + std::to_string(path.primitives[n]);
  }
  fmt::print("primitives:{}{}\n", walked, path.primitives.size() > 40 ? " .." : "");
}

/// What the studio's map room was set to; MANIFOLD stands above its own.
void take_state(ManifoldSynthesizeVerb& verb) {
  MapState state = parse_map_state(read_bytes(verb.state), verb.state);
  verb.choices = std::move(state.choices);
  if (verb.input.empty()) verb.input = std::move(state.manifold);
}

void run(ManifoldSynthesizeVerb& verb) {
  verb.choices.seed = verb.common.seed;
  if (!verb.state.empty()) take_state(verb);
  if (verb.input.empty()) throw CLI::RequiredError("MANIFOLD");
  check_request(verb);
  InputRecord record;
  const manifold::PoseManifold manifold = read_manifold_file(verb.input, record);
  KeyPlaces keys(verb, manifold);
  if (verb.state.empty()) {
    verb.choices.walks = !verb.start.empty();
    verb.choices.points = asked_points(verb, manifold, keys);
  }
  const MadeMapMotion made = make_map_motion(manifold, verb.choices,
                                             terminal_progress(verb.common, "making motion").get());
  write_clip(verb.output, made.clip, verb.common, {}, verb.writing);
  write_picture(verb, manifold, made.clip, made.path);
  std::vector<InputRecord> records{record};
  records.insert(records.end(), keys.records().begin(), keys.records().end());
  if (verb.output != "-") print(verb, made.path, made.clip, records);
}

}  // namespace

void add_manifold_synthesize(CLI::App* manifold) {
  auto verb = std::make_shared<ManifoldSynthesizeVerb>();
  CLI::App* sub = add_verb(
      *manifold, "synthesize", "Make a clip from points, key poses or a walk on a map",
      "laban manifold synthesize ballet.manifold --through 10,12 40,31 20,55 --frames 80 -o "
      "out.bvh");
  sub->add_option("MANIFOLD", verb->input, "manifold file (.manifold)");
  sub->add_option("-o,--output", verb->output, "clip to write (.bvh or .glb), '-' for stdout")
      ->required();
  sub->add_option("--picture", verb->picture, "contact sheet of the output (.png or .svg)");
  const std::vector<CLI::Option*> others = sub->get_options();
  sub->add_option("--through", verb->through, "points COLUMN,ROW of the map, a spline between them")
      ->expected(1, -1);
  sub->add_option("--keys", verb->keys, "key poses CLIP:FRAME, a spline between their places")
      ->expected(1, -1);
  sub->add_option("--start", verb->start, "pose CLIP:FRAME from which to walk over primitives");
  sub->add_option("--frames", verb->choices.frames,
                  "frames of the output (default: as fast as the captures move)")
      ->check(CLI::Range(1, 1000000));
  sub->add_option("--seconds", verb->choices.walk.seconds, "length of the walk")
      ->check(positive_number())
      ->capture_default_str();
  sub->add_option("--perturb", verb->choices.walk.perturb,
                  "noise on what follows what; 0: the likeliest")
      ->check(number_from_0())
      ->capture_default_str();
  sub->add_option("--travel", verb->choices.travel,
                  "travel over the ground from feet that stand, or from the captures' own")
      ->check(CLI::IsMember({"contacts", "primitives", "none"}))
      ->capture_default_str();
  sub->add_flag("--no-foot-fix", verb->choices.no_foot_fix, "leave the feet as the map gives them");
  add_read_options(sub, verb->reading);
  add_state_option(sub, verb->state, "map room", others);
  add_write_options(sub, verb->writing);
  add_common(sub, verb->common, {.writes = true, .seed = true});
  sub->get_option("--state")->excludes(sub->get_option("--seed"));
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
