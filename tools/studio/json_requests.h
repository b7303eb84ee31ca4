#pragma once

#include <functional>
#include <string>

#include <nlohmann/json.hpp>

#include "http.h"

namespace laban::studio {

using Json = nlohmann::ordered_json;

[[nodiscard]] Response json_response(const Json& json);

/// The body, a JSON object. @throws HttpError{400} if it is none.
[[nodiscard]] Json parsed_body(const Request& request);

/// @throws HttpError{400} if the address has no such key.
[[nodiscard]] std::string query_value(const Request& request, const std::string& key);

/// What stands at a key of a request. @throws HttpError{400} naming the key if it is missing, or of
/// another type.
[[nodiscard]] const Json& at(const Json& request, const char* key);
[[nodiscard]] std::string text_at(const Json& request, const char* key);
/// A whole number in [0, count). @throws as at; HttpError{400} if it is beyond.
[[nodiscard]] int index_at(const Json& request, const char* key, int count);

/// A route from the JSON of the body to that of the answer.
[[nodiscard]] Handler json_route(std::function<Json(const Json&)> answer);

/// A route that only reads the "state" of the body, and refuses what the room's verb would.
/// @param read  of the state and its name in messages.
template <typename Read>
[[nodiscard]] Handler state_route(Read read) {
  return json_route([read](const Json& request) {
    static_cast<void>(read(at(request, "state"), "the state"));
    return Json::object();
  });
}

}  // namespace laban::studio
