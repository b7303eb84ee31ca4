#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/motion/mirror.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/motion/root_motion.h"

#include "effort_curve.h"
#include "files.h"
#include "number_checks.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct ConvertVerb {
  Common common;
  ReadClipOptions reading;
  EffortCurveOptions effort;
  std::string input;
  std::string output;
  WriteClipOptions writing;
  std::optional<double> rate_hz;
  std::optional<double> output_unit_m;
  std::string up_axis = "y";
  std::optional<int> begin;
  std::optional<int> end;
  bool mirror = false;
  std::string to_rig;
  std::string to_map;
  std::string root_motion = "keep";
  std::string data = "positions";
};

/// A clip on its way from one file to another. What needs a person finds one, once, in the clip as
/// it was read; a T-pose frame, where there is one, is then no longer part of the clip.
class Conversion {
 public:
  Conversion(const ConvertVerb& verb, const io::ClipFile& file)
      : verb_(verb), clip_(file.clip), source_{file.unit_m, file.asset, {}} {
    for (int f = 0; f < clip_.frame_count(); ++f) source_.source_frames.push_back(f);
  }

  [[nodiscard]] const motion::Clip& clip() const { return clip_; }
  /// The file whose rig the clip is on.
  [[nodiscard]] const ClipSource& source() const { return source_; }

  const motion::Humanoid& find_person() {
    if (person_) return *person_;
    try {
      motion::Capture capture = motion::find_capture(clip_, read_map(verb_.reading.map));
      frames_cut_ = clip_.frame_count() - capture.clip.frame_count();
      clip_ = std::move(capture.clip);
      cut_source(frames_cut_, clip_.frame_count());
      return person_.emplace(std::move(capture.humanoid));
    } catch (const base::Error& error) {
      throw base::Error(error.kind(), verb_.input + ": " + error.what());
    }
  }

  /// Frames count as in the file.
  void trim() {
    if (!verb_.begin && !verb_.end) return;
    const int begin = std::max(0, verb_.begin.value_or(0) - frames_cut_);
    clip_ = clip_.slice(begin, verb_.end ? *verb_.end - frames_cut_ : clip_.frame_count());
    cut_source(begin, clip_.frame_count());
  }

  void resample() {
    if (!verb_.rate_hz) return;
    const double step = clip_.frame_rate_hz() / *verb_.rate_hz;
    const double first = source_.source_frames.front();
    clip_ = motion::resample(clip_, *verb_.rate_hz);
    source_.source_frames.clear();
    for (int f = 0; f < clip_.frame_count(); ++f) {
      source_.source_frames.push_back(first + f * step);
    }
  }

  void mirror() { clip_ = motion::mirrored(clip_, find_person()); }

  void retarget() {
    const motion::Humanoid& own = find_person();
    ReadClipOptions reading;
    reading.map = verb_.to_map;
    CapturedClip rig = read_captured_clip(verb_.to_rig, reading, verb_.common);
    const motion::PlanarPose start = motion::planar_start(clip_, own);
    clip_ = motion::from_pose_matrix(motion::to_pose_matrix(clip_, own), rig.capture.humanoid,
                                     rig.capture.clip.slice(0, 1), {{}, start});
    // The rig stands still: whatever else it animates is shown as in its first frame.
    source_ = {rig.file.unit_m, rig.file.asset,
               std::vector<double>(static_cast<std::size_t>(clip_.frame_count()), 0.0)};
    person_ = std::move(rig.capture.humanoid);
  }

  void stay_in_place() { clip_ = motion::in_place(clip_, find_person()); }

  void add_root_joint() {
    clip_ = motion::with_root_joint(clip_, find_person());
    if (source_.asset) {
      warn(verb_.common, verb_.output + ": written without the character, which has no such joint");
      source_.asset = nullptr;
    }
  }

 private:
  /// Of the frames so far, `count` from `begin` on are kept.
  void cut_source(int begin, int count) {
    auto& frames = source_.source_frames;
    frames.erase(frames.begin(), frames.begin() + begin);
    frames.resize(static_cast<std::size_t>(count));
  }

  const ConvertVerb& verb_;
  motion::Clip clip_;
  ClipSource source_;
  int frames_cut_ = 0;
  std::optional<motion::Humanoid> person_;
};

