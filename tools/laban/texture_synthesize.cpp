#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/draw/contact_sheet.h"
#include "laban/io/bvh.h"
#include "laban/texture/choreography.h"
#include "laban/texture/texture_motion.h"

#include "state_reader.h"
#include "stream.h"
#include "texture.h"
#include "texture_play.h"
#include "texture_state.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

struct TextureSynthesizeVerb {
  Common common;
  ReadClipOptions reading;
  WriteClipOptions writing;
  texture::TextureMotionOptions options;
  std::string input;
  std::string output;
  std::string report;
  std::string picture;
  std::string from;
  std::string to;
  std::vector<int> path;
  AskedLength length;
  bool stream = false;
  bool no_foot_fix = false;
  std::string state;
  std::optional<TextureChoices> set;  ///< of the state
};

texture::TextureMotionOptions resolved(const TextureSynthesizeVerb& verb) {
  texture::TextureMotionOptions options = verb.options;
  options.seed = verb.common.seed;
  options.hold_feet = !verb.no_foot_fix;
  return options;
}

MadeTexture make_choreography(const TextureSynthesizeVerb& verb,
                              const texture::MotionTexture& texture, PoseReader& poses,
                              base::Progress* progress) {
  const texture::PathEnds ends{poses.pair("--from", verb.from, 1), poses.pair("--to", verb.to, -1)};
  const texture::Choreography plan = texture::plan_choreography(
      texture, *ends.from, *ends.to, *verb.length.resolved(texture.frame_rate_hz));
  TextureChoices choices{{}, resolved(verb)};
  for (const texture::PlannedTexton& planned : plan.path) choices.path.push_back({planned, {}});
  return make_texture(texture, choices, ends, poses.place("--from", verb.from), progress);
}

MadeTexture make_path(const TextureSynthesizeVerb& verb, const texture::MotionTexture& texture,
                      base::Progress* progress) {
  TextureChoices choices{{}, resolved(verb)};
  for (const int texton : verb.path) choices.path.push_back({{texton, std::nullopt}, {}});
  return make_texture(texture, choices, {}, {}, progress);
}

MadeTexture make_walk(const TextureSynthesizeVerb& verb, const texture::MotionTexture& texture,
                      base::Progress* progress) {
  texture::TextureMotion motion(texture, resolved(verb));
  texture::TextureClip made = motion.next(*verb.length.resolved(texture.frame_rate_hz), progress);
  return {std::move(made.clip), std::move(made.parts), {}};
}

MadeTexture make(const TextureSynthesizeVerb& verb, const texture::MotionTexture& texture,
                 PoseReader& poses) {
  const auto told = terminal_progress(verb.common, "making motion");
  if (verb.set) return make_texture(texture, *verb.set, {}, {}, told.get());
  if (!verb.from.empty()) return make_choreography(verb, texture, poses, told.get());
  return verb.path.empty() ? make_walk(verb, texture, told.get())
                           : make_path(verb, texture, told.get());
}

/// Rows to stdout as they are made.
void stream(const TextureSynthesizeVerb& verb, const texture::MotionTexture& texture) {
  texture::TextureMotion motion(texture, resolved(verb));
  stream_bvh(verb.length.resolved(texture.frame_rate_hz), {}, verb.common,
             [&motion](int count) { return motion.next(count).clip; });
}

void check_choices(const TextureSynthesizeVerb& verb) {
  const auto usage = [](const char* what) { throw Error(ErrorKind::kUsage, what); };
  if (verb.from.empty() != verb.to.empty()) usage("--from and --to go together");
  if (!verb.path.empty() && (!verb.from.empty() || verb.length || verb.options.first)) {
    usage(
        "--path says what is danced and how long; leave --from, --to, --frames, --seconds and "
        "--first out");
  }
  if (!verb.from.empty() && verb.options.first)
    usage("--from says how it begins; leave --first out");
  if (verb.stream) {
    if (!verb.path.empty() || !verb.from.empty()) usage("--stream is for a random walk");
    check_stream(verb.output, verb.writing, !verb.report.empty() || !verb.picture.empty(),
                 verb.common);
  } else if (verb.path.empty() && !verb.length && !verb.set) {
    usage("say how long: --frames N, --seconds S or --stream");
  }
}

Json report_json(const TextureSynthesizeVerb& verb, const texture::MotionTexture& texture,
                 const MadeTexture& made, const std::vector<InputRecord>& records) {
  return {{"schema", "laban.texture_synthesize/1"},
          {"output", verb.output},
          {"frames", made.clip.frame_count()},
          {"frame_rate_hz", made.clip.frame_rate_hz()},
          {"textons", to_json(made.parts)},
          {"quality", quality_json(texture, made.clip)},
          {"run", run_record("texture synthesize",
                             {{"frames", made.clip.frame_count()},
                              {"from", verb.from},
                              {"to", verb.to},
                              {"path", verb.path},
                              {"first", verb.options.first ? Json(*verb.options.first) : Json()},
                              {"noise", verb.options.noise_level},
                              {"variation", verb.options.variation},
                              {"foot_fix", !verb.no_foot_fix},
                              {"seed", verb.common.seed}},
                             records)}};
}

void write_picture(const TextureSynthesizeVerb& verb, const texture::MotionTexture& texture,
                   const MadeTexture& made) {
  const double rate_hz = made.clip.frame_rate_hz();
  draw::Strip strip{
      with_standard_names(made.clip, texture.rig.humanoid),
      std::filesystem::path(verb.output).stem().string(),
      {},
      fmt::format("{} frames at {:g} Hz, textons marked", made.clip.frame_count(), rate_hz)};
  for (const texture::TextonPart& part : made.parts) {
    if (part.begin > 0) strip.marks_s.push_back(static_cast<double>(part.begin) / rate_hz);
  }
  draw::ContactSheetOptions options;
  options.format = is_svg(verb.picture) ? draw::Format::kSvg : draw::Format::kPng;
  write_bytes(verb.picture, draw::contact_sheet({&strip, 1}, options), verb.common);
}

