#include <fmt/core.h>

#include "laban/base/sha256.h"
#include "laban/effort/agreement.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {
namespace {

using effort::AgreementReport;
using effort::Interval;

struct AgreeVerb {
  Common common;
  std::string labels;
  effort::AgreementOptions options;
};

Json json_of(const std::optional<double>& value) {
  return value ? Json(*value) : Json();
}

Json json_of(const std::optional<Interval>& interval) {
  return interval ? Json{interval->low, interval->high} : Json();
}

Json json_of(const effort::IntraclassCorrelation& icc) {
  return {{"value", json_of(icc.value)},
          {"interval", json_of(icc.interval)},
          {"units", icc.units},
          {"dropped", icc.dropped}};
}

Json json_of(const AgreeVerb& verb, const AgreementReport& report, const InputRecord& table) {
  Json json = {{"schema", "laban.agree/1"},
               {"raters", report.raters},
               {"fragments", report.fragments},
               {"factors", Json::object()},
               {"repeats", Json::array()}};
  for (const effort::FactorAgreement& factor : report.factors) {
    json["factors"][factor.factor] = {{"units", factor.alpha.units},
                                      {"values", factor.alpha.values},
                                      {"alpha",
                                       {{"value", json_of(factor.alpha.alpha)},
                                        {"interval", json_of(factor.alpha.interval)},
                                        {"resamples", factor.alpha.resamples}}},
                                      {"icc_2_1", json_of(factor.icc)}};
  }
  for (const effort::RepeatAgreement& repeat : report.repeats) {
    json["repeats"].push_back({{"rater", repeat.rater},
                               {"factor", repeat.factor},
                               {"units", repeat.units},
                               {"values", repeat.values},
                               {"mean_absolute_difference", repeat.mean_absolute_difference},
                               {"icc_1_1", json_of(repeat.icc)}});
  }
  json["run"] = run_record("agree",
                           {{"bootstrap", verb.options.bootstrap.resamples},
                            {"seed", verb.options.bootstrap.seed},
                            {"level", verb.options.bootstrap.level},
                            {"raters", verb.options.raters}},
                           {table});
  return json;
}

std::string shown(const std::optional<double>& value) {
  return value ? fmt::format("{:.3f}", *value) : "-";
}

std::string shown(const std::optional<Interval>& interval) {
  return interval ? fmt::format("[{:.3f}, {:.3f}]", interval->low, interval->high) : "-";
}

void print(const AgreementReport& report) {
  std::string names;
  for (const std::string& name : report.raters) names += (names.empty() ? "" : ", ") + name;
  fmt::print("{} {}: {}; {} fragments and blends\n", report.raters.size(),
             report.raters.size() == 1 ? "rater" : "raters", names, report.fragments);
  if (!report.factors.empty()) {
    fmt::print("{:<8}{:>6}{:>8}{:>8} {:<18}{:>9} {:<18}{:>6}{:>9}\n", "between", "units", "values",
               "alpha", "95 %", "ICC(2,1)", "95 %", "units", "dropped");
  }
  for (const effort::FactorAgreement& factor : report.factors) {
    fmt::print("{:<8}{:>6}{:>8}{:>8} {:<18}{:>9} {:<18}{:>6}{:>9}\n", factor.factor,
               factor.alpha.units, factor.alpha.values, shown(factor.alpha.alpha),
               shown(factor.alpha.interval), shown(factor.icc.value), shown(factor.icc.interval),
               factor.icc.units, factor.icc.dropped);
  }
  if (!report.repeats.empty()) {
    fmt::print("{:<8}{:>6}{:>8}{:>14}{:>9} {:<18} {}\n", "within", "units", "values",
               "|difference|", "ICC(1,1)", "95 %", "rater");
  }
  for (const effort::RepeatAgreement& repeat : report.repeats) {
    fmt::print("{:<8}{:>6}{:>8}{:>14.3f}{:>9} {:<18} {}\n", repeat.factor, repeat.units,
               repeat.values, repeat.mean_absolute_difference, shown(repeat.icc.value),
               shown(repeat.icc.interval), repeat.rater);
  }
}

void run(AgreeVerb& verb) {
  const std::string text = read_bytes(verb.labels);
  const effort::LabelTable table = effort::parse_label_table(text, verb.labels);
  verb.options.bootstrap.seed = verb.common.seed;
  const AgreementReport report =
      naming(verb.labels, [&] { return effort::rater_agreement(table, verb.options); });
  if (verb.common.json) {
    fmt::print("{}\n", json_of(verb, report, {verb.labels, base::sha256_hex(text)}).dump(2));
  } else {
    print(report);
  }
}

}  // namespace

void add_agree(CLI::App& app) {
  auto verb = std::make_shared<AgreeVerb>();
  CLI::App* sub = add_verb(app, "agree", "Measure how far the observers of a label table agree",
                           "laban agree --labels ratings.csv");
  sub->add_option("--labels", verb->labels, "label table (CSV)")->required();
  sub->add_option("--raters", verb->options.raters,
                  "observers to compare, comma-separated (default: all who are people)")
      ->delimiter(',');
  sub->add_option("--bootstrap", verb->options.bootstrap.resamples,
                  "resamples of the interval of Krippendorff's alpha")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  add_common(sub, verb->common, {.seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