io::MotionTable make_table(const ConvertVerb& verb, Conversion& conversion) {
  if (verb.data == "positions") return io::joint_position_table(conversion.clip());
  const motion::Humanoid& person = conversion.find_person();
  const motion::PoseMatrix pose = motion::to_pose_matrix(conversion.clip(), person);
  if (verb.data == "pose") return io::pose_table(pose);
  InputRecord record;
  const transfer::StyleModel model = read_model(verb.effort.model, record);
  const motion::PoseMatrix at_model_rate = motion::resample(pose, model.frame_rate_hz());
  const std::string content = content_of(model, at_model_rate, verb.effort.content);
  if (content.empty()) {
    warn(verb.common, verb.input +
                          ": it matches no content of the model; measured against all contents "
                          "pooled");
  }
  return effort_table(model, pose, content, verb.effort.window_s);
}

void print(const ConvertVerb& verb, const motion::Clip& clip) {
  if (verb.output == "-") return;
  if (verb.common.json) {
    const Json json = {{"schema", "laban.convert/1"},
                       {"output", verb.output},
                       {"frames", clip.frame_count()},
                       {"frame_rate_hz", clip.frame_rate_hz()},
                       {"joints", clip.joint_count()}};
    fmt::print("{}\n", json.dump(2));
  } else {
    fmt::print("{}: {} joints, {} frames at {:g} Hz\n", verb.output, clip.joint_count(),
               clip.frame_count(), clip.frame_rate_hz());
  }
}

void run(const ConvertVerb& verb) {
  check_outputs(verb.common, {verb.output});
  const std::string table = table_format(verb.output, verb.writing.format);
  if (table.empty()) check_clip_output(verb.output, verb.writing);
  Conversion conversion(verb, read_any_clip(verb.input, verb.reading, verb.common));
  const bool moves_root = verb.root_motion != "keep";
  if (moves_root && !table.empty() && verb.data != "positions") {
    throw base::Error(
        base::ErrorKind::kUsage,
        "--root-motion changes clips and positions; leave it out for --data " + verb.data);
  }
  const bool needs_person = verb.mirror || !verb.to_rig.empty() || moves_root ||
                            (!table.empty() && verb.data != "positions");
  if (needs_person) conversion.find_person();
  conversion.trim();
  conversion.resample();
  if (verb.mirror) conversion.mirror();
  if (!verb.to_rig.empty()) conversion.retarget();
  if (verb.root_motion == "in-place") conversion.stay_in_place();
  if (verb.root_motion == "root-joint") conversion.add_root_joint();
  if (table.empty()) {
    ClipSource source = conversion.source();
    if (verb.output_unit_m) source.unit_m = *verb.output_unit_m;
    write_clip(verb.output, conversion.clip(), verb.common, source, verb.writing);
  } else {
    write_table(verb.output, make_table(verb, conversion), verb.common, verb.writing.format);
  }
  print(verb, conversion.clip());
}

}  // namespace

void add_convert(CLI::App& app) {
  auto verb = std::make_shared<ConvertVerb>();
  CLI::App* sub =
      add_verb(app, "convert",
               "Change the format, rig, rate, axes, root motion or range of a clip; write it as "
               "numbers",
               "laban convert capture.bvh --rate 60 -o capture.glb");
  sub->add_option("INPUT", verb->input, "clip")->required();
  sub->add_option("-o,--output", verb->output,
                  "clip (.bvh, .glb) or table (.csv, .npy) to write, '-' for stdout")
      ->required();
  sub->add_option("--begin", verb->begin, "first frame to keep");
  sub->add_option("--end", verb->end, "one past the last frame to keep");
  sub->add_option("--rate", verb->rate_hz, "frame rate of the output, Hz")
      ->check(positive_number());
  sub->add_flag("--mirror", verb->mirror, "swap left and right");
  sub->add_option("--to-rig", verb->to_rig,
                  "clip whose rig is to play the motion, in its own proportions");
  sub->add_option("--to-map", verb->to_map, "as --map, for the rig of --to-rig");
  sub->add_option("--root-motion", verb->root_motion,
                  "keep; in-place: no travel over the ground; root-joint: travel and turns on a "
                  "joint of their own")
      ->check(CLI::IsMember({"keep", "in-place", "root-joint"}))
      ->capture_default_str();
  sub->add_option("--output-unit", verb->output_unit_m,
                  "metres per unit of a BVH output (default: the input's)")
      ->check(positive_number());
  sub->add_option("--data", verb->data,
                  "what a table holds: positions of joints, pose matrix, or effort over time")
      ->check(CLI::IsMember({"positions", "pose", "effort"}))
      ->capture_default_str();
  add_effort_curve_options(sub, verb->effort);
  add_read_options(sub, verb->reading);
  add_write_options(sub, verb->writing);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