void warn_of_jumps(const TextureSynthesizeVerb& verb, const MadeTexture& made) {
  const auto jumps = std::count_if(made.parts.begin(),
                                   made.parts.empty() ? made.parts.end() : made.parts.end() - 1,
                                   [](const texture::TextonPart& part) { return part.jump; });
  if (jumps == 0) return;
  warn(verb.common, fmt::format("{} time{} nothing in the captures goes from a texton to the next; "
                                "the motion goes on at the nearest pose",
                                jumps, jumps == 1 ? "" : "s"));
}

/// What the studio's texture room was set to; TEXTURE stands above its own.
void take_state(TextureSynthesizeVerb& verb) {
  TextureState state = parse_texture_state(read_bytes(verb.state), verb.state);
  if (verb.input.empty()) verb.input = std::move(state.texture);
  verb.set = std::move(state.choices);
  verb.options = verb.set->options;
  verb.common.seed = verb.options.seed;
  verb.no_foot_fix = !verb.options.hold_feet;
  for (const TextonBlock& block : verb.set->path) verb.path.push_back(block.planned.texton);
}

void warn_of_pins(const TextureSynthesizeVerb& verb, const MadeTexture& made) {
  for (const PinnedTexton& pinned : made.pinned) {
    if (std::max(pinned.state_deviations, pinned.residual_deviations) <= 3.0) continue;
    warn(verb.common,
         fmt::format("texton {} of the path: the pins lie {:.1f} deviations from what it does, "
                     "{:.1f} from what it can show: beyond 3 it is spoilt",
                     pinned.part, pinned.state_deviations, pinned.residual_deviations));
  }
}

void run(TextureSynthesizeVerb& verb) {
  if (!verb.state.empty()) take_state(verb);
  if (verb.input.empty()) throw CLI::RequiredError("TEXTURE");
  check_choices(verb);
  InputRecord record;
  if (verb.stream) return stream(verb, read_texture_file(verb.input, record));
  check_outputs(verb.common, {verb.output, verb.report, verb.picture});
  static_cast<void>(check_clip_output(verb.output, verb.writing));
  if (!verb.picture.empty()) static_cast<void>(is_svg(verb.picture));
  const texture::MotionTexture texture = read_texture_file(verb.input, record);
  PoseReader poses(texture, verb.reading, verb.common);
  const MadeTexture made = make(verb, texture, poses);
  warn_of_jumps(verb, made);
  warn_of_pins(verb, made);
  write_clip(verb.output, made.clip, verb.common, {}, verb.writing);
  if (!verb.picture.empty()) write_picture(verb, texture, made);
  std::vector<InputRecord> records{record};
  records.insert(records.end(), poses.records().begin(), poses.records().end());
  const Json json = report_json(verb, texture, made, records);
  if (!verb.report.empty()) write_bytes(verb.report, json.dump(2) + "\n", verb.common);
  if (verb.output == "-") return;
  if (verb.common.json) {
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: {} frames at {:g} Hz ({:.2f} s), {} textons\n{}", verb.output,
             made.clip.frame_count(), made.clip.frame_rate_hz(), made.clip.duration_s(),
             made.parts.size(), to_text(made.parts));
}

}  // namespace

void add_texture_synthesize(CLI::App* texture) {
  auto verb = std::make_shared<TextureSynthesizeVerb>();
  CLI::App* sub =
      add_verb(*texture, "synthesize", "Make new motion of textons",
               "laban texture synthesize dance.texture --seconds 60 --seed 1 -o new.bvh\n"
               "  laban texture synthesize dance.texture --from clip.bvh:0 --to clip.bvh:900 "
               "--frames 320 -o choreo.bvh");
  sub->add_option("TEXTURE", verb->input, "texture file (.texture)");
  sub->add_option("-o,--output", verb->output, "clip to write (.bvh or .glb), '-' for stdout")
      ->required();
  sub->add_option("--report", verb->report, "JSON report to write");
  sub->add_option("--picture", verb->picture, "contact sheet to write (.png or .svg)");
  const std::vector<CLI::Option*> others = sub->get_options();
  add_length_options(sub, verb->length);
  sub->add_flag("--stream", verb->stream,
                "BVH to stdout as it is made, in constant memory; without --frames or --seconds "
                "until the reader closes");
  sub->add_option("--from", verb->from, "pose CLIP:FRAME to begin with: a path of textons to --to");
  sub->add_option("--to", verb->to, "pose CLIP:FRAME to end with, after --frames");
  sub->add_option("--path", verb->path, "textons to play, in order, as 'texture path' prints them")
      ->expected(1, -1);
  sub->add_option("--first", verb->options.first, "texton to begin the walk with (default: drawn)");
  sub->add_option("--noise", verb->options.noise_level,
                  "how much drives it, of what did in the captures; 0: the likeliest motion")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  sub->add_option("--variation", verb->options.variation,
                  "share of that which is drawn anew; 0: what drove the captures, 1: all")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  sub->add_flag("--no-foot-fix", verb->no_foot_fix, "leave feet as they come");
  add_read_options(sub, verb->reading);
  add_state_option(sub, verb->state, "texture room", others);
  add_write_options(sub, verb->writing);
  add_common(sub, verb->common, {.writes = true, .seed = true});
  sub->get_option("--state")->excludes(sub->get_option("--seed"));
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
