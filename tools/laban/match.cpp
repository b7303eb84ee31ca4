#include <fmt/core.h>

#include "laban/align/dtw.h"
#include "laban/align/nearest_fragments.h"
#include "laban/align/segment_input.h"
#include "laban/base/csv.h"
#include "laban/base/error.h"

#include "files.h"
#include "number_checks.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct MatchVerb {
  Common common;
  ReadClipOptions reading;
  std::vector<std::string> inputs;
  std::string model;
  std::string metric = "content";
  std::string path;
  int count = 5;
};

/// Joint angles as the metric of a pair without a database sees them.
Eigen::MatrixXd pair_features(const motion::PoseMatrix& pose, const Eigen::VectorXd& reference,
                              bool raw) {
  const Eigen::MatrixXd angles = align::on_branch_of(pose.angles, reference);
  if (raw) return angles;
  const Eigen::VectorXd mean = angles.rowwise().mean();
  return angles.colwise() - mean;
}

void match_pair(const MatchVerb& verb) {
  const CapturedClip first = read_captured_clip(verb.inputs[0], verb.reading, verb.common);
  const CapturedClip second = read_captured_clip(verb.inputs[1], verb.reading, verb.common);
  const motion::PoseMatrix x = first.pose();
  const motion::PoseMatrix y = second.pose(x.frame_rate_hz);
  const Eigen::VectorXd reference = x.angles.rowwise().mean();
  const bool raw = verb.metric == "raw";
  const align::DtwResult result =
      align::dtw(pair_features(x, reference, raw), pair_features(y, reference, raw));
  if (!verb.path.empty()) {
    std::string text = base::format_csv_row({"frame_a", "frame_b"});
    for (const align::FramePair& pair : result.path) {
      text += base::format_csv_row({std::to_string(pair.p), std::to_string(pair.q)});
    }
    write_bytes(verb.path, text, verb.common);
  }
  if (verb.common.json) {
    const Json json = {{"schema", "laban.match/1"},
                       {"metric", verb.metric},
                       {"cost", result.cost},
                       {"mean_cost", result.mean_cost()},
                       {"path_length", result.path.size()},
                       {"frames", {x.frame_count(), y.frame_count()}},
                       {"frame_rate_hz", x.frame_rate_hz}};
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print(
      "sum of squared distances (SSD) {:.4f} over a path of {} cells: mean {:.5f} rad^2 a cell ({} "
      "metric)\n",
      result.cost, result.path.size(), result.mean_cost(), verb.metric);
  fmt::print("{} frames beside {} frames at {:g} Hz\n", x.frame_count(), y.frame_count(),
             x.frame_rate_hz);
}

void match_database(const MatchVerb& verb) {
  InputRecord record;
  const transfer::StyleModel model = read_model(verb.model, record);
  const CapturedClip clip = read_captured_clip(verb.inputs[0], verb.reading, verb.common);
  const motion::PoseMatrix pose = clip.pose(model.frame_rate_hz());
  // The performer's mean pose is not known from one action; segmentation estimates it.
  const auto cut = align::segment_input(pose, model.database);
  LABAN_CHECK(cut.has_value());  // without a slope limit there is a path
  const auto found = align::nearest(cut->features, model.database.features(), verb.count);
  Json json = {{"schema", "laban.match/1"}, {"metric", verb.metric}, {"nearest", Json::array()}};
  if (!verb.common.json)
    fmt::print("{:<32} {:<12} {:>12} {:>12}\n", "fragment", "content", "SSD", "mean a cell");
  for (const align::Neighbor& neighbor : found) {
    const transfer::Fragment& fragment =
        model.fragments[static_cast<std::size_t>(neighbor.fragment)];
    json["nearest"].push_back({{"fragment", fragment.name},
                               {"content", fragment.content},
                               {"cost", neighbor.cost},
                               {"mean_cost", neighbor.mean_cost}});
    if (verb.common.json) continue;
    fmt::print("{:<32} {:<12} {:>12.4f} {:>12.5f}\n", fragment.name, fragment.content,
               neighbor.cost, neighbor.mean_cost);
  }
  if (verb.common.json) fmt::print("{}\n", json.dump(2));
}

void run(const MatchVerb& verb) {
  check_outputs(verb.common, {verb.path});
  if (verb.inputs.size() == 2) return match_pair(verb);
  if (!verb.path.empty()) throw base::Error(base::ErrorKind::kUsage, "--path needs two clips");
  match_database(verb);
}

}  // namespace

void add_match(CLI::App& app) {
  auto verb = std::make_shared<MatchVerb>();
  CLI::App* sub =
      add_verb(app, "match", "Align two clips by DTW, or find the fragments nearest to one clip",
               "laban match walk_tired.bvh walk_proud.bvh --path path.csv");
  sub->add_option("INPUT", verb->inputs, "two clips; or one, to look in a model's database")
      ->required()
      ->expected(1, 2);
  sub->add_option("--model", verb->model,
                  "style model to look in (default: the embedded corpus's)");
  sub->add_option("--metric", verb->metric,
                  "for two clips: 'raw' joint angles, or 'content', each relative to its mean pose")
      ->check(CLI::IsMember({"content", "raw"}))
      ->capture_default_str();
  sub->add_option("--count", verb->count, "how many fragments to list")
      ->check(positive_number())
      ->capture_default_str();
  sub->add_option("--path", verb->path, "warping path to write (CSV)");
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common, {.writes = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
