#include "effort_state.h"

#include <fmt/core.h>

#include "laban/base/error.h"

#include "state_reader.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

constexpr const char* kEffortSchema = "laban.effort-room/1";

AskedOptions read_asked_of(ObjectReader& state, const std::string& where) {
  AskedOptions asked;
  ObjectReader factors(state.at("asked"), where + ": 'asked'");
  for (const effort::Factor factor : effort::kFactorsWithSpace) {
    const std::string key(effort::name_of(factor));
    if (const Json* value = factors.find(key)) {
      asked.factors[static_cast<std::size_t>(effort::index_of(factor))] =
          fmt::format("{}", factors.number_in(*value, key));
    }
  }
  factors.require_no_more();
  asked.relative = state.flag("relative");
  const Json& weights = state.at("weights");
  if (!weights.is_array() || weights.size() > effort::kMaxFactorCount)
    state.fail_at("weights", "is no list of up to four numbers");
  for (const Json& weight : weights) {
    asked.weights.push_back(state.number_in(weight, "weights"));
    if (!(asked.weights.back() > 0.0)) state.fail_at("weights", "must be above 0");
  }
  return asked;
}

std::vector<HandSetBlend> read_locks(const ObjectReader& state, const Json& json,
                                     const std::string& where) {
  if (!json.is_array()) state.fail_at("locks", "is no list");
  std::vector<HandSetBlend> locks;
  for (const Json& one : json) {
    ObjectReader reader(one, where + ": a lock");
    HandSetBlend lock;
    lock.snippet = reader.count("snippet");
    lock.alpha = reader.number("alpha");
    const Json& names = reader.at("fragments");
    if (!names.is_array() || names.size() != 2 || !names[0].is_string() || !names[1].is_string())
      reader.fail_at("fragments", "is no list of two names");
    lock.fragment_i = names[0].get<std::string>();
    lock.fragment_j = names[1].get<std::string>();
    reader.require_no_more();
    locks.push_back(std::move(lock));
  }
  return locks;
}

}  // namespace

Json to_json(const EffortState& state) {
  const StylingOptions& styling = state.styling;
  const transfer::ApplyOptions& apply = styling.apply;
  Json json = {{"schema", kEffortSchema}, {"input", state.input}, {"model", styling.model}};
  for (const effort::Factor factor : effort::kFactorsWithSpace) {
    const std::string& text =
        styling.asked.factors[static_cast<std::size_t>(effort::index_of(factor))];
    json["asked"][std::string(effort::name_of(factor))] =
        text.empty() ? Json() : Json(std::stod(text));
  }
  json["relative"] = styling.asked.relative;
  json["weights"] = styling.asked.weights;
  json["detail"] = transfer::name_of(apply.detail);
  json["strength"] = apply.strength;
  json["keep_timing"] = apply.keep_timing;
  json["strict"] = apply.strict;
  json["foot_fix"] = !styling.no_foot_fix;
  json["neighbours"] = apply.search.neighbors;
  json["samples"] = apply.search.samples;
  json["caution"] = apply.search.caution;
  json["stay"] = apply.search.stay;
  json["way"] = apply.search.way;
  json["tries"] = apply.tries;
  json["rounds"] = apply.rounds;
  json["locks"] = Json::array();
  for (const HandSetBlend& lock : styling.by_hand) {
    json["locks"].push_back({{"snippet", lock.snippet},
                             {"fragments", {lock.fragment_i, lock.fragment_j}},
                             {"alpha", lock.alpha}});
  }
  json["reading"] = to_json(styling.reading);
  return json;
}

EffortState read_effort_state(const Json& json, const std::string& name) {
  ObjectReader reader(json, name);
  reader.require_schema(kEffortSchema, "the Effort room");
  EffortState state;
  StylingOptions& styling = state.styling;
  transfer::ApplyOptions& apply = styling.apply;
  state.input = reader.text("input");
  styling.model = reader.text("model");
  styling.asked = read_asked_of(reader, name);
  styling.may_ask_nothing = true;  // the room begins with all factors free
  const std::string detail = reader.text("detail");
  if (detail != "replace" && detail != "residual")
    reader.fail_at("detail", "is neither replace nor residual");
  apply.detail = detail == "residual" ? transfer::Detail::kResidual : transfer::Detail::kReplace;
  apply.strength = reader.number("strength");
  apply.keep_timing = reader.flag("keep_timing");
  apply.strict = reader.flag("strict");
  styling.no_foot_fix = !reader.flag("foot_fix");
  apply.search.neighbors = reader.count("neighbours");
  apply.search.samples = reader.count("samples");
  apply.search.caution = reader.number("caution");
  apply.search.stay = reader.number("stay");
  apply.search.way = reader.count("way");
  apply.tries = reader.count("tries");
  // A state older than rounds showed what comes of none.
  apply.rounds = reader.find("rounds") != nullptr ? reader.count("rounds") : 0;
  styling.by_hand = read_locks(reader, reader.at("locks"), name);
  styling.reading = read_reading(reader.at("reading"), name);
  reader.require_no_more();
  if (const auto problems = apply.problems(); !problems.empty())
    throw Error(ErrorKind::kFormat, name + ": " + problems.front());
  return state;
}

EffortState parse_effort_state(std::string_view text, const std::string& name) {
  return read_effort_state(parse_state(text, name), name);
}

}  // namespace laban::cli
