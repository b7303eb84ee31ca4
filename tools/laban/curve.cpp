#include <algorithm>
#include <cmath>

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

/// Predicted Effort along one pair.
struct PairCurve {
  std::string title;
  std::string name_i;
  std::string name_j;
  effort::EffortMatrix mean;
  /// NaN where the regressor tells none.
  effort::EffortMatrix error;
};

/// "kick: p01 to p05" of phrase_kick_p01 and phrase_kick_p05: panels are narrow, and what the names
/// begin with in common tells them apart from nothing.
std::string title_of(const transfer::Fragment& i, const transfer::Fragment& j) {
  std::size_t begin = 0;
  for (std::size_t n = 0; n < std::min(i.name.size(), j.name.size()); ++n) {
    if (i.name[n] != j.name[n]) break;
    if (i.name[n] == '_') begin = n + 1;
  }
  const std::string content = i.content.empty() ? "" : i.content + ": ";
  return content + i.name.substr(begin) + " to " + j.name.substr(begin);
}

PairCurve curve_of(const transfer::StyleModel& model, const FragmentPair& pair,
                   const std::vector<double>& alphas) {
  const transfer::Fragment& i = model.fragments[static_cast<std::size_t>(pair.i)];
  const transfer::Fragment& j = model.fragments[static_cast<std::size_t>(pair.j)];
  PairCurve curve;
  curve.title = title_of(i, j);
  curve.name_i = i.name;
  curve.name_j = j.name;
  curve.mean = transfer::effort_curve(model, pair.i, pair.j, alphas);
  curve.error.setConstant(curve.mean.rows(), curve.mean.cols(), std::nan(""));
  if (const auto told = transfer::effort_curve_with_error(model, pair.i, pair.j, alphas))
    curve.error = told->standard_error;
  return curve;
}

std::vector<double> row_of(const effort::EffortMatrix& values, effort::Factor factor) {
  const Eigen::VectorXd row = values.row(effort::index_of(factor));
  return {row.begin(), row.end()};
}

draw::ChartPanel make_panel(const PairCurve& pair, const std::vector<double>& alphas) {
  draw::ChartPanel panel;
  panel.title = pair.title;
  panel.x = {"alpha", -0.5, 1.5};
  panel.y = {"Effort", effort::kEffortMin, effort::kEffortMax};
  panel.spans.push_back({blend::kMinAlpha, blend::kMaxAlpha, ""});
  for (const effort::Factor factor : effort::factors_of(pair.mean.rows())) {
    draw::Curve curve;
    curve.name = std::string(effort::name_of(factor));
    curve.x = alphas;
    curve.y = row_of(pair.mean, factor);
    curve.band_low = row_of(pair.mean - pair.error, factor);
    curve.band_high = row_of(pair.mean + pair.error, factor);
    panel.curves.push_back(std::move(curve));
  }
  return panel;
}

Json json_of(const PairCurve& pair) {
  Json json = {{"fragment_i", pair.name_i}, {"fragment_j", pair.name_j}};
  for (const effort::Factor factor : effort::factors_of(pair.mean.rows()))
    json[std::string(effort::name_of(factor))] = row_of(pair.mean, factor);
  if (!pair.error.hasNaN()) {
    for (const effort::Factor factor : effort::factors_of(pair.mean.rows()))
      json[std::string(effort::name_of(factor)) + "_error"] = row_of(pair.error, factor);
  }
  return json;
}

std::string csv_head(const transfer::StyleModel& model) {
  std::vector<std::string> names = {"fragment_i", "fragment_j", "alpha"};
  for (const char* const ending : {"", "_error"}) {
    for (const effort::Factor factor : model.factors())
      names.push_back(std::string(effort::name_of(factor)) + ending);
  }
  return base::format_csv_row(names);
}

std::string csv_rows(const PairCurve& pair, const std::vector<double>& alphas) {
  std::string text;
  for (std::size_t n = 0; n < alphas.size(); ++n) {
    std::vector<std::string> row = {pair.name_i, pair.name_j, base::format_number(alphas[n])};
    for (const effort::EffortMatrix* values : {&pair.mean, &pair.error}) {
      for (const double value : values->col(static_cast<Eigen::Index>(n)))
        row.push_back(std::isfinite(value) ? base::format_number(value) : "");
    }
    text += base::format_csv_row(row);
  }
  return text;
}

std::string picture(const CurveVerb& verb, draw::LineChart chart, bool has_bands) {
  chart.title = has_bands ? "Predicted Effort against the blend weight, with its standard error "
                            "(trained on the grey span)"
                          : "Predicted Effort against the blend weight (trained on the grey span)";
  draw::ChartOptions options;
  options.format = is_svg(verb.picture) ? draw::Format::kSvg : draw::Format::kPng;
  return draw::line_chart(chart, options);
}

void run(const CurveVerb& verb) {
  check_outputs(verb.common, {verb.picture, verb.csv});
  if (!verb.picture.empty()) (void)is_svg(verb.picture);
  InputRecord record;
  const transfer::StyleModel model = read_model(verb.model, record);
  const std::vector<double> alphas = alpha_axis();
  draw::LineChart chart;
  bool has_bands = false;
  std::string text = csv_head(model);
  Json json = {{"schema", "laban.curve/1"}, {"alpha", alphas}, {"pairs", Json::array()}};
  for (const FragmentPair& pair : pairs_of(verb, model)) {
    const PairCurve curve = curve_of(model, pair, alphas);
    has_bands = has_bands || !curve.error.hasNaN();
    chart.panels.push_back(make_panel(curve, alphas));
    json["pairs"].push_back(json_of(curve));
    text += csv_rows(curve, alphas);
  }
  if (!verb.picture.empty())
    write_bytes(verb.picture, picture(verb, std::move(chart), has_bands), verb.common);
  if (!verb.csv.empty()) write_bytes(verb.csv, text, verb.common);
  if (verb.common.json) {
    fmt::print("{}\n", json.dump(2));
  } else if (verb.csv.empty()) {
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
