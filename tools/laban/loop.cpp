#include "loop.h"

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/draw/contact_sheet.h"

namespace laban::cli {

loop::SeamOptions SeamChoices::resolved() const {
  const auto check_least = [](const char* less, int a, const char* more, int b) {
    if (a > b) {
      throw base::Error(base::ErrorKind::kUsage,
                        fmt::format("{} {} is more than {} {}", less, a, more, b));
    }
  };
  check_least("--overlap", options.overlap_frames, "--texton-frames", options.texton_frames);
  check_least("--blend-frames", options.blend_frames, "--overlap", options.overlap_frames);
  loop::SeamOptions found = options;
  found.metric = metric == "gradient" ? loop::SeamMetric::kGradient : loop::SeamMetric::kDifference;
  found.poisson = !no_poisson;
  return found;
}

void add_seam_options(CLI::App* verb, SeamChoices& choices) {
  const std::string group = "Seams";
  loop::SeamOptions& options = choices.options;
  // What is asked for is not lengthened.
  verb->add_option("--texton-frames", options.texton_frames,
                   "frames at the end and at the beginning in which a seam is looked for (default: "
                   "100, at least 2 s)")
      ->check(CLI::Range(8, 2000))
      ->each([&options](const std::string&) { options.texton_s = 0.0; })
      ->group(group);
  verb->add_option("--overlap", options.overlap_frames,
                   "frames in which both play and each joint switches at its own")
      ->check(CLI::Range(4, 2000))
      ->capture_default_str()
      ->group(group);
  verb->add_option("--blend-frames", options.blend_frames, "frames of the blend along the seam")
      ->check(CLI::Range(1, 2000))
      ->capture_default_str()
      ->group(group);
  verb->add_option("--seam-metric", choices.metric,
                   "what a cut is charged for: difference, or difference over gradient")
      ->check(CLI::IsMember({"difference", "gradient"}))
      ->capture_default_str()
      ->group(group);
  verb->add_flag("--no-poisson", choices.no_poisson, "blend along the seam only")->group(group);
}

loop::TurningPointOptions TurningChoices::resolved() const {
  loop::TurningPointOptions found = options;
  found.distance = distance == "l2" ? loop::FrameDistance::kL2 : loop::FrameDistance::kMahalanobis;
  return found;
}

void add_turning_options(CLI::App* verb, TurningChoices& choices) {
  const std::string group = "Turning points";
  loop::TurningPointOptions& options = choices.options;
  verb->add_option("--distance", choices.distance, "of two frames")
      ->check(CLI::IsMember({"mahalanobis", "l2"}))
      ->capture_default_str()
      ->group(group);
  verb->add_option("--threshold", options.threshold, "least symmetry of a turning point, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group(group);
  verb->add_option("--window", options.window_s,
                   "seconds before and after a frame that are compared")
      ->check(CLI::Range(0.01, 60.0))
      ->capture_default_str()
      ->group(group);
  verb->add_option("--falloff", options.falloff,
                   "how fast frames farther away count less, 1 and up")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str()
      ->group(group);
}

Json to_json(const loop::FoundSeam& seam) {
  return {{"out_begin", seam.out_begin},     {"in_begin", seam.in_begin},
          {"frames", seam.frames},           {"played_frames", seam.played_frames},
          {"distance_m", seam.distance_m},   {"switch_frames", seam.switch_frames},
          {"speed_ratio", seam.speed_ratio}, {"acceleration_ratio", seam.acceleration_ratio}};
}

std::string to_text(const loop::FoundSeam& seam) {
  const std::string slower = seam.played_frames == seam.frames
                                 ? ""
                                 : fmt::format(", played in {} frames", seam.played_frames);
  return fmt::format(
      "frames {} to {} into {} to {}{}, {:.3f} m apart; speed {:.2f}, acceleration {:.2f} of the "
      "captured 99th percentile",
      seam.out_begin, seam.out_begin + seam.frames, seam.in_begin, seam.in_begin + seam.frames,
      slower, seam.distance_m, seam.speed_ratio, seam.acceleration_ratio);
}

Json to_json(const SeamChoices& choices) {
  return {{"texton_frames", choices.options.texton_frames},
          {"texton_s", choices.options.texton_s},
          {"overlap", choices.options.overlap_frames},
          {"blend_frames", choices.options.blend_frames},
          {"seam_metric", choices.metric},
          {"poisson", !choices.no_poisson},
          {"joint_weight", choices.options.joint_weight}};
}

Json to_json(const TurningChoices& choices) {
  return {{"distance", choices.distance},
          {"threshold", choices.options.threshold},
          {"window_s", choices.options.window_s},
          {"falloff", choices.options.falloff},
          {"apart_s", choices.options.apart_s}};
}

std::string loop_picture(const std::string& path, const motion::Humanoid& humanoid,
                         const motion::Clip& input, const std::string& input_title,
                         const motion::Clip& output, const std::string& output_title,
                         const std::vector<double>& marks_s) {
  const draw::Strip strips[] = {{with_standard_names(input, humanoid), input_title, {}, ""},
                                {with_standard_names(output, humanoid), output_title, marks_s, ""}};
  draw::ContactSheetOptions options;
  options.format = is_svg(path) ? draw::Format::kSvg : draw::Format::kPng;
  return draw::contact_sheet(strips, options);
}

void add_loop(CLI::App& app) {
  CLI::App* verb =
      add_verb(app, "loop", "Make endless motion from one short clip: turning points and seams",
               "laban loop synthesize kick.bvh --frames 1700 -o endless.bvh\n"
               "  laban loop synthesize clip.bvh --seamless -o loop.glb\n"
               "  laban loop turns clip.bvh --picture turns.png\n"
               "  laban loop join a.bvh b.bvh -o ab.bvh");
  verb->require_subcommand(1);
  add_loop_synthesize(verb);
  add_loop_turns(verb);
  add_loop_join(verb);
}

}  // namespace laban::cli
