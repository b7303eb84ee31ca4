#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "effort_room.h"
#include "http.h"
#include "label_room.h"
#include "stage.h"

namespace laban::studio {

/// What the studio is opened with.
struct StudioOptions {
  std::vector<std::string> clips;
  std::string model;  ///< path; empty: the default model
  cli::ReadClipOptions reading;
  LabellingOptions labelling;
};

/// The rooms behind the pages: a request in, an answer out. It knows nothing of sockets.
class Studio {
 public:
  /// @param page  the pages, one HTML file; "{{nonce}}" stands where scripts and styles carry one.
  /// @throws as cli::read_model and cli::read_captured_clip.
  Studio(const StudioOptions& options, std::string page, const cli::Common& common);

  /// @throws HttpError{404} or {405} for what nothing here answers; as the rooms.
  [[nodiscard]] Response handle(const Request& request);

 private:
  using Answerer = Response (Studio::*)(const Request&);

  Response page(const Request& request);
  Response overview(const Request& request);
  Response drop(const Request& request);
  Response effort_open(const Request& request);
  Response effort_style(const Request& request);
  Response effort_snippet(const Request& request);
  Response effort_over_time(const Request& request);
  Response effort_export(const Request& request);
  Response label_next(const Request& request);
  Response label_motion(const Request& request);
  Response label_answer(const Request& request);
  Response label_agreement(const Request& request);
  /// @throws HttpError{404} if no table is open.
  LabelRoom& labels();
  /// "/api/clips/c0/motion" and its like.
  Response clip(const Request& request) const;

  std::string page_;
  Stage stage_;
  EffortRoom effort_;
  std::optional<LabelRoom> label_;
  std::map<std::string, Answerer> answerers_;  // by "METHOD /path"
};

}  // namespace laban::studio
