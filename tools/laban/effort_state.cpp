#include "effort_state.h"

#include <cmath>
#include <set>

#include <fmt/core.h>

#include "laban/base/error.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

constexpr const char* kSchema = "laban.effort-room/1";

/// Reads an object key by key, and knows which keys nobody asked for.
class ObjectReader {
 public:
  /// @param where  in front of messages: "room.json", "room.json: 'asked'".
  ObjectReader(const Json& json, std::string where) : json_(json), where_(std::move(where)) {
    if (!json.is_object()) fail("is no JSON object");
  }

  [[nodiscard]] const Json& at(const std::string& key) {
    known_.insert(key);
    const auto found = json_.find(key);
    if (found == json_.end()) fail("has no '" + key + "'");
    return *found;
  }
  [[nodiscard]] const Json* find(const std::string& key) {
    known_.insert(key);
    const auto found = json_.find(key);
    return found == json_.end() || found->is_null() ? nullptr : &*found;
  }
  [[nodiscard]] std::string text(const std::string& key) {
    const Json& value = at(key);
    if (!value.is_string()) fail_at(key, "is no text");
    return value.get<std::string>();
  }
  [[nodiscard]] bool flag(const std::string& key) {
    const Json& value = at(key);
    if (!value.is_boolean()) fail_at(key, "is neither true nor false");
    return value.get<bool>();
  }
  [[nodiscard]] double number(const std::string& key) { return number_in(at(key), key); }
  [[nodiscard]] int count(const std::string& key) {
    const double value = number(key);
    if (value != std::floor(value) || std::abs(value) > 1e6) fail_at(key, "is no whole number");
    return static_cast<int>(value);
  }
  [[nodiscard]] double number_in(const Json& value, const std::string& key) const {
    if (!value.is_number()) fail_at(key, "is no number");
    return value.get<double>();
  }

  /// @throws for a key that was not read.
  void require_no_more() const {
    for (const auto& item : json_.items())
      if (!known_.contains(item.key())) fail("has '" + item.key() + "', which nothing reads");
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorKind::kFormat, where_ + " " + what);
  }
  [[noreturn]] void fail_at(const std::string& key, const std::string& what) const {
    throw Error(ErrorKind::kFormat, where_ + ": '" + key + "' " + what);
  }

 private:
  const Json& json_;
  std::string where_;
  std::set<std::string> known_;
};

Json or_null(const std::string& text) {
  return text.empty() ? Json() : Json(text);
}

template <typename Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json();
}

Json reading_json(const ReadClipOptions& reading) {
  return {{"unit", or_null(reading.unit_m)},
          {"fps", or_null(reading.frame_rate_hz)},
          {"input_format", or_null(reading.input_format)},
          {"map", or_null(reading.map)},
          {"input_up", or_null(reading.up_axis)},
          {"skeleton", or_null(reading.skeleton)},
          {"animation", or_null(reading.animation)}};
}

ReadClipOptions read_reading(const Json& json, const std::string& where) {
  ObjectReader reader(json, where + ": 'reading'");
  ReadClipOptions reading;
  const auto text = [&](const std::string& key) {
    return reader.find(key) == nullptr ? std::string() : reader.text(key);
  };
  const auto positive = [&](const std::string& key) -> std::optional<double> {
    if (reader.find(key) == nullptr) return std::nullopt;
    const double value = reader.number(key);
    if (!(value > 0.0)) reader.fail_at(key, "must be above 0");
    return value;
  };
  reading.unit_m = positive("unit");
  reading.frame_rate_hz = positive("fps");
  reading.input_format = text("input_format");
  reading.map = text("map");
  reading.up_axis = text("input_up");
  if (!reading.up_axis.empty() && !up_axis_named(reading.up_axis))
    reader.fail_at("input_up", "is neither x, y nor z");
  reading.skeleton = text("skeleton");
  reading.animation = text("animation");
  reader.require_no_more();
  return reading;
}

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
  Json json = {{"schema", kSchema}, {"input", state.input}, {"model", styling.model}};
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
  json["locks"] = Json::array();
  for (const HandSetBlend& lock : styling.by_hand) {
    json["locks"].push_back({{"snippet", lock.snippet},
                             {"fragments", {lock.fragment_i, lock.fragment_j}},
                             {"alpha", lock.alpha}});
  }
  json["reading"] = reading_json(styling.reading);
  return json;
}

EffortState read_effort_state(const Json& json, const std::string& name) {
  ObjectReader reader(json, name);
  if (const Json* schema = reader.find("schema"); schema == nullptr || *schema != kSchema)
    reader.fail(fmt::format("is no state of the Effort room: its schema is not {}", kSchema));
  EffortState state;
  StylingOptions& styling = state.styling;
  transfer::ApplyOptions& apply = styling.apply;
  state.input = reader.text("input");
  styling.model = reader.text("model");
  styling.asked = read_asked_of(reader, name);
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
  styling.by_hand = read_locks(reader, reader.at("locks"), name);
  styling.reading = read_reading(reader.at("reading"), name);
  reader.require_no_more();
  if (const auto problems = apply.problems(); !problems.empty())
    throw Error(ErrorKind::kFormat, name + ": " + problems.front());
  return state;
}

EffortState parse_effort_state(std::string_view text, const std::string& name) {
  const Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) throw Error(ErrorKind::kFormat, name + ": it is no JSON");
  return read_effort_state(json, name);
}

}  // namespace laban::cli
