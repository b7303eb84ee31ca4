#include <filesystem>

#include <fmt/core.h>

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

void run(DrawVerb& verb) {
  check_outputs(verb.common, {verb.output});
  verb.options.format = is_svg(verb.output) ? draw::Format::kSvg : draw::Format::kPng;
  verb.options.view = view_named(verb.view);
  verb.options.trajectories = !verb.no_trajectories;
  if (verb.panorama) verb.options.placement = draw::Placement::kPanorama;
  std::vector<draw::Strip> strips;
  for (const std::string& input : verb.inputs) {
    motion::Clip clip = read_any_clip(input, verb.reading, verb.common).clip;
    if (!verb.reading.map.empty()) {
      clip = with_standard_names(clip, motion::find_humanoid(clip, read_map(verb.reading.map)));
    }
    strips.push_back(
        {clip,
         std::filesystem::path(input).stem().string(),
         {},
         fmt::format("{} frames at {:g} Hz", clip.frame_count(), clip.frame_rate_hz())});
  }
  write_bytes(verb.output, draw::contact_sheet(strips, verb.options), verb.common);
  if (verb.common.json) {
    fmt::print(
        "{}\n",
        Json{{"schema", "laban.draw/1"}, {"output", verb.output}, {"clips", verb.inputs}}.dump(2));
  }
}

}  // namespace

void add_draw(CLI::App& app) {
  auto verb = std::make_shared<DrawVerb>();
  CLI::App* sub =
      add_verb(app, "draw", "Draw a contact sheet of clips, one above the other at the same times",
               "laban draw walk.bvh -o walk.png");
  sub->add_option("INPUT", verb->inputs, "clips")->required();
  sub->add_option("-o,--output", verb->output, "picture to write (.png or .svg)")->required();
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
