#pragma once

#include <map>
#include <string>
#include <vector>

#include "laban/texture/motion_texture.h"
#include "laban/texture/texture_motion.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {

/// The parts of `laban texture` that make motion, a file each.
void add_texture_synthesize(CLI::App* texture);
void add_texture_path(CLI::App* texture);
void add_texture_edit(CLI::App* texture);

/// Poses named CLIP:FRAME, as a texture observes them; each clip is read once.
class PoseReader {
 public:
  PoseReader(const texture::MotionTexture& texture, const ReadClipOptions& reading,
             const Common& common)
      : texture_(texture), reading_(reading), common_(common) {}

  /// The frame and the one `step` later at the texture's rate (its neighbour where the clip ends,
  /// the frame itself where it has but one), earlier first: d x 2.
  /// @throws Error{kUsage} naming the option if `key` is no pose of a clip.
  [[nodiscard]] Eigen::MatrixXd pair(const std::string& option, const std::string& key, int step);
  /// Where on the ground the pose stands and which way it faces, in leg lengths of the texture's
  /// rig.
  /// @throws as pair.
  [[nodiscard]] motion::PlanarPose place(const std::string& option, const std::string& key);
  [[nodiscard]] const std::vector<InputRecord>& records() const { return records_; }

 private:
  struct Poses {
    motion::PoseMatrix pose;
    motion::PlanarPose start;
    int first_frame = 0;
  };
  struct Named {
    const Poses* poses;
    int frame = 0;  ///< of the poses
  };
  const Poses& read(const std::string& path);
  Named find(const std::string& option, const std::string& key);

  const texture::MotionTexture& texture_;
  const ReadClipOptions& reading_;
  const Common& common_;
  std::map<std::string, Poses> clips_;
  std::vector<InputRecord> records_;
};

/// All of `text` as a whole number of 0 and up; -1 if it is none.
[[nodiscard]] int parse_whole(std::string_view text);

/// Parts for reports, and in one line.
[[nodiscard]] Json to_json(const std::vector<texture::TextonPart>& parts);
[[nodiscard]] std::string to_text(const std::vector<texture::TextonPart>& parts);

/// Foot skate, toe height and jerk on the floor of the captures; null without one.
[[nodiscard]] Json quality_json(const texture::MotionTexture& texture, const motion::Clip& clip);

}  // namespace laban::cli
