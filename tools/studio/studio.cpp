#include "studio.h"

#include "laban/base/version.h"

#include "access.h"

namespace laban::studio {

Studio::Studio(const StudioOptions& options, std::string page, const cli::Common& common)
    : page_(std::move(page)), stage_(options.reading, common), loop_(stage_, work_) {
  routes_ = {{"GET /", [this](const Request&) { return this->page(); }},
             {"GET /api/studio", [this](const Request&) { return json_response(overview()); }}};
  for (const std::string& clip : options.clips) stage_.open(clip);
  routes_.merge(stage_.routes());
  if (!options.labelling.table.empty()) {
    label_.emplace(options.labelling, common);
    routes_.merge(label_->routes());
  } else {
    routes_.merge(loop_.routes());
    if (!options.texture.empty()) {
      texture_.emplace(stage_, options.texture, work_);
      routes_.merge(texture_->routes());
    }
    if (!options.manifold.empty()) {
      map_.emplace(stage_, options.manifold, work_);
      routes_.merge(map_->routes());
    }
    effort_.emplace(stage_, options.model, work_);
    routes_.merge(effort_->routes());
  }
}

Response Studio::handle(const Request& request) {
  const Work::Turn turn(work_);
  const auto found = routes_.find(request.method + " " + request.path);
  if (found == routes_.end()) throw HttpError(404, "nothing is here");
  return found->second(request);
}

std::optional<Response> Studio::handle_at_once(const Request& request) {
  if (request.path != "/api/work") return std::nullopt;
  if (request.method == "DELETE") work_.stop();
  return json_response(work_.told());
}

Response Studio::page() const {
  static constexpr std::string_view kMark = "{{nonce}}";
  const std::string nonce = random_hex(16);
  std::string html = page_;
  for (std::size_t at = html.find(kMark); at != std::string::npos; at = html.find(kMark, at))
    html.replace(at, kMark.size(), nonce);
  return {200, "text/html; charset=utf-8", std::move(html), {}, nonce};
}

Json Studio::overview() const {
  Json rooms = Json::array();
  if (label_) rooms.push_back("label");
  if (texture_) rooms.push_back("texture");
  if (map_) rooms.push_back("map");
  if (!label_) rooms.insert(rooms.end(), {"effort", "loop", "stage"});
  return {{"version", base::version()}, {"rooms", rooms}, {"clips", stage_.clips_json()}};
}

}  // namespace laban::studio
