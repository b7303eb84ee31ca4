#include "texture_play.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/motion/motion_quality.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"

namespace laban::cli {

using base::Error;
using base::ErrorKind;

int parse_whole(std::string_view text) {
  int value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failed == std::errc() && end == text.data() + text.size() && value >= 0 ? value : -1;
}

const PoseReader::Poses& PoseReader::read(const std::string& path) {
  const auto found = clips_.find(path);
  if (found != clips_.end()) return found->second;
  const CapturedClip clip = read_captured_clip(path, reading_, common_);
  records_.push_back(clip.record);
  return clips_
      .emplace(
          path,
          Poses{texture::standing_on_floor(
                    texture_.rig, motion::to_pose_matrix(clip.capture.clip, clip.capture.humanoid)),
                motion::planar_start(clip.capture.clip, clip.capture.humanoid), clip.first_frame()})
      .first->second;
}

PoseReader::Named PoseReader::find(const std::string& option, const std::string& key) {
  const std::size_t colon = key.rfind(':');
  const int frame =
      colon == std::string::npos ? -1 : parse_whole(std::string_view(key).substr(colon + 1));
  if (frame < 0 || colon == 0) {
    throw Error(ErrorKind::kUsage, fmt::format("{} {}: a pose is CLIP:FRAME", option, key));
  }
  const Poses& poses = read(key.substr(0, colon));
  const int count = poses.pose.frame_count() + poses.first_frame;
  if (frame >= count) {
    throw Error(ErrorKind::kUsage,
                fmt::format("{} {}: the clip has frames 0 to {}", option, key, count - 1));
  }
  if (frame < poses.first_frame) {
    warn(common_, fmt::format("{}: frame {} is a T-pose and no motion; frame {} is taken", key,
                              frame, poses.first_frame));
  }
  return {&poses, std::max(0, frame - poses.first_frame)};
}

motion::PlanarPose PoseReader::place(const std::string& option, const std::string& key) {
  const Named named = find(option, key);
  const motion::PoseMatrix& pose = named.poses->pose;
  const Eigen::Vector3d at = motion::planar_path(pose, named.poses->start).col(named.frame);
  const double legs = pose.leg_length_m / texture_.leg_length_m;
  return {legs * at[0], legs * at[1], at[2]};
}

Eigen::MatrixXd PoseReader::pair(const std::string& option, const std::string& key, int step) {
  const Named named = find(option, key);
  const Poses& poses = *named.poses;
  const double at = named.frame;
  const double last = poses.pose.frame_count() - 1.0;
  const double apart = poses.pose.frame_rate_hz / texture_.frame_rate_hz;
  double other = at + step * apart;
  // Where the clip ends the movement before (after) it stands for that after (before).
  const bool beyond = other < -1e-9 || other > last + 1e-9;
  if (beyond) other = std::clamp(at - step * apart, 0.0, last);
  const double times[] = {std::min(at, other), std::max(at, other)};
  const motion::PoseMatrix two = motion::sample(poses.pose, times, texture_.frame_rate_hz);
  Eigen::MatrixXd y = texture::observe(texture_.space, two);
  if (!beyond || at == other) return y;
  const Eigen::VectorXd here = y.col(step > 0 ? 1 : 0);
  const Eigen::VectorXd velocity = y.col(1) - y.col(0);
  y.col(0) = step > 0 ? here : here - velocity;
  y.col(1) = step > 0 ? here + velocity : here;
  return y;
}

Json to_json(const std::vector<texture::TextonPart>& parts) {
  Json json = Json::array();
  for (const texture::TextonPart& part : parts) {
    json.push_back({{"texton", part.texton},
                    {"begin_frame", part.begin},
                    {"end_frame", part.end},
                    {"jump", part.jump}});
  }
  return json;
}

std::string to_text(const std::vector<texture::TextonPart>& parts) {
  constexpr std::size_t kShown = 40;
  std::string text = "textons:";
  for (std::size_t n = 0; n < parts.size() && n < kShown; ++n) {
    text +=
        fmt::format(" {}{}", parts[n].texton, parts[n].jump && n + 1 < parts.size() ? " |" : "");
  }
  return text + (parts.size() > kShown ? " ..\n" : "\n");
}

Json quality_json(const texture::MotionTexture& texture, const motion::Clip& clip) {
  if (!texture.rig.floor) return nullptr;
  const motion::MotionQuality quality =
      motion::measure_quality(clip, texture.rig.humanoid, *texture.rig.floor);
  return {{"foot_skate_cm", quality.foot_skate_cm},
          {"toe_height_m", quality.toe_height_m},
          {"jerk_m_s3", quality.jerk_m_s3}};
}

}  // namespace laban::cli
