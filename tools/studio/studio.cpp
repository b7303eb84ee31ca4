#include "studio.h"

#include <charconv>

#include "laban/base/version.h"

#include "access.h"

namespace laban::studio {
namespace {

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

}  // namespace

Studio::Studio(const StudioOptions& options, std::string page, const cli::Common& common)
    : page_(std::move(page)),
      stage_(options.reading, common),
      effort_(stage_, options.model),
      answerers_{{"GET /", &Studio::page},
                 {"GET /api/studio", &Studio::overview},
                 {"POST /api/clips", &Studio::drop},
                 {"POST /api/effort/open", &Studio::effort_open},
                 {"POST /api/effort/style", &Studio::effort_style},
                 {"POST /api/effort/snippet", &Studio::effort_snippet},
                 {"POST /api/effort/over-time", &Studio::effort_over_time},
                 {"POST /api/effort/export", &Studio::effort_export},
                 {"GET /api/label/next", &Studio::label_next},
                 {"GET /api/label/motion", &Studio::label_motion},
                 {"POST /api/label/answer", &Studio::label_answer},
                 {"GET /api/label/agreement", &Studio::label_agreement}} {
  for (const std::string& clip : options.clips) stage_.open(clip);
  if (!options.labelling.table.empty()) label_.emplace(options.labelling, common);
}

Response Studio::handle(const Request& request) {
  const auto found = answerers_.find(request.method + " " + request.path);
  if (found != answerers_.end()) return (this->*found->second)(request);
  if (request.method == "GET" && request.path.starts_with("/api/clips/")) return clip(request);
  throw HttpError(404, "nothing is here");
}

Response Studio::page(const Request& /*request*/) {
  static constexpr std::string_view kMark = "{{nonce}}";
  const std::string nonce = random_hex(16);
  std::string html = page_;
  for (std::size_t at = html.find(kMark); at != std::string::npos; at = html.find(kMark, at))
    html.replace(at, kMark.size(), nonce);
  return {200, "text/html; charset=utf-8", std::move(html), {}, nonce};
}

Response Studio::overview(const Request& /*request*/) {
  return json_response({{"version", base::version()},
                        {"rooms", label_ ? Json{"label"} : Json{"effort", "stage"}},
                        {"clips", stage_.clips_json()}});
}

Response Studio::drop(const Request& request) {
  return json_response(stage_.drop(query_value(request, "name"), request.body));
}

Response Studio::effort_open(const Request& request) {
  return json_response(effort_.open(parsed_body(request).value("clip", "")));
}

Response Studio::effort_style(const Request& request) {
  return effort_.style(parsed_body(request));
}

Response Studio::effort_snippet(const Request& request) {
  return json_response(effort_.snippet(parsed_body(request)));
}

Response Studio::effort_over_time(const Request& request) {
  return json_response(effort_.over_time(parsed_body(request)));
}

Response Studio::effort_export(const Request& request) {
  return effort_.exported(parsed_body(request), query_value(request, "format"));
}

LabelRoom& Studio::labels() {
  if (!label_) throw HttpError(404, "no label table is open; open one with: laban studio --label");
  return *label_;
}

Response Studio::label_next(const Request& /*request*/) {
  return json_response(labels().next());
}

Response Studio::label_motion(const Request& request) {
  const std::string text = query_value(request, "place");
  int place = -1;
  std::from_chars(text.data(), text.data() + text.size(), place);
  return labels().motion(place, query_value(request, "which") == "neutral");
}

Response Studio::label_answer(const Request& request) {
  return json_response(labels().answer(parsed_body(request)));
}

Response Studio::label_agreement(const Request& /*request*/) {
  return json_response(labels().agreement());
}

Response Studio::clip(const Request& request) const {
  const std::string rest = request.path.substr(std::string("/api/clips/").size());
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  const std::string id = rest.substr(0, slash);
  const std::string what = rest.substr(slash);
  if (what == "/motion") return stage_.motion(id);
  if (what == "/mesh") return stage_.mesh(id);
  if (what == "/export") return stage_.exported(id, query_value(request, "format"));
  throw HttpError(404, "nothing is here");
}

}  // namespace laban::studio
