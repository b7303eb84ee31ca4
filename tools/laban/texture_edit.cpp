#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/draw/contact_sheet.h"
#include "laban/texture/texton_synthesis.h"

#include "number_checks.h"
#include "texture.h"
#include "texture_play.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::MatrixXd;

struct TextureEditVerb {
  Common common;
  ReadClipOptions reading;
  WriteClipOptions writing;
  std::string input;
  std::string output;
  std::string picture;
  int texton = 0;
  int segment = 0;
  std::vector<std::string> pins;
  double stretch = 1.0;
  double noise = 1.0;
  double variation = texture::TextureMotionOptions().variation;
  bool no_foot_fix = false;
};

struct Edited {
  MatrixXd original;
  MatrixXd observations;
  std::vector<int> pinned;
  double state_deviations = 0.0;
  double residual_deviations = 0.0;
};

MatrixXd captured(const TextureEditVerb& verb, const texture::MotionTexture& texture) {
  if (verb.texton < 0 || verb.texton >= texture.texton_count()) {
    throw Error(ErrorKind::kUsage,
                fmt::format("{}: there is no texton {}; there are 0 to {}", verb.input, verb.texton,
                            texture.texton_count() - 1));
  }
  const std::vector<int> segments = texture::segments_of(texture, verb.texton);
  if (verb.segment >= static_cast<int>(segments.size())) {
    throw Error(ErrorKind::kUsage,
                fmt::format("{}: texton {} has segments 0 to {}, not {}", verb.input, verb.texton,
                            static_cast<int>(segments.size()) - 1, verb.segment));
  }
  const int which = segments[static_cast<std::size_t>(verb.segment)];
  return texture::segment_observations(texture, texture.segments[static_cast<std::size_t>(which)]);
}

/// Pins FRAME:CLIP:FRAME, in order. What moves over the ground stays as in `motion`: a pose has no
/// travel.
std::vector<texture::PinnedFrame> read_pins(const TextureEditVerb& verb, const MatrixXd& motion,
                                            PoseReader& poses) {
  std::vector<texture::PinnedFrame> pins;
  for (const std::string& text : verb.pins) {
    const std::size_t colon = std::min(text.find(':'), text.size());
    const int frame = parse_whole(std::string_view(text).substr(0, colon));
    if (frame < 0 || colon == text.size()) {
      throw Error(ErrorKind::kUsage, fmt::format("--pin {}: a pin is FRAME:CLIP:FRAME", text));
    }
    if (frame >= motion.cols()) {
      throw Error(ErrorKind::kUsage,
                  fmt::format("--pin {}: the texton has frames 0 to {}", text, motion.cols() - 1));
    }
    Eigen::VectorXd pose = poses.pair("--pin", text.substr(colon + 1), 1).col(0);
    pose.tail<3>() = motion.col(frame).tail<3>();
    pins.push_back({frame, pose});
  }
  std::sort(pins.begin(), pins.end(),
            [](const auto& a, const auto& b) { return a.frame < b.frame; });
  for (std::size_t n = 1; n < pins.size(); ++n) {
    if (pins[n].frame == pins[n - 1].frame) {
      throw Error(ErrorKind::kUsage, fmt::format("--pin: frame {} is pinned twice", pins[n].frame));
    }
  }
  return pins;
}

/// The texton made anew between its segment's ends, longer or shorter.
MatrixXd stretched(const TextureEditVerb& verb, const texture::MotionTexture& texture,
                   const MatrixXd& original) {
  const auto length = std::max(
      5, static_cast<int>(std::lround(verb.stretch * static_cast<double>(original.cols()))));
  const std::vector<texture::PlannedTexton> path{{verb.texton, length}};
  return texture::synthesize_path(
             texture, path, {original.leftCols(2), original.rightCols(2)},
             {.seed = verb.common.seed, .noise_level = verb.noise, .variation = verb.variation})
      .observations;
}

Edited edit(const TextureEditVerb& verb, const texture::MotionTexture& texture, PoseReader& poses) {
  Edited edited;
  edited.original = captured(verb, texture);
  const MatrixXd motion =
      verb.stretch == 1.0 ? edited.original : stretched(verb, texture, edited.original);
  const std::vector<texture::PinnedFrame> pins = read_pins(verb, motion, poses);
  const texture::EditedTexton found =
      texture::edit_texton(texture.textons[static_cast<std::size_t>(verb.texton)], motion, pins);
  edited.observations = found.observations;
  edited.state_deviations = found.state_deviations;
  edited.residual_deviations = found.residual_deviations;
  for (const texture::PinnedFrame& pin : pins) edited.pinned.push_back(pin.frame);
  if (found.is_far_off()) {
    warn(verb.common,
         fmt::format("the pins lie {:.1f} deviations from what texton {} does, {:.1f} from what it "
                     "can show: beyond 3 it is spoilt",
                     found.state_deviations, verb.texton, found.residual_deviations));
  }
  return edited;
}

/// The original slowed down or sped up: what stretching a texton is not.
MatrixXd warped(const MatrixXd& original, int length) {
  const double pace =
      static_cast<double>(original.cols() - 1) / std::max(1.0, static_cast<double>(length - 1));
  MatrixXd slow(original.rows(), length);
  for (int f = 0; f < length; ++f) {
    const double at = pace * f;
    const auto from = std::min(static_cast<Eigen::Index>(at), original.cols() - 2);
    const double share = at - static_cast<double>(from);
    slow.col(f) = (1.0 - share) * original.col(from) + share * original.col(from + 1);
  }
  slow.bottomRows<3>() *= pace;  // steps are from frame to frame
  return slow;
}

