#include "json_requests.h"

namespace laban::studio {

Response json_response(const Json& json) {
  return {200, "application/json", json.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

Json parsed_body(const Request& request) {
  Json json = Json::parse(request.body, nullptr, false);
  if (json.is_discarded() || !json.is_object())
    throw HttpError(400, "the request's body is no JSON object");
  return json;
}

std::string query_value(const Request& request, const std::string& key) {
  const auto found = request.query.find(key);
  if (found == request.query.end()) throw HttpError(400, "the address has no '" + key + "'");
  return found->second;
}

const Json& at(const Json& request, const char* key) {
  if (!request.is_object() || !request.contains(key))
    throw HttpError(400, std::string("the request has no '") + key + "'");
  return request[key];
}

std::string text_at(const Json& request, const char* key) {
  const Json& value = at(request, key);
  if (!value.is_string()) throw HttpError(400, std::string("'") + key + "' is no text");
  return value.get<std::string>();
}

int index_at(const Json& request, const char* key, int count) {
  const Json& value = at(request, key);
  if (!value.is_number_unsigned() ||
      value.get<std::uint64_t>() >= static_cast<std::uint64_t>(std::max(count, 0))) {
    throw HttpError(400, std::string("there is no such ") + key);
  }
  return value.get<int>();
}

Handler json_route(std::function<Json(const Json&)> answer) {
  return [answer = std::move(answer)](const Request& request) {
    return json_response(answer(parsed_body(request)));
  };
}

}  // namespace laban::studio
