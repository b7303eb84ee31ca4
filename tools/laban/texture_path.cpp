#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/texture/texton_path.h"

#include "texture.h"
#include "texture_play.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

struct TexturePathVerb {
  Common common;
  std::string input;
  int from = 0;
  int to = 0;
  std::optional<int> length;
  texture::PathRules rules;
  bool repeat = false;
};

std::string text_of(const std::vector<int>& path) {
  std::string text;
  for (const int texton : path) text += (text.empty() ? "" : " ") + std::to_string(texton);
  return text;
}

/// How many textons other than `from` the captures go on to from it, whatever comes between.
int reached_from(const Eigen::MatrixXd& transitions, int from) {
  int count = 0;
  for (int to = 0; to < transitions.rows(); ++to) {
    count += to != from && texture::cheapest_path(transitions, from, to).has_value();
  }
  return count;
}

/// Why there is no path, and what to do.
std::string why_none(const TexturePathVerb& verb, const Eigen::MatrixXd& transitions) {
  const auto other = texture::cheapest_path(transitions, verb.from, verb.to, verb.rules);
  if (verb.length && other) {
    return fmt::format("; the likeliest of another length has {}: leave --length out",
                       other->size());
  }
  if (!verb.rules.avoid.empty() &&
      texture::cheapest_path(transitions, verb.from, verb.to, {{}, verb.rules.via})) {
    return "; there is one through textons to be avoided";
  }
  const std::string stops = verb.rules.via.empty() ? "" : " by way of --via";
  return fmt::format(
      "{}: the captures go on from {} to {} of {} other textons; learn with a larger --threshold, "
      "for textons that occur in more captures, or go between poses: 'texture synthesize --from "
      "CLIP:FRAME --to CLIP:FRAME'",
      stops, verb.from, reached_from(transitions, verb.from), transitions.rows() - 1);
}

void run(const TexturePathVerb& verb) {
  InputRecord record;
  const texture::MotionTexture texture = read_texture_file(verb.input, record);
  const Eigen::MatrixXd transitions = texture::transition_matrix(texture);
  const auto found = naming(verb.input, [&] {
    return verb.length
               ? texture::path_of_length(transitions, verb.from, verb.to, *verb.length, verb.rules)
               : texture::cheapest_path(transitions, verb.from, verb.to, verb.rules);
  });
  if (!found) {
    throw Error(ErrorKind::kData,
                fmt::format("{}: no path from texton {} to {}{}{}", verb.input, verb.from, verb.to,
                            verb.length ? fmt::format(" of {} textons", *verb.length) : "",
                            why_none(verb, transitions)));
  }
  const double cost = texture::path_cost(transitions, *found);
  base::Rng rng(verb.common.seed);
  const std::vector<int> path =
      verb.repeat ? texture::repeat_textons(transitions, *found, rng) : *found;
  if (!verb.common.json) {
    fmt::print("{}\n", text_of(path));
    tell(verb.common, fmt::format("{:.3f} nats, {} textons", cost, path.size()));
    return;
  }
  const Json json = {{"schema", "laban.texture_path/1"},
                     {"texture", verb.input},
                     {"path", path},
                     {"cost_nats", cost},
                     {"run", run_record("texture path",
                                        {{"from", verb.from},
                                         {"to", verb.to},
                                         {"length", verb.length ? Json(*verb.length) : Json()},
                                         {"avoid", verb.rules.avoid},
                                         {"via", verb.rules.via},
                                         {"repeat", verb.repeat},
                                         {"seed", verb.common.seed}},
                                        {record})}};
  fmt::print("{}\n", json.dump(2));
}

}  // namespace

void add_texture_path(CLI::App* texture) {
  auto verb = std::make_shared<TexturePathVerb>();
  CLI::App* sub = add_verb(*texture, "path", "Find a path of textons from one to another",
                           "laban texture path dance.texture 12 57 --length 6 --avoid 3 --via 20");
  sub->add_option("TEXTURE", verb->input, "texture file (.texture)")->required();
  sub->add_option("FROM", verb->from, "texton to begin with")->required();
  sub->add_option("TO", verb->to, "texton to end with")->required();
  sub->add_option("--length", verb->length,
                  "exactly so many textons; without it the likeliest path of all lengths")
      ->check(CLI::Range(1, 100000));
  sub->add_option("--avoid", verb->rules.avoid, "textons that are not on it");
  sub->add_option("--via", verb->rules.via, "textons that are on it, in this order");
  sub->add_flag("--repeat", verb->repeat,
                "repeat each texton as often as its transition to itself says, drawn");
  add_common(sub, verb->common, {.seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
