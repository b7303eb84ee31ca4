#include <charconv>
#include <chrono>
#include <filesystem>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/texture/learn_texture.h"
#include "laban/texture/texture_file.h"

#include "number_checks.h"
#include "texture.h"

namespace laban::cli {
namespace {

namespace fs = std::filesystem;
using base::Error;
using base::ErrorKind;

struct TextureLearnVerb {
  Common common;
  ReadClipOptions reading;
  std::vector<std::string> inputs;
  std::string output;
  std::string picture;
  std::string checkpoint;
  std::string threshold;  // a number or "auto"; empty: auto, or found for --textons
  texture::TextureLearning options;
};

texture::TextureLearning options_of(const TextureLearnVerb& verb) {
  texture::TextureLearning options = verb.options;
  options.threads = verb.common.threads;
  if (verb.threshold.empty() || verb.threshold == "auto") {
    if (!verb.threshold.empty() && options.textons) {
      throw Error(ErrorKind::kUsage, "--threshold and --textons exclude each other; give one");
    }
    return options;
  }
  double value = 0.0;
  const char* end = verb.threshold.data() + verb.threshold.size();
  const auto read = std::from_chars(verb.threshold.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end || !(value >= 0.0)) {
    throw Error(ErrorKind::kUsage,
                "--threshold " + verb.threshold + ": it is a number >= 0 or 'auto'");
  }
  if (options.textons) {
    throw Error(ErrorKind::kUsage, "--threshold and --textons exclude each other; give one");
  }
  options.threshold = value;
  return options;
}

Json options_json(const TextureLearnVerb& verb, double rate_hz) {
  const texture::TextureLearning& options = verb.options;
  return {{"frame_rate_hz", rate_hz},
          {"min_frames", options.min_frames},
          {"threshold", verb.threshold.empty() ? "auto" : verb.threshold},
          {"textons", options.textons ? Json(*options.textons) : Json()},
          {"min_states", options.fit.min_dimension},
          {"max_states", options.fit.max_dimension},
          {"explained_share", options.fit.explained_share},
          {"ridge", options.fit.ridge},
          {"variance_floor", options.fit.variance_floor},
          {"max_rounds", options.max_rounds}};
}

struct ReadCaptures {
  std::vector<texture::TextureSource> sources;
  std::vector<InputRecord> records;
};

ReadCaptures read_captures(const TextureLearnVerb& verb) {
  ReadCaptures read;
  for (const std::string& input : verb.inputs) {
    CapturedClip clip = read_captured_clip(input, verb.reading, verb.common);
    const int first = clip.first_frame();
    read.sources.push_back({input, std::move(clip.capture), first});
    read.records.push_back(clip.record);
  }
  return read;
}

/// The state of learning in a file, from which a later run with the same inputs and options goes
/// on.
class Checkpoint {
 public:
  Checkpoint(const TextureLearnVerb& verb, Json record) : verb_(verb), record_(std::move(record)) {}

  /// The state that was kept, if there is one. @throws Error{kData} if it is of another run.
  [[nodiscard]] std::optional<texture::LearntTexture> read() const {
    if (verb_.checkpoint.empty() || !fs::exists(verb_.checkpoint)) return std::nullopt;
    InputRecord ignored;
    texture::MotionTexture texture = read_texture_file(verb_.checkpoint, ignored);
    texture::LearningReport report = learning_report(texture.record_json, verb_.checkpoint);
    Json record = Json::parse(texture.record_json);
    record.erase("learning");
    if (record != record_) {
      throw Error(ErrorKind::kData, verb_.checkpoint +
                                        ": it was kept by a run with other captures, options or "
                                        "version; remove it or name another --checkpoint");
    }
    return texture::LearntTexture{std::move(texture), std::move(report)};
  }
  void keep(const texture::LearntTexture& state) const {
    if (!verb_.checkpoint.empty()) write(verb_.checkpoint, state, {.overwrite = true});
  }
  void write(const std::string& path, const texture::LearntTexture& state,
             const base::WriteFileOptions& writing) const {
    texture::MotionTexture texture = state.texture;
    Json record = record_;
    record["learning"] = to_json(state.report);
    texture.record_json = record.dump();
    base::write_file(path, texture::write_texture(texture), writing);
  }

