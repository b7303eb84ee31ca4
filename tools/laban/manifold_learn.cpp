#include <filesystem>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/manifold/manifold_file.h"

#include "manifold.h"
#include "number_checks.h"

namespace laban::cli {
namespace {

struct ManifoldLearnVerb {
  Common common;
  ReadClipOptions reading;
  std::vector<std::string> inputs;
  std::string output;
  std::string picture;
  std::string map = "som";
  std::string basis = "thin-plate";
  std::string method = "fuzzy";
  int size = 65;
  manifold::LearnOptions options;
};

manifold::LearnOptions options_of(const ManifoldLearnVerb& verb) {
  manifold::LearnOptions options = verb.options;
  options.kind = verb.map == "pca" ? manifold::MapKind::kPca : manifold::MapKind::kSom;
  options.som.rows = verb.size;
  options.som.columns = verb.size;
  options.som.threads = verb.common.threads;
  options.grbf.basis = verb.basis == "gaussian" ? manifold::RadialBasis::kGaussian
                                                : manifold::RadialBasis::kThinPlate;
  options.method = verb.method == "k-means"   ? manifold::PrimitiveMethod::kKMeans
                   : verb.method == "mixture" ? manifold::PrimitiveMethod::kGaussianMixture
                                              : manifold::PrimitiveMethod::kFuzzyKMeans;
  options.seed = verb.common.seed;
  return options;
}

Json options_json(const ManifoldLearnVerb& verb, const manifold::PoseManifold& manifold) {
  return {{"seed", verb.common.seed},
          {"map", verb.map},
          {"size", verb.size},
          {"epochs", verb.options.som.epochs},
          {"last_radius", verb.options.som.last_radius},
          {"basis", verb.basis},
          {"centers", verb.options.grbf.centers_a_side},
          {"ridge", verb.options.grbf.ridge},
          {"cluster", verb.method},
          {"primitives", manifold.primitives.count()}};
}

std::string_view objective_name(manifold::PrimitiveMethod method) {
  return method == manifold::PrimitiveMethod::kKMeans        ? "inertia"
         : method == manifold::PrimitiveMethod::kFuzzyKMeans ? "fuzzy_objective"
                                                             : "mean_log_likelihood";
}

Json report_json(const ManifoldLearnVerb& verb, const manifold::LearnedManifold& learned) {
  const manifold::LearnReport& report = learned.report;
  Json json = {{"schema", "laban.manifold_learn/1"}, {"manifold", verb.output}};
  json.update(describe_manifold(learned.manifold));
  json["quantization_error_m"] = report.map.quantization;
  json["topographic_error"] = report.map.topographic;
  json["reconstruction_m"] = report.reconstruction_m;
  json["elbow_errors"] = report.elbow_errors;
  json["clusterings"] = Json::array();
  for (const manifold::ComparedClusters& one : report.methods) {
    json["clusterings"].push_back({{"method", manifold::name_of(one.method)},
                                   {std::string(objective_name(one.method)), one.objective},
                                   {"within", one.figures.within},
                                   {"separation", one.figures.separation},
                                   {"davies_bouldin", one.figures.davies_bouldin}});
  }
  return json;
}

void print(const ManifoldLearnVerb& verb, const manifold::LearnedManifold& learned) {
  if (verb.common.json) {
    fmt::print("{}\n", report_json(verb, learned).dump(2));
    return;
  }
  const manifold::LearnReport& report = learned.report;
  fmt::print("{}: {}", verb.output, manifold_text(learned.manifold));
  if (learned.manifold.kind == manifold::MapKind::kSom) {
    fmt::print("quantization error {:.4f} m, topographic error {:.3f}\n", report.map.quantization,
               report.map.topographic);
  }
  fmt::print("poses come back within {:.2f} cm a joint\n", 100.0 * report.reconstruction_m);
  for (const manifold::ComparedClusters& one : report.methods) {
    fmt::print("  {:<8} within {:5.2f}  apart {:5.2f}  Davies-Bouldin {:.3f}\n",
               manifold::name_of(one.method), one.figures.within, one.figures.separation,
               one.figures.davies_bouldin);
  }
}

void run(const ManifoldLearnVerb& verb) {
  if (!verb.picture.empty()) static_cast<void>(is_svg(verb.picture));
  check_outputs(verb.common, {verb.output, verb.picture});
  std::vector<motion::Capture> captures;
  std::vector<InputRecord> records;
  std::string title;
  for (const std::string& input : verb.inputs) {
    CapturedClip clip = read_captured_clip(input, verb.reading, verb.common);
    captures.push_back(std::move(clip.capture));
    records.push_back(clip.record);
    title += (title.empty() ? "" : ", ") + std::filesystem::path(input).stem().string();
  }
  const auto progress = terminal_progress(verb.common, "learning");
  manifold::LearnedManifold learned =
      manifold::learn_manifold(captures, options_of(verb), progress.get());
  learned.manifold.record_json =
      run_record("manifold learn", options_json(verb, learned.manifold), records).dump();
  write_bytes(verb.output, manifold::write_manifold(learned.manifold), verb.common);
  if (!verb.picture.empty()) {
    write_bytes(verb.picture,
                manifold_picture(learned.manifold, learned.report.elbow_errors, title,
                                 is_svg(verb.picture)),
                verb.common);
  }
  print(verb, learned);
}

}  // namespace

void add_manifold_learn(CLI::App* manifold) {
  auto verb = std::make_shared<ManifoldLearnVerb>();
  CLI::App* sub = add_verb(*manifold, "learn", "Learn a map of poses from clips",
                           "laban manifold learn ballet.bvh -o ballet.manifold --picture som.png");
  sub->add_option("INPUT", verb->inputs,
                  "clips to learn from; the first one's rig plays the output")
      ->required();
  sub->add_option("-o,--output", verb->output, "manifold file to write (.manifold)")->required();
  sub->add_option("--picture", verb->picture,
                  "picture of the maps, primitives and transitions (.png or .svg)");
  sub->add_option("--plane", verb->map, "how poses are laid out")
      ->check(CLI::IsMember({"som", "pca"}))
      ->capture_default_str();
  sub->add_option("--size", verb->size, "rows and columns of the map")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  sub->add_option("--epochs", verb->options.som.epochs, "passes over the poses")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  sub->add_option("--last-radius", verb->options.som.last_radius,
                  "neighbourhood of the last pass, nodes")
      ->check(positive_number())
      ->capture_default_str();
  sub->add_option("--basis", verb->basis, "radial functions from map to poses")
      ->check(CLI::IsMember({"thin-plate", "gaussian"}))
      ->capture_default_str();
  sub->add_option("--centers", verb->options.grbf.centers_a_side,
                  "centres of the radial functions a side")
      ->check(CLI::Range(2, 64))
      ->capture_default_str();
  sub->add_option("--ridge", verb->options.grbf.ridge, "ridge of their fit")
      ->check(number_from_0())
      ->capture_default_str();
  sub->add_option("--primitives", verb->options.primitives,
                  "number of motion primitives (default: at the elbow)")
      ->check(CLI::Range(1, 1000));
  sub->add_option("--cluster", verb->method, "what finds the primitives")
      ->check(CLI::IsMember({"k-means", "fuzzy", "mixture"}))
      ->capture_default_str();
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common, {.writes = true, .threads = true, .seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
