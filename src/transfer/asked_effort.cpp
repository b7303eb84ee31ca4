#include "laban/transfer/asked_effort.h"

#include <algorithm>

namespace laban::transfer {
namespace {

constexpr auto kSpace = static_cast<std::size_t>(effort::Factor::kSpace);

bool asks_for_space(const AskedEffort& asked) {
  if (asked.target.factors[kSpace]) return true;
  return asked.curve &&
         std::any_of(asked.curve->rows.begin(), asked.curve->rows.end(),
                     [](const TargetCurve::Row& row) { return row.factors[kSpace].has_value(); });
}

}  // namespace

EffortTarget AskedEffort::of_snippet(double begin_s, int frames, double frame_rate_hz,
                                     const effort::Effort& before) const {
  EffortTarget asked = target;
  asked.stay_near = before;
  if (curve) asked.factors = curve->mean_over(begin_s, frames, frame_rate_hz);
  for (const effort::Factor factor : effort::kFactors) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    if (!relative[f] || !asked.factors[f]) continue;
    asked.factors[f] =
        std::clamp(before[factor] + *asked.factors[f], effort::kEffortMin, effort::kEffortMax);
  }
  return asked;
}

std::vector<std::string> AskedEffort::problems() const {
  std::vector<std::string> found;
  EffortTarget absolute = target;
  if (relative[kSpace] && asks_for_space(*this)) {
    found.emplace_back(
        "a change of space is asked for, but nobody measures the input's Space; "
        "ask for a value");
  }
  for (const effort::Factor factor : effort::kFactorsWithSpace) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    const auto& value = target.factors[f];
    const std::string name(effort::name_of(factor));
    if (value && curve) found.push_back(name + " is asked for beside an Effort curve");
    if (!value || !relative[f]) continue;
    if (!(*value >= -kMostEffortChange && *value <= kMostEffortChange)) {
      found.push_back("change of " + name + " = " + std::to_string(*value) +
                      " (must be in [-6, 6])");
    }
    absolute.factors[f] = 0.0;
  }
  // The curve asks, or nobody has to.
  if (curve || (may_ask_nothing && absolute.is_free())) absolute.factors[0] = 0.0;
  const std::vector<std::string> rest = absolute.problems();
  found.insert(found.end(), rest.begin(), rest.end());
  return found;
}

}  // namespace laban::transfer
