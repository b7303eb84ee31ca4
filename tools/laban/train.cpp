#include <set>

#include <fmt/core.h>

#include "laban/base/error.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

struct TrainVerb {
  Common common;
  std::string labels;
  ReadCorpusOptions reading;
  std::string output;
  std::string regressor;
  std::string metric = "content";
  bool skip_blank = false;
  bool ordered = false;
  int components = 3;
  int folds = 10;
};

void remove_blank(LabelledCorpus& read) {
  transfer::StyleCorpus rated;
  std::vector<int> place(read.corpus.fragments.size(), -1);
  for (std::size_t i = 0; i < read.corpus.fragments.size(); ++i) {
    if (!read.corpus.fragments[i].effort) continue;
    place[i] = static_cast<int>(rated.fragments.size());
    rated.fragments.push_back(read.corpus.fragments[i]);
  }
  for (transfer::CorpusBlend blend : read.corpus.blends) {
    blend.fragment_i = place[static_cast<std::size_t>(blend.fragment_i)];
    blend.fragment_j = place[static_cast<std::size_t>(blend.fragment_j)];
    if (blend.effort && blend.fragment_i >= 0 && blend.fragment_j >= 0)
      rated.blends.push_back(blend);
  }
  read.corpus = std::move(rated);
}

/// Names the rows that are still blank; they are an error unless they may be left out.
void mind_blank_rows(const TrainVerb& verb, LabelledCorpus& read) {
  const auto blank = effort::blank_rows(read.table);
  if (blank.empty()) return;
  for (const std::string& row : blank) fmt::print(stderr, "{}: {}\n", verb.labels, row);
  if (!verb.skip_blank) {
    throw Error(ErrorKind::kData,
                fmt::format("{}: {} of {} rows are still blank (named above); fill in flow, weight "
                            "and time, or leave them out with --skip-blank",
                            verb.labels, blank.size(), read.table.rows.size()));
  }
  remove_blank(read);
}

transfer::TrainOptions options_of(const TrainVerb& verb) {
  transfer::TrainOptions options;
  options.metric_kind =
      verb.metric == "raw" ? align::MetricKind::kRaw : align::MetricKind::kContent;
  options.content_map.components = verb.components;
  options.learning.folds = verb.folds;
  options.learning.seed = verb.common.seed;
  options.learning.symmetric = !verb.ordered;
  options.threads = verb.common.threads;
  if (!verb.regressor.empty()) options.regressor = effort::regressor_named(verb.regressor);
  return options;
}

/// Blends that differ in more than their labels.
std::size_t count_blends(const std::vector<transfer::CorpusBlend>& blends) {
  std::set<std::string> names;
  for (const transfer::CorpusBlend& blend : blends) names.insert(blend.name);
  return names.size();
}

void print(const TrainVerb& verb, const transfer::StyleModel& model, const LabelledCorpus& read) {
  const std::size_t blend_count = count_blends(read.corpus.blends);
  const auto& fits = model.regressor.fits();
  if (verb.common.json) {
    Json json = {{"schema", "laban.train/1"},
                 {"model", verb.output},
                 {"fragments", model.fragments.size()},
                 {"blends", blend_count},
                 {"labels", read.corpus.blends.size()},
                 {"raters", read.raters},
                 {"contents", model.contents.names},
                 {"frame_rate_hz", model.frame_rate_hz()},
                 {"regressor", effort::name_of(model.regressor.kind())}};
    for (const effort::Factor factor : model.factors()) {
      const auto& fit = fits[static_cast<std::size_t>(effort::index_of(factor))];
      json["factors"][std::string(effort::name_of(factor))] = {
          {"held_out_squared_error", fit.held_out_squared_error},
          {"relative_width", fit.relative_width},
          {"loss_weight", fit.loss_weight},
          {"epsilon", fit.epsilon}};
    }
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: {} fragments of {} contents at {:g} Hz, {} blends\n", verb.output,
             model.fragments.size(), model.contents.names.size(), model.frame_rate_hz(),
             blend_count);
  if (read.raters["observers"].size() > 1) {
    fmt::print(
        "labels: {} of {} observers{}\n",
        verb.reading.each_rater ? fmt::format("all {}", read.corpus.blends.size()) : "the mean",
        read.raters["observers"].size(), verb.reading.each_rater ? "" : ", weighted by confidence");
  }
  fmt::print("regressor {}; squared error in {}-fold cross-validation:",
             effort::name_of(model.regressor.kind()), verb.folds);
  for (const effort::Factor factor : model.factors()) {
    fmt::print(" {} {:.3f}", effort::name_of(factor),
               fits[static_cast<std::size_t>(effort::index_of(factor))].held_out_squared_error);
  }
  fmt::print("\n");
  for (std::size_t n = 0; n < model.fragments.size(); ++n) {
    if (model.content_margins[n] >= 0.0) continue;
    fmt::print("'{}' looks less like others of '{}' than like another content; is it that?\n",
               model.fragments[n].name, model.fragments[n].content);
  }
}

void run(const TrainVerb& verb) {
  check_outputs(verb.common, {verb.output});
  LabelledCorpus read = read_corpus(verb.labels, verb.reading, verb.common);
  mind_blank_rows(verb, read);
  transfer::TrainOptions options = options_of(verb);
  options.record_json =
      run_record("train",
                 {{"seed", verb.common.seed},
                  {"metric", verb.metric},
                  {"regressor", verb.regressor.empty() ? "default" : verb.regressor},
                  {"symmetric", options.learning.symmetric},
                  {"components", verb.components},
                  {"folds", verb.folds},
                  {"skip_blank", verb.skip_blank},
                  {"raters", read.raters}},
                 read.records)
          .dump();
  const transfer::StyleModel model = transfer::train_style_model(read.corpus, options);
  write_bytes(verb.output, transfer::write_style_model(model), verb.common);
  print(verb, model, read);
}

}  // namespace

void add_train(CLI::App& app) {
  auto verb = std::make_shared<TrainVerb>();
  CLI::App* sub = add_verb(app, "train", "Learn a style model from labelled fragments and blends",
                           "laban train --labels labels/phrase.csv -o phrase.laban");
  sub->add_option("--labels", verb->labels, "label table (CSV)")->required();
  sub->add_option("--clips", verb->reading.clips, "folder of the clips (default: the table's own)");
  sub->add_option("-o,--output", verb->output, "model file to write (.laban)")->required();
  sub->add_option("--regressor", verb->regressor,
                  "default: residual-kernel-ridge or kernel-ridge, the better")
      ->check(CLI::IsMember({"linear-interpolation", "linear-ridge", "kernel-ridge", "svr",
                             "residual-kernel-ridge"}));
  sub->add_option("--metric", verb->metric, "content distance")
      ->check(CLI::IsMember({"content", "raw"}))
      ->capture_default_str();
  sub->add_option("--components", verb->components, "principal components of content")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  sub->add_option("--folds", verb->folds, "folds of the cross-validation")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  sub->add_flag("--ordered", verb->ordered, "a blend counts in one order only, as in the paper");
  sub->add_flag("--skip-blank", verb->skip_blank, "leave out rows that are still blank");
  add_rater_options(sub, verb->reading);
  add_common(sub, verb->common, {.writes = true, .threads = true, .seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
