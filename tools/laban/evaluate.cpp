#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/draw/bar_chart.h"
#include "laban/transfer/closed_loop.h"
#include "laban/transfer/corpus_evaluation.h"

#include "evaluation_report.h"
#include "files.h"
#include "number_checks.h"
#include "report.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct EvaluateVerb {
  Common common;
  std::string labels;
  ReadCorpusOptions reading;
  std::string csv;
  std::string runs_csv;
  std::string plot;
  std::string protocol = std::string(effort::name_of(effort::Protocol::kRandom));
  std::vector<std::string> models;
  effort::EvaluationOptions options;
  std::optional<int> runs;
  std::optional<int> train;
  std::optional<int> test;
  int components = 3;
  int closed_loop = 0;
  transfer::SearchOptions search;  ///< of the closed loop
  int tries = transfer::kTries;    ///< the same
};

/// Blends of the corpus: labels of one blend by several observers are one.
int blend_count(const transfer::StyleCorpus& corpus) {
  std::set<std::tuple<std::string, int, int, double>> blends;
  for (const transfer::CorpusBlend& blend : corpus.blends)
    blends.emplace(blend.name, blend.fragment_i, blend.fragment_j, blend.alpha);
  return static_cast<int>(blends.size());
}

/// Options of random splits: the paper's 85 of 105, or the same share of another number of blends.
void set_sizes(EvaluateVerb& verb, int blends) {
  const int share = static_cast<int>(std::lround(blends * 85.0 / 105.0));
  verb.options.runs = verb.runs.value_or(verb.options.runs);
  verb.options.train =
      verb.train.value_or(verb.test ? std::max(1, std::min(share, blends - *verb.test)) : share);
  verb.options.test = verb.test.value_or(blends - verb.options.train);
}

/// True if labels are trusted differently.
bool has_weights(const transfer::StyleCorpus& corpus) {
  return std::any_of(corpus.blends.begin(), corpus.blends.end(), [&](const auto& blend) {
    return blend.weight != corpus.blends.front().weight;
  });
}

void leave_out_svr(EvaluateVerb& verb) {
  warn(verb.common,
       "svr is left out: it cannot weigh labels by confidence; make confidences equal to compare "
       "it");
  std::erase(verb.options.models, effort::RegressorKind::kSupportVector);
}

void set_options(EvaluateVerb& verb, effort::Protocol protocol, int blends) {
  if (protocol == effort::Protocol::kRandom) {
    set_sizes(verb, blends);
  } else if (verb.runs || verb.train || verb.test) {
    throw base::Error(base::ErrorKind::kUsage,
                      "--runs, --train and --test are for random splits; " + verb.protocol +
                          " makes one run for each that is left out");
  }
  if (!verb.models.empty()) verb.options.models.clear();
  for (const std::string& name : verb.models) {
    verb.options.models.push_back(*effort::regressor_named(name));
  }
  verb.options.seed = verb.common.seed;
  verb.options.threads = verb.common.threads;
}

Json record_of(const EvaluateVerb& verb, const effort::EvaluationReport& report,
               const LabelledCorpus& read) {
  Json models = Json::array();
  for (const effort::RegressorKind kind : verb.options.models)
    models.push_back(effort::name_of(kind));
  Json options = {{"protocol", verb.protocol},   {"models", models},
                  {"seed", verb.common.seed},    {"symmetric", verb.options.symmetric},
                  {"folds", verb.options.folds}, {"components", verb.components},
                  {"raters", read.raters}};
  if (report.protocol == effort::Protocol::kRandom) {
    options["runs"] = verb.options.runs;
    options["train"] = verb.options.train;
    options["test"] = verb.options.test;
  }
  return run_record("evaluate", options, read.records);
}

std::string picture(const EvaluateVerb& verb, const effort::EvaluationReport& report) {
  draw::ChartOptions options;
  options.format = is_svg(verb.plot) ? draw::Format::kSvg : draw::Format::kPng;
  return draw::bar_chart(table_chart(report), options);
}

Json json_of(const std::array<transfer::ClosedLoopScore, effort::kFactorCount>& scores) {
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
  options.search = verb.search;
  options.tries = verb.tries;
  const transfer::StyleModel model = transfer::train_style_model(read.corpus, training);
  const auto single = transfer::closed_loop_scores(transfer::single_factor_trials(model, options));
  const auto left_out =
      transfer::closed_loop_scores(transfer::left_out_trials(model, read.corpus, options));
  if (verb.common.json) {
    const Json json = {{"schema", "laban.evaluate.closed-loop/1"},
                       {"single_factor", json_of(single)},
                       {"left_out_labels", json_of(left_out)},
                       {"run", run_record("evaluate",
                                          {{"closed_loop", verb.closed_loop},
                                           {"seed", verb.common.seed},
                                           {"neighbours", verb.search.neighbors},
                                           {"samples", verb.search.samples},
                                           {"caution", verb.search.caution},
                                           {"stay", verb.search.stay},
                                           {"way", verb.search.way},
                                           {"tries", verb.tries}},
                                          read.records)}};
    fmt::print("{}\n", json.dump(2));
    return;
  }
  print("single-factor targets, other factors free", single);
  print("three-factor targets: the label of a left-out fragment of the same content", left_out);
}

