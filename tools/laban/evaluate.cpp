#include <cmath>

#include <fmt/core.h>

#include "laban/base/csv.h"
#include "laban/base/error.h"
#include "laban/draw/bar_chart.h"
#include "laban/effort/evaluation.h"
#include "laban/transfer/closed_loop.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {
namespace {

using effort::ModelScore;

struct EvaluateVerb {
  Common common;
  std::string labels;
  std::string clips;
  std::string csv;
  std::string plot;
  effort::EvaluationOptions options;
  std::optional<int> train;
  std::optional<int> test;
  int components = 3;
  int closed_loop = 0;
};

/// The paper's 85 of 105, or the same share of another number of blends.
void set_sizes(EvaluateVerb& verb, int blends) {
  verb.options.train = verb.train.value_or(static_cast<int>(std::lround(blends * 85.0 / 105.0)));
  verb.options.test = verb.test.value_or(blends - verb.options.train);
}

Json to_json(const EvaluateVerb& verb, const effort::EvaluationReport& report,
             const std::vector<InputRecord>& inputs) {
  const auto estimate = [](const effort::Estimate& value) {
    return Json{{"mean", value.mean},
                {"standard_error", value.standard_error},
                {"corrected_standard_error", value.corrected_standard_error}};
  };
  Json json = {{"schema", "laban.evaluate/1"},
               {"runs", report.runs},
               {"train", report.train},
               {"test", report.test}};
  for (const effort::FactorReport& factor : report.factors) {
    Json& entry = json["factors"][std::string(effort::name_of(factor.factor))];
    entry["label_variance"] = factor.label_variance;
    for (const ModelScore& score : factor.models) {
      entry["models"][std::string(effort::name_of(score.kind))] = {
          {"mean_squared_error", estimate(score.error)},
          {"ratio_to_linear_interpolation", score.ratio_to_interpolation},
          {"paper", score.paper ? Json(*score.paper) : Json()}};
    }
    if (const auto& paired = factor.fifth_against_best) {
      entry["fifth_against_best"] = {{"against", effort::name_of(paired->against)},
                                     {"difference", estimate(paired->difference)}};
    }
  }
  json["run"] = run_record("evaluate",
                           {{"seed", verb.common.seed},
                            {"symmetric", verb.options.symmetric},
                            {"folds", verb.options.folds},
                            {"components", verb.components}},
                           inputs);
  return json;
}

void print(const effort::EvaluationReport& report) {
  fmt::print("mean squared error, {} runs of {} training and {} test blends\n", report.runs,
             report.train, report.test);
  fmt::print("{:<8}{:<24}{:>8}{:>9}{:>8}{:>8}\n", "", "", "mean", "+-", "ratio", "paper");
  for (const effort::FactorReport& factor : report.factors) {
    fmt::print("{:<8}label variance {:.3f}\n", effort::name_of(factor.factor),
               factor.label_variance);
    for (const ModelScore& score : factor.models) {
      fmt::print("{:<8}{:<24}{:>8.4f}{:>9.4f}{:>8.3f}{:>8}\n", "", effort::name_of(score.kind),
                 score.error.mean, score.error.standard_error, score.ratio_to_interpolation,
                 score.paper ? fmt::format("{:.2f}", *score.paper) : "-");
    }
    if (const auto& paired = factor.fifth_against_best) {
      fmt::print("{:<8}{} - {}: {:+.4f} +- {:.4f} ({:.4f} for other blends)\n", "",
                 effort::name_of(paired->model), effort::name_of(paired->against),
                 paired->difference.mean, paired->difference.standard_error,
                 paired->difference.corrected_standard_error);
    }
  }
  fmt::print(
      "+- is the standard error over runs; ratio is to linear interpolation; paper: other labels, "
      "for the pattern only\n");
}

std::string csv_text(const effort::EvaluationReport& report) {
  std::string text =
      base::format_csv_row({"factor", "model", "mean_squared_error", "standard_error",
                            "ratio_to_linear_interpolation", "label_variance", "paper"});
  for (const effort::FactorReport& factor : report.factors) {
    for (const ModelScore& score : factor.models) {
      text += base::format_csv_row(
          {std::string(effort::name_of(factor.factor)), std::string(effort::name_of(score.kind)),
           base::format_number(score.error.mean), base::format_number(score.error.standard_error),
           base::format_number(score.ratio_to_interpolation),
           base::format_number(factor.label_variance),
           score.paper ? base::format_number(*score.paper) : ""});
    }
  }
  return text;
}

std::string plot(const EvaluateVerb& verb, const effort::EvaluationReport& report) {
  draw::BarChart chart;
  chart.title = fmt::format("Mean squared error over {} runs", report.runs);
  chart.y.label = "mean squared error";
  chart.y.min = 0.0;
  chart.reference_name = "paper";
  for (std::size_t m = 0; m < report.factors.front().models.size(); ++m) {
    draw::BarSeries series{
        std::string(effort::name_of(report.factors.front().models[m].kind)), {}, {}, {}};
    for (const effort::FactorReport& factor : report.factors) {
      const ModelScore& score = factor.models[m];
      series.values.push_back(score.error.mean);
      series.errors.push_back(score.error.standard_error);
      series.references.push_back(score.paper.value_or(std::nan("")));
    }
    chart.series.push_back(std::move(series));
  }
  for (const effort::FactorReport& factor : report.factors)
    chart.groups.emplace_back(effort::name_of(factor.factor));
  draw::ChartOptions options;
  options.format = is_svg(verb.plot) ? draw::Format::kSvg : draw::Format::kPng;
  return draw::bar_chart(chart, options);
}

Json to_json(const std::array<transfer::ClosedLoopScore, effort::kFactorCount>& scores) {
  Json json;
  for (const effort::Factor factor : effort::kFactors) {
    const auto& score = scores[static_cast<std::size_t>(effort::index_of(factor))];
    json[std::string(effort::name_of(factor))] = {
        {"trials", score.trials},
        {"asked_predicted_error", score.asked_predicted_error},
        {"asked_measured_error", score.asked_measured_error},
        {"rank_correlation", score.rank_correlation}};
  }
  return json;
}

void print(const std::string& title,
           const std::array<transfer::ClosedLoopScore, effort::kFactorCount>& scores) {
  fmt::print("{}\n{:<8}{:>8}{:>20}{:>19}{:>18}\n", title, "", "trials", "|asked - predicted|",
             "|asked - measured|", "rank correlation");
  for (const effort::Factor factor : effort::kFactors) {
    const auto& score = scores[static_cast<std::size_t>(effort::index_of(factor))];
    fmt::print("{:<8}{:>8}{:>20.3f}{:>19.3f}{:>18.3f}\n", effort::name_of(factor), score.trials,
               score.asked_predicted_error, score.asked_measured_error, score.rank_correlation);
  }
}

/// Does `apply` do what it is asked, as an observer who is not the regressor sees it?
void run_closed_loop(const EvaluateVerb& verb, const LabelledCorpus& read) {
  transfer::TrainOptions training;
  training.learning.seed = verb.common.seed;
  training.content_map.components = verb.components;
  training.threads = verb.common.threads;
  transfer::ClosedLoopOptions options;
  options.targets = verb.closed_loop;
  options.seed = verb.common.seed;
  options.threads = verb.common.threads;
  const transfer::StyleModel model = transfer::train_style_model(read.corpus, training);
  const auto single = transfer::closed_loop_scores(transfer::single_factor_trials(model, options));
  const auto left_out =
      transfer::closed_loop_scores(transfer::left_out_trials(model, read.corpus, options));
  if (verb.common.json) {
    const Json json = {
        {"schema", "laban.evaluate.closed-loop/1"},
        {"single_factor", to_json(single)},
        {"left_out_labels", to_json(left_out)},
        {"run",
         run_record("evaluate", {{"closed_loop", verb.closed_loop}, {"seed", verb.common.seed}},
                    read.records)}};
    fmt::print("{}\n", json.dump(2));
    return;
  }
  print("single-factor targets, other factors free", single);
  print("three-factor targets: the label of a left-out fragment of the same content", left_out);
}

void run(EvaluateVerb& verb) {
  check_outputs(verb.common, {verb.csv, verb.plot});
  if (!verb.plot.empty()) (void)is_svg(verb.plot);
  const LabelledCorpus read = read_corpus(verb.labels, {verb.clips, std::nullopt}, verb.common);
  if (verb.closed_loop > 0) return run_closed_loop(verb, read);
  effort::ContentMapOptions content;
  content.components = verb.components;
  const auto map = transfer::fit_corpus_content_map(read.corpus.fragments, content);
  const auto samples = transfer::style_samples(
      read.corpus, transfer::content_coordinates(read.corpus.fragments, map));
  set_sizes(verb, samples.count());
  verb.options.seed = verb.common.seed;
  verb.options.threads = verb.common.threads;
  const auto progress = terminal_progress(verb.common, "evaluating");
  const effort::EvaluationReport report = effort::evaluate(samples, verb.options, progress.get());
  if (!verb.csv.empty()) write_bytes(verb.csv, csv_text(report), verb.common);
  if (!verb.plot.empty()) write_bytes(verb.plot, plot(verb, report), verb.common);
  if (verb.common.json) {
    fmt::print("{}\n", to_json(verb, report, read.records).dump(2));
  } else {
    print(report);
  }
}

}  // namespace

