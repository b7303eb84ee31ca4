#include "asked.h"

#include <charconv>
#include <cmath>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/base/sha256.h"

#include "number_checks.h"
#include "report.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

/// Reads the value of --flow, --weight, --time or --space: a number, with '+' before it a change.
/// @returns true if it is a change.
bool read_factor(effort::Factor factor, const std::string& text, bool relative,
                 transfer::EffortTarget& target) {
  const bool plus = text.starts_with('+');
  const std::string option = fmt::format("--{} {}", effort::name_of(factor), text);
  const char* const end = text.data() + text.size();
  double value = 0.0;
  const auto [stop, failed] = std::from_chars(text.data() + (plus ? 1 : 0), end, value);
  if (failed != std::errc() || stop != end || !std::isfinite(value)) {
    throw Error(ErrorKind::kUsage, option +
                                       ": no number; a plain number is the Effort asked for, "
                                       "one after '+' a change of the input's, as +1 or +-1");
  }
  const bool change = plus || relative;
  const double most = change ? transfer::kMostEffortChange : effort::kEffortMax;
  if (std::abs(value) > most) {
    throw Error(ErrorKind::kUsage, fmt::format("{}: {} must be in [-{}, {}]", option,
                                               change ? "a change" : "an Effort", most, most));
  }
  target.factors[static_cast<std::size_t>(effort::index_of(factor))] = value;
  return change;
}

}  // namespace

void add_asked_options(CLI::App* verb, AskedOptions& options) {
  const std::string group = "Target Effort";
  const std::string relative =
      "; with a '+' a change of what the input measures: +1 more, +-1 less";
  const std::string poles[] = {"-3 Free .. +3 Bound; left out: free to vary" + relative,
                               "-3 Light .. +3 Strong", "-3 Sustained .. +3 Sudden",
                               "-3 Indirect .. +3 Direct; of a model trained on labels of Space"};
  CLI::Option* curve = verb->add_option("--effort-curve", options.curve,
                                        "instead: a CSV file seconds,flow,weight,time,space; each "
                                        "snippet takes its mean over its frames");
  for (const effort::Factor factor : effort::kFactorsWithSpace) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    verb->add_option("--" + std::string(effort::name_of(factor)), options.factors[f], poles[f])
        ->type_name("EFFORT")
        ->excludes(curve)
        ->group(group);
  }
  curve->group(group);
  verb->add_flag("--relative", options.relative,
                 "all that is asked for is a change of what the input measures")
      ->group(group);
  verb->add_option("--weights", options.weights,
                   "importance of flow, weight, time and space in the search (default 1,1,1,1)")
      ->delimiter(',')
      ->expected(3, 4)
      ->check(positive_number())
      ->type_name("F,W,T[,S]")
      ->group(group);
}

transfer::AskedEffort read_asked(const AskedOptions& options, bool may_ask_nothing,
                                 std::vector<InputRecord>& inputs) {
  transfer::AskedEffort asked;
  asked.may_ask_nothing = may_ask_nothing;
  for (const effort::Factor factor : effort::kFactorsWithSpace) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    asked.relative[f] = options.relative;
    if (options.factors[f].empty()) continue;
    asked.relative[f] = read_factor(factor, options.factors[f], options.relative, asked.target);
  }
  for (std::size_t f = 0; f < options.weights.size(); ++f)
    asked.target.weights[f] = options.weights[f];
  if (!options.curve.empty()) {
    const std::string text = read_bytes(options.curve);
    asked.curve = transfer::parse_target_curve(
        text, options.curve, options.relative ? transfer::kMostEffortChange : effort::kEffortMax);
    inputs.push_back({options.curve, base::sha256_hex(text)});
  }
  if (const auto problems = asked.problems(); !problems.empty())
    throw Error(ErrorKind::kUsage, problems.front());
  return asked;
}

std::string to_text(const AskedOptions& options, const transfer::AskedEffort& asked) {
  if (asked.curve) {
    return (options.relative ? "the changes of " : "the Effort of ") + options.curve;
  }
  std::string text;
  for (const effort::Factor factor : effort::kFactorsWithSpace) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    const auto& value = asked.target.factors[f];
    if (!value && factor == effort::Factor::kSpace) continue;
    text += fmt::format("{}{} {}", text.empty() ? "" : "  ", effort::name_of(factor),
                        value ? fmt::format("{:+.2f}", *value) : "free");
    if (value && asked.relative[f]) text += " from the input's";
  }
  return text;
}

Json to_json(const AskedOptions& options, const transfer::AskedEffort& asked) {
  Json json = {{"target", to_json(asked.target)}};
  for (const effort::Factor factor : effort::kFactorsWithSpace) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    json["relative"][std::string(effort::name_of(factor))] = asked.relative[f];
  }
  json["weights"] = asked.target.weights;
  json["effort_curve"] = options.curve.empty() ? Json() : Json(options.curve);
  return json;
}

}  // namespace laban::cli
