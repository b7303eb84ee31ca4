#include "laban/motion/resample.h"

#include "laban/base/error.h"

#include "clip_sample.h"

namespace laban::motion {

Clip resample(const Clip& clip, double frame_rate_hz) {
  if (!(frame_rate_hz > 0.0) || !std::isfinite(frame_rate_hz)) {
    throw base::Error(base::ErrorKind::kUsage, "resample: the frame rate is " +
                                                   std::to_string(frame_rate_hz) +
                                                   ", it must be positive and finite");
  }
  const double step = clip.frame_rate_hz() / frame_rate_hz;  // source frames a new frame
  const int frames = static_cast<int>(std::floor((clip.frame_count() - 1) / step + 1e-6)) + 1;
  const int joints = clip.joint_count();
  Eigen::Matrix3Xd root(3, frames);
  Eigen::Matrix3Xd translations;
  if (clip.has_translations()) {
    translations.resize(3, static_cast<Eigen::Index>(frames) * joints);
  }
  std::vector<Eigen::Quaterniond> rotations;
  rotations.reserve(static_cast<std::size_t>(frames) * static_cast<std::size_t>(joints));
  for (int f = 0; f < frames; ++f) {
    const FramePosition at = frame_position(f * step, clip.frame_count());
    root.col(f) = translation_at(clip, at, 0);
    for (int j = 0; j < joints; ++j) {
      rotations.push_back(rotation_at(clip, at, j));
      if (clip.has_translations()) {
        translations.col(static_cast<Eigen::Index>(f) * joints + j) = translation_at(clip, at, j);
      }
    }
  }
  return {clip.shared_skeleton(), frame_rate_hz, std::move(root), std::move(rotations),
          std::move(translations)};
}

}  // namespace laban::motion
