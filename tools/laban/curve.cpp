#include <fmt/core.h>

#include "laban/base/csv.h"
#include "laban/base/error.h"
#include "laban/draw/line_chart.h"
#include "laban/transfer/style_search.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct CurveVerb {
  Common common;
  std::string model;
  std::vector<std::string> pairs;
  std::string picture;
  std::string csv;
};

struct FragmentPair {
  int i = 0;
  int j = 0;
};

int find_fragment(const transfer::StyleModel& model, const std::string& name) {
  for (std::size_t i = 0; i < model.fragments.size(); ++i) {
    if (model.fragments[i].name == name) return static_cast<int>(i);
  }
  throw base::Error(base::ErrorKind::kUsage, "the model has no fragment '" + name +
                                                 "'; 'laban inspect MODEL -v' lists them");
}

/// The pairs asked for, or three random ones as in Figure 1.
std::vector<FragmentPair> pairs_of(const CurveVerb& verb, const transfer::StyleModel& model) {
  std::vector<FragmentPair> pairs;
  for (const std::string& pair : verb.pairs) {
    const std::size_t comma = pair.find(',');
    if (comma == std::string::npos) {
      throw base::Error(base::ErrorKind::kUsage, "--pair " + pair + ": give two fragments, A,B");
    }
    pairs.push_back({find_fragment(model, pair.substr(0, comma)),
                     find_fragment(model, pair.substr(comma + 1))});
  }
  if (!pairs.empty()) return pairs;
  for (const transfer::CorpusBlend& blend :
       transfer::draw_blends(model.fragments, {.count = 3, .seed = verb.common.seed})) {
    pairs.push_back({blend.fragment_i, blend.fragment_j});
  }
  return pairs;
}

std::vector<double> alpha_axis() {
  std::vector<double> alphas;
  for (int n = 0; n <= 80; ++n) alphas.push_back(-0.5 + 0.025 * n);
  return alphas;
}

draw::ChartPanel make_panel(const transfer::StyleModel& model, const FragmentPair& pair,
                            const std::vector<double>& alphas, const Eigen::Matrix3Xd& values) {
  draw::ChartPanel panel;
  panel.title = model.fragments[static_cast<std::size_t>(pair.i)].name + " to " +
                model.fragments[static_cast<std::size_t>(pair.j)].name;
  panel.x = {"alpha", -0.5, 1.5};
  panel.y = {"Effort", effort::kEffortMin, effort::kEffortMax};
  panel.spans.push_back({blend::kMinAlpha, blend::kMaxAlpha, ""});
  for (const effort::Factor factor : effort::kFactors) {
    draw::Curve curve;
    curve.name = std::string(effort::name_of(factor));
    curve.x = alphas;
    for (Eigen::Index n = 0; n < values.cols(); ++n)
      curve.y.push_back(values(effort::index_of(factor), n));
    panel.curves.push_back(std::move(curve));
  }
  return panel;
}

void run(const CurveVerb& verb) {
  check_outputs(verb.common, {verb.picture, verb.csv});
  InputRecord record;
  const transfer::StyleModel model = read_model(verb.model, record);
  const std::vector<double> alphas = alpha_axis();
  draw::LineChart chart;
  chart.title = "Predicted Effort against the blend weight (trained on the grey span)";
  std::string text =
      base::format_csv_row({"fragment_i", "fragment_j", "alpha", "flow", "weight", "time"});
  Json json = {{"schema", "laban.curve/1"}, {"alpha", alphas}, {"pairs", Json::array()}};
  for (const FragmentPair& pair : pairs_of(verb, model)) {
    const Eigen::Matrix3Xd values = transfer::effort_curve(model, pair.i, pair.j, alphas);
    chart.panels.push_back(make_panel(model, pair, alphas, values));
    const std::string& name_i = model.fragments[static_cast<std::size_t>(pair.i)].name;
    const std::string& name_j = model.fragments[static_cast<std::size_t>(pair.j)].name;
    Json entry = {{"fragment_i", name_i}, {"fragment_j", name_j}};
    for (const effort::Factor factor : effort::kFactors) {
      const Eigen::VectorXd row = values.row(effort::index_of(factor));
      entry[std::string(effort::name_of(factor))] = std::vector<double>(row.begin(), row.end());
    }
    json["pairs"].push_back(entry);
    for (std::size_t n = 0; n < alphas.size(); ++n) {
      const auto column = static_cast<Eigen::Index>(n);
      text += base::format_csv_row(
          {name_i, name_j, base::format_number(alphas[n]), base::format_number(values(0, column)),
           base::format_number(values(1, column)), base::format_number(values(2, column))});
    }
  }
  if (!verb.picture.empty()) {
    draw::ChartOptions options;
    options.format = is_svg(verb.picture) ? draw::Format::kSvg : draw::Format::kPng;
    write_bytes(verb.picture, draw::line_chart(chart, options), verb.common);
  }
  if (!verb.csv.empty()) write_bytes(verb.csv, text, verb.common);
  if (verb.common.json) {
    fmt::print("{}\n", json.dump(2));
  } else if (verb.csv != "-") {
    fmt::print("{}", text);
  }
}

}  // namespace

void add_curve(CLI::App& app) {
  auto verb = std::make_shared<CurveVerb>();
  CLI::App* sub = add_verb(
      app, "curve", "Show predicted Effort against the blend weight: Figure 1 of the paper",
      "laban curve --pair phrase_walk_p01,phrase_walk_p05 --picture curve.png");
  sub->add_option("--model", verb->model, "style model (default: the embedded corpus's)");
  sub->add_option("--pair", verb->pairs,
                  "two fragments of the model, A,B; may be repeated (default: three random pairs)");
  sub->add_option("--picture", verb->picture, "chart to write (.png or .svg)");
  sub->add_option("--csv", verb->csv, "table to write (CSV) instead of printing it");
  add_common(sub, verb->common, {.writes = true, .seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