void run(EvaluateVerb& verb) {
  check_outputs(verb.common, {verb.csv, verb.runs_csv, verb.plot});
  if (!verb.plot.empty()) (void)is_svg(verb.plot);
  const LabelledCorpus read = read_corpus(verb.labels, verb.reading, verb.common);
  if (verb.closed_loop > 0) return run_closed_loop(verb, read);
  const effort::Protocol protocol = *effort::protocol_named(verb.protocol);
  set_options(verb, protocol, blend_count(read.corpus));
  if (verb.models.empty() && has_weights(read.corpus)) leave_out_svr(verb);
  effort::ContentMapOptions content;
  content.components = verb.components;
  const effort::EvaluationReport report = [&] {
    const auto progress = terminal_progress(verb.common, "evaluating");
    return transfer::evaluate_corpus(read.corpus, protocol, verb.options, content, progress.get());
  }();  // and the progress line is gone before anything is printed
  if (!verb.csv.empty()) write_bytes(verb.csv, table_csv(report), verb.common);
  if (!verb.runs_csv.empty()) write_bytes(verb.runs_csv, runs_csv(report), verb.common);
  if (!verb.plot.empty()) write_bytes(verb.plot, picture(verb, report), verb.common);
  if (verb.common.json) {
    Json json = {{"schema", "laban.evaluate/1"}};
    json.update(to_json(report));
    json["run"] = record_of(verb, report, read);
    fmt::print("{}\n", json.dump(2));
  } else if (verb.csv != "-" && verb.runs_csv != "-") {
    fmt::print("{}", to_text(report));
  }
}

}  // namespace

void add_evaluate(CLI::App& app) {
  auto verb = std::make_shared<EvaluateVerb>();
  CLI::App* sub = add_verb(app, "evaluate",
                           "Measure prediction error of the five regressors: Table 1 of the paper",
                           "laban evaluate --labels labels/phrase.csv --runs 500");
  sub->add_option("--labels", verb->labels, "label table (CSV)")->required();
  sub->add_option("--clips", verb->reading.clips, "folder of the clips (default: the table's own)");
  CLI::Option* protocol =
      sub->add_option("--protocol", verb->protocol, "how blends are held out to be tested on")
          ->check(CLI::IsMember({"random", "leave-performer-out", "leave-content-out"}))
          ->capture_default_str();
  sub->add_option("--models", verb->models,
                  "regressors to compare, e.g. kernel-ridge,svr (default: all)")
      ->delimiter(',')
      ->check(CLI::IsMember({"linear-interpolation", "linear-ridge", "kernel-ridge", "svr",
                             "residual-kernel-ridge"}));
  sub->add_option("--runs", verb->runs, "random splits (default: 500)")
      ->check(CLI::Range(2, 1000000));
  sub->add_option("--train", verb->train, "blends trained on (default: 85 of 105, or that share)")
      ->check(positive_number());
  sub->add_option("--test", verb->test, "blends tested on (default: the rest)")
      ->check(positive_number());
  sub->add_option("--folds", verb->options.folds, "folds of the cross-validation")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  sub->add_option("--components", verb->components, "principal components of content")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  sub->add_flag("--symmetric", verb->options.symmetric,
                "a blend counts in both orders (not the paper's protocol)");
  CLI::Option* csv = sub->add_option("--csv", verb->csv, "table to write (CSV)");
  CLI::Option* runs_csv =
      sub->add_option("--runs-csv", verb->runs_csv, "test errors of every run to write (CSV)");
  CLI::Option* plot = sub->add_option("--plot", verb->plot, "bars to write (.png or .svg)");
  sub->add_option(
         "--closed-loop", verb->closed_loop,
         "instead: ask for so many targets a factor, synthesise, and measure what came of it")
      ->check(positive_number())
      ->excludes(protocol)
      ->excludes(csv)
      ->excludes(runs_csv)
      ->excludes(plot);
  add_rater_options(sub, verb->reading);
  add_search_options(sub, verb->search, verb->tries);
  add_common(sub, verb->common, {.writes = true, .threads = true, .seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
