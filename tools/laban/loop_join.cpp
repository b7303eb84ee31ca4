#include <fmt/core.h>

#include "loop.h"

namespace laban::cli {
namespace {

struct LoopJoinVerb {
  Common common;
  ReadClipOptions reading;
  WriteClipOptions writing;
  SeamChoices seam;
  std::string first;
  std::string second;
  std::string output;
  std::string report;
  std::string picture;
  bool in_place = false;
  bool no_foot_fix = false;
};

void run(const LoopJoinVerb& verb) {
  loop::LoopOptions options;
  options.seam = verb.seam.resolved();
  options.in_place = verb.in_place;
  options.hold_feet = !verb.no_foot_fix;
  check_outputs(verb.common, {verb.output, verb.report, verb.picture});
  (void)check_clip_output(verb.output, verb.writing);
  if (!verb.picture.empty()) (void)is_svg(verb.picture);
  const CapturedClip first = read_captured_clip(verb.first, verb.reading, verb.common);
  const CapturedClip second = read_captured_clip(verb.second, verb.reading, verb.common);
  const loop::JoinedClips joined = loop::join_clips(first.capture, second.capture, options);
  // A character plays the joined clip alone: its own clip's frames do not cover the second's.
  write_clip(verb.output, joined.clip, verb.common, {first.file.unit_m}, verb.writing);
  const Json json = {{"schema", "laban.loop_join/1"},
                     {"output", verb.output},
                     {"frames", joined.clip.frame_count()},
                     {"frame_rate_hz", joined.clip.frame_rate_hz()},
                     {"seam", to_json(joined.seam)},
                     {"seam_begin_frame", joined.seam_begin},
                     {"seam_end_frame", joined.seam_end},
                     {"foot_stances", joined.foot_stances},
                     {"run", run_record("loop join",
                                        {{"in_place", verb.in_place},
                                         {"foot_fix", !verb.no_foot_fix},
                                         {"seam", to_json(verb.seam)}},
                                        {first.record, second.record})}};
  if (!verb.report.empty()) write_bytes(verb.report, json.dump(2) + "\n", verb.common);
  if (!verb.picture.empty()) {
    write_bytes(verb.picture,
                loop_picture(verb.picture, first.capture.humanoid, first.capture.clip,
                             "first: " + verb.first, joined.clip, "output: " + verb.output,
                             {joined.seam_begin / joined.clip.frame_rate_hz()}),
                verb.common);
  }
  if (verb.output == "-") return;
  if (verb.common.json) {
    fmt::print("{}\n", json.dump(2));
  } else {
    fmt::print("{}: {} frames at {:g} Hz\nseam: {}\n", verb.output, joined.clip.frame_count(),
               joined.clip.frame_rate_hz(), to_text(joined.seam));
  }
}

}  // namespace

void add_loop_join(CLI::App* loop) {
  auto verb = std::make_shared<LoopJoinVerb>();
  CLI::App* sub = add_verb(*loop, "join", "Sew the end of one clip to the beginning of another",
                           "laban loop join a.bvh b.bvh -o ab.bvh");
  sub->add_option("FIRST", verb->first, "clip that comes first; its rig plays both")->required();
  sub->add_option("SECOND", verb->second, "clip that follows")->required();
  sub->add_option("-o,--output", verb->output, "clip to write (.bvh or .glb), '-' for stdout")
      ->required();
  sub->add_flag("--in-place", verb->in_place, "without travel over the ground");
  sub->add_flag("--no-foot-fix", verb->no_foot_fix, "leave feet as they come");
  sub->add_option("--report", verb->report, "JSON report to write");
  sub->add_option("--picture", verb->picture,
                  "contact sheet to write (.png or .svg): first clip above output, seam marked");
  add_seam_options(sub, verb->seam);
  add_read_options(sub, verb->reading);
  add_write_options(sub, verb->writing);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