void write_picture(const TextureEditVerb& verb, const texture::MotionTexture& texture,
                   const Edited& edited, const motion::Clip& clip) {
  const motion::Humanoid& humanoid = texture.rig.humanoid;
  const motion::Clip before =
      texture::play_observations(texture, edited.original, {.hold_feet = !verb.no_foot_fix});
  std::vector<draw::Strip> strips;
  strips.push_back({with_standard_names(before, humanoid),
                    fmt::format("texton {}, as captured", verb.texton),
                    {},
                    ""});
  strips.push_back({with_standard_names(clip, humanoid),
                    std::filesystem::path(verb.output).stem().string(),
                    {},
                    ""});
  for (const int frame : edited.pinned) {
    strips.back().marks_s.push_back(frame / texture.frame_rate_hz);
  }
  if (clip.frame_count() != before.frame_count()) {
    const motion::Clip slow = texture::play_observations(
        texture, warped(edited.original, clip.frame_count()), {.hold_feet = !verb.no_foot_fix});
    strips.push_back({with_standard_names(slow, humanoid), "as captured, time warped", {}, ""});
  }
  draw::ContactSheetOptions options;
  options.format = is_svg(verb.picture) ? draw::Format::kSvg : draw::Format::kPng;
  write_bytes(verb.picture, draw::contact_sheet(strips, options), verb.common);
}

void print(const TextureEditVerb& verb, const Edited& edited, const motion::Clip& clip,
           const std::vector<InputRecord>& records) {
  if (!verb.common.json) {
    fmt::print("{}: {} frames at {:g} Hz, {} pinned; {:.2f} deviations from the texton\n",
               verb.output, clip.frame_count(), clip.frame_rate_hz(), edited.pinned.size(),
               edited.state_deviations);
    return;
  }
  const Json json = {{"schema", "laban.texture_edit/1"},
                     {"output", verb.output},
                     {"frames", clip.frame_count()},
                     {"frame_rate_hz", clip.frame_rate_hz()},
                     {"captured_frames", edited.original.cols()},
                     {"pinned_frames", edited.pinned},
                     {"state_deviations", edited.state_deviations},
                     {"residual_deviations", edited.residual_deviations},
                     {"run", run_record("texture edit",
                                        {{"texton", verb.texton},
                                         {"segment", verb.segment},
                                         {"pins", verb.pins},
                                         {"stretch", verb.stretch},
                                         {"noise", verb.noise},
                                         {"variation", verb.variation},
                                         {"foot_fix", !verb.no_foot_fix},
                                         {"seed", verb.common.seed}},
                                        records)}};
  fmt::print("{}\n", json.dump(2));
}

void run(const TextureEditVerb& verb) {
  if (verb.pins.empty() && verb.stretch == 1.0) {
    throw Error(ErrorKind::kUsage, "say what to edit: --pin FRAME:CLIP:FRAME, --stretch FACTOR");
  }
  check_outputs(verb.common, {verb.output, verb.picture});
  static_cast<void>(check_clip_output(verb.output, verb.writing));
  if (!verb.picture.empty()) static_cast<void>(is_svg(verb.picture));
  InputRecord record;
  const texture::MotionTexture texture = read_texture_file(verb.input, record);
  PoseReader poses(texture, verb.reading, verb.common);
  const Edited edited = edit(verb, texture, poses);
  const motion::Clip clip = texture::play_observations(
      texture, edited.observations, {.hold_feet = !verb.no_foot_fix, .kept_frames = edited.pinned});
  write_clip(verb.output, clip, verb.common, {}, verb.writing);
  if (!verb.picture.empty()) write_picture(verb, texture, edited, clip);
  std::vector<InputRecord> records{record};
  records.insert(records.end(), poses.records().begin(), poses.records().end());
  if (verb.output != "-") print(verb, edited, clip, records);
}

}  // namespace

void add_texture_edit(CLI::App* texture) {
  auto verb = std::make_shared<TextureEditVerb>();
  CLI::App* sub =
      add_verb(*texture, "edit", "Pin frames of a texton to poses, or stretch it",
               "laban texture edit dance.texture --texton 12 --pin 40:pose.bvh:0 -o edited.bvh\n"
               "  laban texture edit dance.texture --texton 12 --stretch 1.5 -o longer.bvh");
  sub->add_option("TEXTURE", verb->input, "texture file (.texture)")->required();
  sub->add_option("-o,--output", verb->output, "clip to write (.bvh or .glb), '-' for stdout")
      ->required();
  sub->add_option("--texton", verb->texton, "texton to edit")->required();
  sub->add_option("--segment", verb->segment, "which of its segments, counted from 0")
      ->check(number_from_0())
      ->capture_default_str();
  sub->add_option("--pin", verb->pins, "FRAME:CLIP:FRAME: the texton's frame and the pose it takes")
      ->expected(1, -1);
  sub->add_option("--stretch", verb->stretch,
                  "so many times as long: drawn anew between the same ends, which adds motion "
                  "where slowing down would not")
      ->check(CLI::Range(0.1, 20.0))
      ->capture_default_str();
  sub->add_option("--noise", verb->noise,
                  "how much drives a stretched texton, of what did in the captures")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  sub->add_option("--variation", verb->variation, "share of that which is drawn anew")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  sub->add_flag("--no-foot-fix", verb->no_foot_fix, "leave feet as they come");
  sub->add_option("--picture", verb->picture,
                  "contact sheet to write (.png or .svg): as captured, as edited and, if "
                  "stretched, as captured in slow motion");
  add_read_options(sub, verb->reading);
  add_write_options(sub, verb->writing);
  add_common(sub, verb->common, {.writes = true, .seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
