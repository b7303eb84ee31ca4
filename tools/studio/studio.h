#pragma once

#include <optional>
#include <string>
#include <vector>

#include "effort_room.h"
#include "http.h"
#include "label_room.h"
#include "loop_room.h"
#include "map_room.h"
#include "stage.h"
#include "texture_room.h"
#include "work.h"

namespace laban::studio {

/// What the studio is opened with.
struct StudioOptions {
  std::vector<std::string> clips;
  std::string model;     ///< path; empty: the default model
  std::string texture;   ///< path; empty: none
  std::string manifold;  ///< path; empty: none
  cli::ReadClipOptions reading;
  LabellingOptions labelling;
};

/// The rooms behind the pages: a request in, an answer out. It knows nothing of sockets.
class Studio {
 public:
  /// @param page  the pages, one HTML file; "{{nonce}}" stands where scripts and styles carry one.
  /// @throws as cli::read_model and cli::read_captured_clip.
  Studio(const StudioOptions& options, std::string page, const cli::Common& common);
  Studio(const Studio&) = delete;
  Studio& operator=(const Studio&) = delete;

  /// One request at a time. @throws HttpError{404} for what nothing here answers; as the rooms.
  [[nodiscard]] Response handle(const Request& request);
  /// How far handle() has come, and its end before its time; from any thread, at any time.
  /// @returns nullopt for what handle() answers.
  [[nodiscard]] std::optional<Response> handle_at_once(const Request& request);

 private:
  [[nodiscard]] Response page() const;
  [[nodiscard]] Json overview() const;

  std::string page_;
  Work work_;
  Stage stage_;
  LoopRoom loop_;
  std::optional<EffortRoom> effort_;
  std::optional<TextureRoom> texture_;
  std::optional<MapRoom> map_;
  std::optional<LabelRoom> label_;
  Routes routes_;
};

}  // namespace laban::studio
