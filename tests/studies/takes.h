#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "laban/base/error.h"
#include "laban/io/clip_file.h"
#include "laban/motion/humanoid.h"

#include "name_pattern.h"

namespace laban::studies {

/// One file of a folder of captures, and what its name says.
struct Take {
  std::string name;  ///< of the file, without its ending
  std::string content;
  std::string performer;
  std::string take;
  motion::Capture capture;
};

/// The takes of a folder whose names fit a pattern such as "{content}_{performer}_{take}", in the
/// order of their names.
/// @throws base::Error{kUsage} if there is none; as io::read_clip and motion::find_capture.
inline std::vector<Take> read_takes(const std::filesystem::path& folder,
                                    const std::string& pattern) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (io::is_motion_file(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Take> takes;
  for (const auto& file : files) {
    auto fields = match(pattern, file.stem().string());
    if (fields.empty()) continue;
    takes.push_back({file.stem().string(), fields["content"], fields["performer"], fields["take"],
                     motion::find_capture(io::read_clip(file).clip)});
  }
  if (takes.empty()) {
    throw base::Error(base::ErrorKind::kUsage,
                      folder.string() + ": no file fits the pattern " + pattern);
  }
  return takes;
}

/// Who performs the takes, in order of first appearance.
inline std::vector<std::string> performers_of(const std::vector<Take>& takes) {
  std::vector<std::string> performers;
  for (const Take& take : takes) {
    if (std::find(performers.begin(), performers.end(), take.performer) == performers.end())
      performers.push_back(take.performer);
  }
  return performers;
}

/// The items of a list "a,b,c".
inline std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> parts(1);
  for (const char c : list) {
    if (c == ',') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

}  // namespace laban::studies