 private:
  const TextureLearnVerb& verb_;
  Json record_;
};

void print(const TextureLearnVerb& verb, const texture::LearntTexture& learnt) {
  const texture::LearningReport& report = learnt.report;
  if (verb.common.json) {
    Json json = {{"schema", "laban.texture_learn/1"}, {"texture", verb.output}};
    json.update(describe_texture(learnt.texture));
    json["learning"] = to_json(report);
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: {}", verb.output, texture_text(learnt.texture, verb.common.verbose));
  for (const texture::LearningCandidate& one : report.candidates) {
    fmt::print("  threshold {:.3f}: {:>4} textons, BIC {:.0f}{}\n", one.threshold, one.textons,
               one.bic, one.threshold == report.threshold ? "  <- chosen" : "");
  }
  fmt::print("start at threshold {:.4g}: {} textons, log-likelihood {:.1f}\n", report.threshold,
             report.start_textons, report.start_log_likelihood);
  for (std::size_t n = 0; n < report.rounds.size(); ++n) {
    const texture::LearningRound& round = report.rounds[n];
    fmt::print("round {:>2}: log-likelihood {:.1f}, {} frames and {} cuts changed, {} textons\n",
               n + 1, round.log_likelihood, round.changed_frames, round.changed_cuts,
               round.textons);
  }
  if (report.end == texture::LearningEnd::kMaxRounds) {
    warn(verb.common, fmt::format("learning has not converged in {} rounds", report.rounds.size()));
  }
}

void run(const TextureLearnVerb& verb) {
  if (!verb.picture.empty()) static_cast<void>(is_svg(verb.picture));
  check_outputs(verb.common, {verb.output, verb.picture});
  const texture::TextureLearning options = options_of(verb);
  const ReadCaptures read = read_captures(verb);
  const double rate_hz =
      options.frame_rate_hz.value_or(read.sources.front().capture.clip.frame_rate_hz());
  const Checkpoint checkpoint(
      verb, run_record("texture learn", options_json(verb, rate_hz), read.records));
  const auto before = checkpoint.read();
  if (before) {
    tell(verb.common, fmt::format("going on after round {} of {}", before->report.rounds.size(),
                                  verb.checkpoint));
  }
  const auto progress = terminal_progress(verb.common, "learning");
  texture::TextureListener listener;
  if (!verb.checkpoint.empty())
    listener = [&](const texture::LearntTexture& state) { checkpoint.keep(state); };
  const texture::LearntTexture learnt = texture::learn_texture(
      read.sources, options, progress.get(), listener, before ? &*before : nullptr);
  checkpoint.write(verb.output, learnt, verb.common.writing());
  if (!verb.picture.empty()) {
    write_bytes(verb.picture,
                texture_picture(learnt.texture, learnt.report,
                                fs::path(verb.output).stem().string(), is_svg(verb.picture)),
                verb.common);
  }
  print(verb, learnt);
}

}  // namespace

void add_texture_learn(CLI::App* texture) {
  auto verb = std::make_shared<TextureLearnVerb>();
  CLI::App* sub = add_verb(*texture, "learn", "Learn a motion texture from clips",
                           "laban texture learn dance/*.bvh --rate 60 -o dance.texture");
  sub->add_option("INPUT", verb->inputs,
                  "clips to learn from; the first one's rig plays the output")
      ->required();
  sub->add_option("-o,--output", verb->output, "texture file to write (.texture)")->required();
  sub->add_option("--picture", verb->picture,
                  "picture of transitions, lengths and learning (.png or .svg)");
  sub->add_option("--rate", verb->options.frame_rate_hz,
                  "frames a second of the texture (default: the first clip's)")
      ->check(positive_number());
  sub->add_option("--min-frames", verb->options.min_frames,
                  "frames of the shortest segment, about a second")
      ->check(CLI::Range(3, 100000))
      ->capture_default_str();
  sub->add_option("--threshold", verb->threshold,
                  "one-step error up to which a texton is used at the start, radians; or 'auto': "
                  "what BIC likes best (default)");
  sub->add_option("--textons", verb->options.textons,
                  "start with so many textons instead; some may be left without a segment")
      ->check(CLI::Range(1, 100000));
  sub->add_option("--min-states", verb->options.fit.min_dimension, "least states of a texton")
      ->check(CLI::Range(1, 40))
      ->capture_default_str();
  sub->add_option("--max-states", verb->options.fit.max_dimension, "most states of a texton")
      ->check(CLI::Range(1, 40))
      ->capture_default_str();
  sub->add_option("--ridge", verb->options.fit.ridge, "ridge of the dynamics' fit")
      ->check(number_from_0())
      ->capture_default_str();
  sub->add_option("--rounds", verb->options.max_rounds, "most rounds of learning")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  sub->add_option("--checkpoint", verb->checkpoint,
                  "file to keep the state in after each round; if it is there, learning goes on "
                  "from it");
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common, {.writes = true, .threads = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
