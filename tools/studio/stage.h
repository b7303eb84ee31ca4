#pragma once

#include <map>
#include <string>
#include <vector>

#include "files.h"
#include "http.h"
#include "motion_message.h"

namespace laban::studio {

/// A clip that is open.
struct OpenClip {
  std::string id;    ///< "c0"
  std::string path;  ///< as named on the command line, or the name of the file that was dropped
  cli::CapturedClip clip;

  [[nodiscard]] std::string name() const;
  /// "walk_styled.bvh": what a file of what was made of it is called.
  [[nodiscard]] std::string made_name(const std::string& made, const std::string& format) const;
};

/// The clips that are open: those of the command line and those dropped on the page. Nothing else
/// of the disk is read.
class Stage {
 public:
  Stage(cli::ReadClipOptions reading, cli::Common common)
      : reading_(std::move(reading)), common_(std::move(common)) {}

  [[nodiscard]] Routes routes();

  /// Reads a clip from the disk. @throws as cli::read_captured_clip.
  const OpenClip& open(const std::string& path);
  /// Takes the bytes of a file; an .asf is kept for the .amc that follows.
  /// @throws HttpError{400} if the name is no plain file name; as io::parse_clip.
  Json drop(const std::string& name, const std::string& bytes);
  /// @throws HttpError{404} if there is no such clip.
  [[nodiscard]] const OpenClip& at(const std::string& id) const;
  [[nodiscard]] Json clips_json() const;
  [[nodiscard]] const cli::ReadClipOptions& reading() const noexcept { return reading_; }
  [[nodiscard]] const cli::Common& common() const noexcept { return common_; }

  [[nodiscard]] Response motion(const std::string& id) const;
  /// The character of a glTF clip, with its mesh. @throws HttpError{404} if it has none.
  [[nodiscard]] Response mesh(const std::string& id) const;
  [[nodiscard]] Response exported(const std::string& id, const std::string& format) const;

 private:
  cli::CapturedClip read_amc(const std::string& name, const std::string& bytes) const;

  cli::ReadClipOptions reading_;
  cli::Common common_;
  std::vector<OpenClip> clips_;
  std::string skeleton_;  ///< bytes of the last .asf dropped
};

/// @throws HttpError{400} unless it is "bvh" or "glb".
void require_clip_format(const std::string& format);

}  // namespace laban::studio
