#include "laban/motion/resample.h"

#include <cmath>

#include "laban/base/error.h"
#include "laban/math/cubic_interpolation.h"

#include "motion/clip_sample.h"

namespace laban::motion {

namespace {

/// Frames of a sequence at another rate, and the source frames that each of them spans.
struct FrameGrid {
  double step = 1.0;
  int frame_count = 0;
};

void check_rate(double rate_hz) {
  if (rate_hz > 0.0 && std::isfinite(rate_hz)) return;
  throw base::Error(base::ErrorKind::kUsage, "resample: the frame rate is " +
                                                 std::to_string(rate_hz) +
                                                 ", it must be positive and finite");
}

FrameGrid frame_grid(int frame_count, double from_hz, double to_hz) {
  check_rate(to_hz);
  const double step = from_hz / to_hz;
  return {step, static_cast<int>(std::floor((frame_count - 1) / step + 1e-6)) + 1};
}

}  // namespace

Clip resample(const Clip& clip, double frame_rate_hz) {
  const auto [step, frames] = frame_grid(clip.frame_count(), clip.frame_rate_hz(), frame_rate_hz);
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

PoseMatrix resample(const PoseMatrix& pose, double frame_rate_hz) {
  if (frame_rate_hz == pose.frame_rate_hz) return pose;
  const FrameGrid grid = frame_grid(pose.frame_count(), pose.frame_rate_hz, frame_rate_hz);
  std::vector<double> frames;
  for (int f = 0; f < grid.frame_count; ++f) frames.push_back(f * grid.step);
  return sample(pose, frames, frame_rate_hz);
}

PoseMatrix sample(const PoseMatrix& pose, std::span<const double> frames, double frame_rate_hz) {
  check_rate(frame_rate_hz);
  if (frames.empty())
    throw base::Error(base::ErrorKind::kUsage, "sample: there is no frame to read");
  return {frame_rate_hz, pose.leg_length_m, math::interpolate(pose.angles, frames),
          math::interpolate(pose.height, frames),
          planar_steps(math::interpolate(planar_path(pose), frames))};
}

}  // namespace laban::motion
