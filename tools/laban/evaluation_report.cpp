#include "evaluation_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "laban/base/csv.h"

namespace laban::cli {
namespace {

using effort::EvaluationReport;
using effort::EvaluationRun;
using effort::FactorReport;
using effort::ModelScore;
using effort::PairedDifference;
using effort::RegressorKind;

/// Empty for what cannot be told.
std::string field(double value) {
  return std::isfinite(value) ? base::format_number(value) : "";
}

Json json_of(const effort::Estimate& value) {
  return {{"mean", finite_or_null(value.mean)},
          {"standard_error", finite_or_null(value.standard_error)},
          {"corrected_standard_error", finite_or_null(value.corrected_standard_error)},
          {"degrees_of_freedom", value.degrees_of_freedom},
          {"low", finite_or_null(value.low)},
          {"high", finite_or_null(value.high)}};
}

Json json_of(const PairedDifference& paired) {
  return {{"model", effort::name_of(paired.model)},
          {"against", effort::name_of(paired.against)},
          {"difference", json_of(paired.difference)},
          {"verdict", effort::name_of(paired.difference.verdict())}};
}

Json json_of(const FactorReport& factor) {
  Json json = {{"label_variance", factor.label_variance}, {"models", Json::object()}};
  for (const ModelScore& score : factor.models) {
    json["models"][std::string(effort::name_of(score.kind))] = {
        {"mean_squared_error", json_of(score.error)},
        {"ratio_to_linear_interpolation", finite_or_null(score.ratio_to_interpolation)},
        {"paper", score.paper ? Json(*score.paper) : Json()}};
  }
  json["differences"] = Json::array();
  for (const PairedDifference& paired : factor.differences)
    json["differences"].push_back(json_of(paired));
  if (const auto& best = factor.fifth_against_best) {
    json["fifth_against_best"] = {{"against", effort::name_of(best->against)},
                                  {"difference", json_of(best->difference)}};
  }
  if (const auto standing = factor.fifth_standing()) {
    json["fifth_standing"] = {{"below_linear_interpolation", standing->below_interpolation},
                              {"could_be_below_linear_interpolation", standing->could_be_below},
                              {"not_above_the_others", standing->not_above_others}};
  }
  return json;
}

Json json_of(const EvaluationRun& run) {
  return {{"held_out", run.held_out}, {"train", run.train}, {"test", run.test}};
}

/// "85" or "83 to 90".
template <typename SizeOf>
std::string size_range(const EvaluationReport& report, const SizeOf& size_of) {
  int least = size_of(report.run_list.front()), most = least;
  for (const EvaluationRun& run : report.run_list) {
    least = std::min(least, size_of(run));
    most = std::max(most, size_of(run));
  }
  return least == most ? fmt::format("{}", least) : fmt::format("{} to {}", least, most);
}

std::string sizes_text(const EvaluationReport& report) {
  return fmt::format("{} runs, trained on {} and tested on {} labels", report.runs,
                     size_range(report, [](const EvaluationRun& run) { return run.train; }),
                     size_range(report, [](const EvaluationRun& run) { return run.test; }));
}

std::string skipped_text(const EvaluationReport& report) {
  std::string text;
  for (const effort::SkippedRun& skipped : report.skipped)
    text += fmt::format("not run without {}: {}\n",
                        skipped.run.held_out.empty() ? "(no name)" : skipped.run.held_out,
                        skipped.reason);
  return text;
}

std::string scores_text(const FactorReport& factor) {
  std::string text = fmt::format("{:<8}label variance {:.3f}\n", effort::name_of(factor.factor),
                                 factor.label_variance);
  for (const ModelScore& score : factor.models) {
    text += fmt::format("{:<8}{:<24}{:>8.4f}{:>9.4f}{:>11.4f}{:>8.3f}{:>8}\n", "",
                        effort::name_of(score.kind), score.error.mean, score.error.standard_error,
                        score.error.corrected_standard_error, score.ratio_to_interpolation,
                        score.paper ? fmt::format("{:.2f}", *score.paper) : "-");
  }
  return text;
}

std::string differences_text(const FactorReport& factor) {
  std::string text;
  for (const PairedDifference& paired : factor.differences) {
    text += fmt::format(
        "{:<8}{:<46}{:>+9.4f}  [{:+.4f}, {:+.4f}]  {}\n",
        text.empty() ? effort::name_of(factor.factor) : "",
        fmt::format("{} - {}", effort::name_of(paired.model), effort::name_of(paired.against)),
        paired.difference.mean, paired.difference.low, paired.difference.high,
        effort::name_of(paired.difference.verdict()));
  }
  return text;
}

/// Models of which the fifth's interval is above.
std::string models_below_fifth(const FactorReport& factor) {
  std::string names;
  for (const PairedDifference& paired : factor.differences) {
    if (paired.model != RegressorKind::kResidualKernelRidge ||
        paired.difference.verdict() != effort::Verdict::kAbove)
      continue;
    names += (names.empty() ? "" : ", ") + std::string(effort::name_of(paired.against));
  }
  return names;
}

std::string standing_text(const FactorReport& factor) {
  const auto standing = factor.fifth_standing();
  if (!standing) return {};
  const bool untold = !standing->below_interpolation && !standing->could_be_below;
  return fmt::format("{:<8}{} is {} linear interpolation{} and {}\n",
                     effort::name_of(factor.factor),
                     effort::name_of(RegressorKind::kResidualKernelRidge),
                     standing->below_interpolation ? "below" : "NOT below",
                     untold ? " (too few to tell: nor would a model without error be)" : "",
                     standing->not_above_others ? "not above any of the others"
                                                : "ABOVE " + models_below_fifth(factor));
}

std::string notes_text(const EvaluationReport& report) {
  const int degrees = report.factors.front().models.front().error.degrees_of_freedom;
  const char* errors =
      report.blends
          ? "each tested blend counts once; s.e.: of the blends, as if they were independent;\n"
            "corrected: blends share performers or contents (Aronow, Samii, Assenova 2015)"
          : "s.e.: over runs; corrected: runs share blends (Nadeau and Bengio 2003)";
  return fmt::format(
      "{}\nintervals: 95 %, corrected s.e. times Student's t of {} degrees of freedom;\n"
      "ratio: to linear interpolation; paper: other labels, for the pattern only\n",
      errors, degrees);
}

}  // namespace

Json to_json(const EvaluationReport& report) {
  Json json = {{"protocol", effort::name_of(report.protocol)},
               {"runs", report.runs},
               {"train", report.train},
               {"test", report.test}};
  if (report.blends) {
    json["tested_blends"] = report.blends->columns.size();
    json["held_out"] = Json::array();
    for (const EvaluationRun& run : report.run_list) json["held_out"].push_back(json_of(run));
  }
  json["skipped"] = Json::array();
  for (const effort::SkippedRun& skipped : report.skipped) {
    Json entry = json_of(skipped.run);
    entry["reason"] = skipped.reason;
    json["skipped"].push_back(entry);
  }
  for (const FactorReport& factor : report.factors)
    json["factors"][std::string(effort::name_of(factor.factor))] = json_of(factor);
  return json;
}

std::string to_text(const EvaluationReport& report) {
  std::string text =
      fmt::format("mean squared error, {}: {}\n{}",
                  report.protocol == effort::Protocol::kRandom ? "random splits"
                                                               : effort::name_of(report.protocol),
                  sizes_text(report), skipped_text(report));
  text += fmt::format("{:<8}{:<24}{:>8}{:>9}{:>11}{:>8}{:>8}\n", "", "", "mean", "s.e.",
                      "corrected", "ratio", "paper");
  std::string differences, standings;
  for (const FactorReport& factor : report.factors) {
    text += scores_text(factor);
    differences += differences_text(factor);
    standings += standing_text(factor);
  }
  if (!differences.empty()) text += "\npaired differences of mean squared error\n" + differences;
  if (!standings.empty()) text += "\n" + standings;
  return text + "\n" + notes_text(report);
}

std::string table_csv(const EvaluationReport& report) {
  std::string text = base::format_csv_row({"factor", "model", "mean_squared_error",
                                           "standard_error", "ratio_to_linear_interpolation",
                                           "label_variance", "paper", "corrected_standard_error",
                                           "minus_linear_interpolation", "low", "high", "verdict"});
  for (const FactorReport& factor : report.factors) {
    for (const ModelScore& score : factor.models) {
      std::vector<std::string> row = {std::string(effort::name_of(factor.factor)),
                                      std::string(effort::name_of(score.kind)),
                                      field(score.error.mean),
                                      field(score.error.standard_error),
                                      field(score.ratio_to_interpolation),
                                      field(factor.label_variance),
                                      score.paper ? field(*score.paper) : "",
                                      field(score.error.corrected_standard_error)};
      const auto paired = std::find_if(
          factor.differences.begin(), factor.differences.end(), [&](const PairedDifference& one) {
            return one.model == score.kind && one.against == RegressorKind::kLinearInterpolation;
          });
      if (paired == factor.differences.end()) {
        row.insert(row.end(), 4, "");
      } else {
        const effort::Estimate& difference = paired->difference;
        row.insert(row.end(),
                   {field(difference.mean), field(difference.low), field(difference.high),
                    std::string(effort::name_of(difference.verdict()))});
      }
      text += base::format_csv_row(row);
    }
  }
  return text;
}

std::string runs_csv(const EvaluationReport& report) {
  std::string text = base::format_csv_row(
      {"run", "held_out", "train", "test", "factor", "model", "mean_squared_error"});
  for (int run = 0; run < report.runs; ++run) {
    const EvaluationRun& made = report.run_list[static_cast<std::size_t>(run)];
    for (std::size_t f = 0; f < report.factors.size(); ++f) {
      const FactorReport& factor = report.factors[f];
      for (std::size_t m = 0; m < factor.models.size(); ++m) {
        text += base::format_csv_row(
            {fmt::format("{}", run + 1), made.held_out, fmt::format("{}", made.train),
             fmt::format("{}", made.test), std::string(effort::name_of(factor.factor)),
             std::string(effort::name_of(factor.models[m].kind)),
             field(report.run_errors[f](run, static_cast<Eigen::Index>(m)))});
      }
    }
  }
  return text;
}

draw::BarChart table_chart(const EvaluationReport& report) {
  draw::BarChart chart;
  chart.title =
      fmt::format("Mean squared error of predicted Effort, {}, {} runs",
                  report.protocol == effort::Protocol::kRandom ? "random splits"
                                                               : effort::name_of(report.protocol),
                  report.runs);
  chart.y.label = "mean squared error, with its corrected standard error";
  chart.y.min = 0.0;
  chart.reference_name = "paper (other labels)";
  for (std::size_t m = 0; m < report.factors.front().models.size(); ++m) {
    std::string name(effort::name_of(report.factors.front().models[m].kind));
    std::replace(name.begin(), name.end(), '-', ' ');
    draw::BarSeries series{name, {}, {}, {}};
    for (const FactorReport& factor : report.factors) {
      const ModelScore& score = factor.models[m];
      series.values.push_back(score.error.mean);
      series.errors.push_back(score.error.corrected_standard_error);
      series.references.push_back(score.paper.value_or(std::nan("")));
    }
    chart.series.push_back(std::move(series));
  }
  for (const FactorReport& factor : report.factors)
    chart.groups.emplace_back(effort::name_of(factor.factor));
  return chart;
}

}  // namespace laban::cli
