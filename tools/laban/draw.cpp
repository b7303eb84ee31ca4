#include <filesystem>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/draw/animation.h"
#include "laban/draw/contact_sheet.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct DrawVerb {
  Common common;
  ReadClipOptions reading;
  std::vector<std::string> inputs;
  std::string output;
  std::string animation;
  std::string view = "three-quarter";
  draw::ContactSheetOptions options;
  bool no_trajectories = false;
  bool panorama = false;
};

draw::View view_named(const std::string& name) {
  if (name == "front") return draw::View::kFront;
  if (name == "side") return draw::View::kSide;
  return draw::View::kThreeQuarter;
}

struct DrawnClip {
  motion::Clip clip;
  std::string title;
  std::string note;
};

/// The clips, on rigs that a map tells of with the names that pictures know.
std::vector<DrawnClip> read_clips(const DrawVerb& verb) {
  std::vector<DrawnClip> clips;
  for (const std::string& input : verb.inputs) {
    motion::Clip clip = read_any_clip(input, verb.reading, verb.common).clip;
    if (!verb.reading.map.empty()) {
      clip = with_standard_names(clip, motion::find_humanoid(clip, read_map(verb.reading.map)));
    }
    std::string note =
        fmt::format("{} frames at {:g} Hz", clip.frame_count(), clip.frame_rate_hz());
    clips.push_back(
        {std::move(clip), std::filesystem::path(input).stem().string(), std::move(note)});
  }
  return clips;
}

/// The rig of a clip, if there is a person in it: the preview marks its feet on the ground.
std::optional<motion::Humanoid> humanoid_of(const motion::Clip& clip) {
  try {
    return motion::find_humanoid(clip);
  } catch (const base::Error& error) {
    if (error.kind() != base::ErrorKind::kData) throw;
    return std::nullopt;
  }
}

void write_animation(const DrawVerb& verb, const std::vector<DrawnClip>& clips) {
  std::vector<draw::AnimatedClip> animated;
  for (const DrawnClip& drawn : clips) {
    animated.push_back({drawn.clip, drawn.title, drawn.note, humanoid_of(drawn.clip), {}});
  }
  write_bytes(verb.animation, draw::animation(animated, {.title = verb.options.title}),
              verb.common);
}

void write_sheet(DrawVerb& verb, const std::vector<DrawnClip>& clips) {
  verb.options.format = is_svg(verb.output) ? draw::Format::kSvg : draw::Format::kPng;
  verb.options.view = view_named(verb.view);
  verb.options.trajectories = !verb.no_trajectories;
  if (verb.panorama) verb.options.placement = draw::Placement::kPanorama;
  std::vector<draw::Strip> strips;
  for (const DrawnClip& drawn : clips) strips.push_back({drawn.clip, drawn.title, {}, drawn.note});
  write_bytes(verb.output, draw::contact_sheet(strips, verb.options), verb.common);
}

void run(DrawVerb& verb) {
  if (verb.output.empty() && verb.animation.empty()) {
    throw base::Error(base::ErrorKind::kUsage,
                      "nothing to draw: name a picture with -o or a page with --animate");
  }
  if (!verb.output.empty()) static_cast<void>(is_svg(verb.output));
  if (!verb.animation.empty() && std::ssize(verb.inputs) > draw::kMaxAnimatedClips) {
    throw base::Error(base::ErrorKind::kUsage,
                      fmt::format("--animate shows at most {} clips side by side, not {}",
                                  draw::kMaxAnimatedClips, verb.inputs.size()));
  }
  check_outputs(verb.common, {verb.output, verb.animation});
  const std::vector<DrawnClip> clips = read_clips(verb);
  if (!verb.output.empty()) write_sheet(verb, clips);
  if (!verb.animation.empty()) write_animation(verb, clips);
  if (!verb.common.json) return;
  Json json = {{"schema", "laban.draw/1"},
               {"output", verb.output.empty() ? Json() : Json(verb.output)},
               {"clips", verb.inputs}};
  if (!verb.animation.empty()) json["animation"] = verb.animation;
  fmt::print("{}\n", json.dump(2));
}

}  // namespace

void add_draw(CLI::App& app) {
  auto verb = std::make_shared<DrawVerb>();
  CLI::App* sub =
      add_verb(app, "draw", "Draw a contact sheet of clips, or a page that plays them side by side",
               "laban draw walk.bvh -o walk.png");
  sub->add_option("INPUT", verb->inputs, "clips")->required();
  sub->add_option("-o,--output", verb->output, "picture to write (.png or .svg)");
  sub->add_option("--animate", verb->animation,
                  "page to write (.html): up to 4 clips side by side, playing in any browser");
  sub->add_option("--poses", verb->options.pose_count, "poses over the longest clip")
      ->check(CLI::Range(1, 200))
      ->capture_default_str();
  sub->add_option("--view", verb->view, "where the camera stands")
      ->check(CLI::IsMember({"three-quarter", "front", "side"}))
      ->capture_default_str();
  sub->add_option("--width", verb->options.width, "width of the sheet, units (CSS pixels)")
      ->check(CLI::Range(200, 10000))
      ->capture_default_str();
  sub->add_option("--title", verb->options.title, "title of the sheet");
  sub->add_flag("--panorama", verb->panorama, "all poses at their true place on one floor");
  sub->add_flag("--no-trajectories", verb->no_trajectories,
                "leave the trails of hands, feet and head out");
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