void add_evaluate(CLI::App& app) {
  auto verb = std::make_shared<EvaluateVerb>();
  CLI::App* sub = add_verb(app, "evaluate",
                           "Measure prediction error of the five regressors: Table 1 of the paper",
                           "laban evaluate --labels labels/phrase.csv --runs 500");
  sub->add_option("--labels", verb->labels, "label table (CSV)")->required();
  sub->add_option("--clips", verb->clips, "folder of the clips (default: the table's own)");
  sub->add_option("--runs", verb->options.runs, "random splits")
      ->check(CLI::Range(2, 1000000))
      ->capture_default_str();
  sub->add_option("--train", verb->train, "blends trained on (default: 85 of 105, or that share)")
      ->check(CLI::PositiveNumber);
  sub->add_option("--test", verb->test, "blends tested on (default: the rest)")
      ->check(CLI::PositiveNumber);
  sub->add_option("--folds", verb->options.folds, "folds of the cross-validation")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  sub->add_option("--components", verb->components, "principal components of content")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  sub->add_flag("--symmetric", verb->options.symmetric,
                "a blend counts in both orders (not the paper's protocol)");
  sub->add_option(
         "--closed-loop", verb->closed_loop,
         "instead: ask for so many targets a factor, synthesise, and measure what came of it")
      ->check(CLI::PositiveNumber);
  sub->add_option("--csv", verb->csv, "table to write (CSV)");
  sub->add_option("--plot", verb->plot, "bars to write (.png or .svg)");
  add_common(sub, verb->common, {.writes = true, .threads = true, .seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
