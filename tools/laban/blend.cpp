#include <fmt/core.h>

#include "laban/blend/space_time_interpolation.h"
#include "laban/motion/retarget.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct BlendVerb {
  Common common;
  ReadClipOptions reading;
  std::string first;
  std::string second;
  std::string output;
  WriteClipOptions writing;
  double alpha = 0.5;
};

void run(const BlendVerb& verb) {
  check_outputs(verb.common, {verb.output});
  (void)check_clip_output(verb.output, verb.writing);
  const CapturedClip first = read_captured_clip(verb.first, verb.reading, verb.common);
  const CapturedClip second = read_captured_clip(verb.second, verb.reading, verb.common);
  const motion::PoseMatrix pose = first.pose();
  blend::Blend result =
      blend::blend(transfer::align_pair(pose, second.pose(pose.frame_rate_hz)), verb.alpha);
  // Played on the first clip's body: travel scales to its legs.
  result.pose.leg_length_m = pose.leg_length_m;
  const motion::Clip clip = motion::from_pose_matrix(
      result.pose, first.capture.humanoid, first.capture.clip, {result.times_i, std::nullopt});
  std::vector<double> source_frames(result.times_i.begin(), result.times_i.end());
  for (double& frame : source_frames) frame += first.first_frame();
  write_clip(verb.output, clip, verb.common,
             {first.file.unit_m, first.file.asset, std::move(source_frames)}, verb.writing);
  if (verb.output == "-") return;
  if (verb.common.json) {
    const Json json = {{"schema", "laban.blend/1"},
                       {"alpha", verb.alpha},
                       {"frames", clip.frame_count()},
                       {"frame_rate_hz", clip.frame_rate_hz()},
                       {"output", verb.output}};
    fmt::print("{}\n", json.dump(2));
  } else {
    fmt::print("{}: {} frames at {:g} Hz, alpha {:+.3f}\n", verb.output, clip.frame_count(),
               clip.frame_rate_hz(), verb.alpha);
  }
}

}  // namespace

void add_blend(CLI::App& app) {
  auto verb = std::make_shared<BlendVerb>();
  CLI::App* sub =
      add_verb(app, "blend", "Blend two clips of one action by space-time interpolation",
               "laban blend walk_tired.bvh walk_proud.bvh --alpha 0.5 -o walk_between.bvh");
  sub->add_option("FIRST", verb->first, "clip at alpha 0; its rig plays the blend")->required();
  sub->add_option("SECOND", verb->second, "clip at alpha 1")->required();
  sub->add_option("--alpha", verb->alpha, "blend weight of SECOND")
      ->check(CLI::Range(blend::kMinAlpha, blend::kMaxAlpha))
      ->capture_default_str();
  sub->add_option("-o,--output", verb->output, "clip to write (.bvh or .glb), '-' for stdout")
      ->required();
  add_read_options(sub, verb->reading);
  add_write_options(sub, verb->writing);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
