#include <filesystem>

#include <fmt/core.h>

#include "texture.h"

namespace laban::cli {
namespace {

struct TextureInspectVerb {
  Common common;
  std::string input;
  std::string picture;
};

void print(const TextureInspectVerb& verb, const texture::MotionTexture& texture,
           const texture::LearningReport& report) {
  if (verb.common.json) {
    Json json = {{"schema", "laban.texture_inspect/1"}, {"texture", verb.input}};
    json.update(describe_texture(texture));
    json["transitions"] = Json::array();
    const Eigen::MatrixXd matrix = texture::transition_matrix(texture);
    for (Eigen::Index from = 0; from < matrix.rows(); ++from) {
      for (Eigen::Index to = 0; to < matrix.cols(); ++to) {
        if (matrix(from, to) > 0.0)
          json["transitions"].push_back({{"from", from}, {"to", to}, {"p", matrix(from, to)}});
      }
    }
    json["learning"] = to_json(report);
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: {}", verb.input, texture_text(texture, true));
  fmt::print("log-likelihood {:.1f} at the start", report.start_log_likelihood);
  for (const texture::LearningRound& round : report.rounds)
    fmt::print(", {:.1f}", round.log_likelihood);
  fmt::print("; BIC {:.0f}\n", report.bic);
}

void run(const TextureInspectVerb& verb) {
  if (!verb.picture.empty()) static_cast<void>(is_svg(verb.picture));
  check_outputs(verb.common, {verb.picture});
  InputRecord record;
  const texture::MotionTexture texture = read_texture_file(verb.input, record);
  const texture::LearningReport report = learning_report(texture.record_json, verb.input);
  if (!verb.picture.empty()) {
    write_bytes(verb.picture,
                texture_picture(texture, report, std::filesystem::path(verb.input).stem().string(),
                                is_svg(verb.picture)),
                verb.common);
  }
  print(verb, texture, report);
}

}  // namespace

void add_texture_inspect(CLI::App* texture) {
  auto verb = std::make_shared<TextureInspectVerb>();
  CLI::App* sub = add_verb(*texture, "inspect",
                           "Tell of textons, their lengths, what follows what, and the learning",
                           "laban texture inspect dance.texture --picture transitions.png");
  sub->add_option("TEXTURE", verb->input, "texture file (.texture)")->required();
  sub->add_option("--picture", verb->picture,
                  "picture of transitions, lengths and learning (.png or .svg)");
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
