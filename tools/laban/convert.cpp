#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/motion/resample.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct ConvertVerb {
  Common common;
  ReadClipOptions reading;
  std::string input;
  std::string output;
  std::string format;
  std::optional<double> rate_hz;
  std::optional<double> output_unit_m;
  std::optional<int> begin;
  std::optional<int> end;
};

void run(const ConvertVerb& verb) {
  check_outputs(verb.common, {verb.output});
  const io::ClipFile file = read_any_clip(verb.input, verb.reading, verb.common);
  motion::Clip clip = file.clip;
  if (verb.begin || verb.end) {
    clip = clip.slice(verb.begin.value_or(0), verb.end.value_or(clip.frame_count()));
  }
  if (verb.rate_hz) clip = motion::resample(clip, *verb.rate_hz);
  write_clip(verb.output, clip, verb.common, verb.output_unit_m.value_or(file.unit_m), verb.format);
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

}  // namespace

void add_convert(CLI::App& app) {
  auto verb = std::make_shared<ConvertVerb>();
  CLI::App* sub = add_verb(app, "convert", "Change the format, rate, unit or range of a clip",
                           "laban convert capture.bvh --rate 60 -o capture.glb");
  sub->add_option("INPUT", verb->input, "clip")->required();
  sub->add_option("-o,--output", verb->output, "clip to write (.bvh or .glb), '-' for stdout")
      ->required();
  sub->add_option("--format", verb->format, "format of the output (needed for '-'): bvh or glb");
  sub->add_option("--rate", verb->rate_hz, "frame rate of the output, Hz")
      ->check(CLI::PositiveNumber);
  sub->add_option("--output-unit", verb->output_unit_m,
                  "metres per unit of a BVH output (default: the input's)")
      ->check(CLI::PositiveNumber);
  sub->add_option("--begin", verb->begin, "first frame to keep");
  sub->add_option("--end", verb->end, "one past the last frame to keep");
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
