#include "state_reader.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "laban/base/error.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;

Json or_null(const std::string& text) {
  return text.empty() ? Json() : Json(text);
}

template <typename Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json();
}

}  // namespace

ObjectReader::ObjectReader(const Json& json, std::string where)
    : json_(json), where_(std::move(where)) {
  if (!json.is_object()) fail("is no JSON object");
}

const Json& ObjectReader::at(const std::string& key) {
  known_.insert(key);
  const auto found = json_.find(key);
  if (found == json_.end()) fail("has no '" + key + "'");
  return *found;
}

const Json* ObjectReader::find(const std::string& key) {
  known_.insert(key);
  const auto found = json_.find(key);
  return found == json_.end() || found->is_null() ? nullptr : &*found;
}

std::string ObjectReader::text(const std::string& key) {
  const Json& value = at(key);
  if (!value.is_string()) fail_at(key, "is no text");
  return value.get<std::string>();
}

std::string ObjectReader::text_of(const std::string& key, const std::vector<std::string>& texts) {
  std::string found = text(key);
  if (std::find(texts.begin(), texts.end(), found) == texts.end())
    fail_at(key, fmt::format("is none of {}", fmt::join(texts, ", ")));
  return found;
}

bool ObjectReader::flag(const std::string& key) {
  const Json& value = at(key);
  if (!value.is_boolean()) fail_at(key, "is neither true nor false");
  return value.get<bool>();
}

double ObjectReader::number(const std::string& key) {
  return number_in(at(key), key);
}

double ObjectReader::number(const std::string& key, double least, double most) {
  const double value = number(key);
  if (!(value >= least && value <= most))
    fail_at(key, fmt::format("must be from {:g} to {:g}", least, most));
  return value;
}

int ObjectReader::count(const std::string& key) {
  const double value = number(key);
  if (value != std::floor(value) || std::abs(value) > 1e6) fail_at(key, "is no whole number");
  return static_cast<int>(value);
}

int ObjectReader::count(const std::string& key, int least, int most) {
  const int value = count(key);
  if (value < least || value > most)
    fail_at(key, fmt::format("must be from {} to {}", least, most));
  return value;
}

double ObjectReader::number_in(const Json& value, const std::string& key) const {
  if (!value.is_number()) fail_at(key, "is no number");
  return value.get<double>();
}

void ObjectReader::require_schema(const std::string& schema, const std::string& room) {
  if (const Json* found = find("schema"); found == nullptr || *found != schema)
    fail(fmt::format("is no state of {}: its schema is not {}", room, schema));
}

void ObjectReader::require_no_more() const {
  for (const auto& item : json_.items())
    if (!known_.contains(item.key())) fail("has '" + item.key() + "', which nothing reads");
}

void ObjectReader::fail(const std::string& what) const {
  throw Error(ErrorKind::kFormat, where_ + " " + what);
}

void ObjectReader::fail_at(const std::string& key, const std::string& what) const {
  throw Error(ErrorKind::kFormat, where_ + ": '" + key + "' " + what);
}

void add_state_option(CLI::App* verb, std::string& path, const std::string& room,
                      const std::vector<CLI::Option*>& others) {
  const std::vector<CLI::Option*> all = verb->get_options();
  CLI::Option* state = verb->add_option(
      "--state", path,
      "instead of what is to be made, and of the input if that is left out: what the studio's " +
          room + " was set to, a JSON file that it saved");
  for (CLI::Option* option : all)
    if (std::find(others.begin(), others.end(), option) == others.end()) state->excludes(option);
}

Json parse_state(std::string_view text, const std::string& name) {
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) throw Error(ErrorKind::kFormat, name + ": it is no JSON");
  return json;
}

Json to_json(const ReadClipOptions& reading) {
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

}  // namespace laban::cli
