#include "laban/motion/clip.h"

#include <cmath>

#include "laban/base/error.h"
#include "laban/math/rotation.h"

namespace laban::motion {
namespace {

using base::Error;
using base::ErrorKind;

std::string place(int frame, int joint, const Skeleton& skeleton) {
  return "clip: frame " + std::to_string(frame) + ", joint '" + skeleton.joint(joint).name + "': ";
}

}  // namespace

Clip::Clip(std::shared_ptr<const Skeleton> skeleton, double frame_rate_hz,
           Eigen::Matrix3Xd root_positions, std::vector<Eigen::Quaterniond> rotations,
           Eigen::Matrix3Xd translations)
    : skeleton_(std::move(skeleton)),
      frame_rate_hz_(frame_rate_hz),
      root_positions_(std::move(root_positions)),
      rotations_(std::move(rotations)),
      translations_(std::move(translations)) {
  if (!skeleton_) throw Error(ErrorKind::kData, "clip: it has no skeleton");
  if (!(frame_rate_hz_ > 0.0) || !std::isfinite(frame_rate_hz_)) {
    throw Error(ErrorKind::kData, "clip: the frame rate must be positive and finite");
  }
  const int frames = frame_count();
  const int joints = joint_count();
  const auto cells = static_cast<std::size_t>(frames) * static_cast<std::size_t>(joints);
  if (frames < 1) throw Error(ErrorKind::kData, "clip: it has no frames");
  if (rotations_.size() != cells) {
    throw Error(ErrorKind::kData, "clip: expected " + std::to_string(cells) + " rotations, found " +
                                      std::to_string(rotations_.size()));
  }
  if (has_translations() && static_cast<std::size_t>(translations_.cols()) != cells) {
    throw Error(ErrorKind::kData, "clip: expected " + std::to_string(cells) +
                                      " translations, found " +
                                      std::to_string(translations_.cols()));
  }
  for (int f = 0; f < frames; ++f) {
    Eigen::Quaterniond* const now = rotations_.data() + static_cast<std::ptrdiff_t>(f) * joints;
    const Eigen::Quaterniond* const before = f > 0 ? now - joints : now;
    for (int j = 0; j < joints; ++j) {
      if (!(std::abs(now[j].squaredNorm() - 1.0) <= 1e-9)) {
        throw Error(ErrorKind::kData,
                    place(f, j, *skeleton_) + "the rotation is not a unit quaternion");
      }
      // math::same_hemisphere, which is a call a cell.
      if (now[j].dot(before[j]) < 0.0) now[j].coeffs() = -now[j].coeffs();
      // Rest offsets are finite, the skeleton says.
      const bool moves = j == 0 || has_translations();
      if (moves && !translation(f, j).allFinite()) {
        throw Error(ErrorKind::kData, place(f, j, *skeleton_) + "the position is not finite");
      }
    }
    if (has_translations() &&
        translations_.col(static_cast<Eigen::Index>(f) * joints) != root_positions_.col(f)) {
      throw Error(ErrorKind::kData,
                  place(f, 0, *skeleton_) + "translation and root position differ");
    }
  }
}

std::span<const Eigen::Quaterniond> Clip::rotations(int frame) const {
  const auto joints = static_cast<std::size_t>(joint_count());
  return std::span(rotations_).subspan(static_cast<std::size_t>(frame) * joints, joints);
}

Eigen::Vector3d Clip::translation(int frame, int joint) const {
  if (has_translations()) {
    return translations_.col(static_cast<Eigen::Index>(frame) * joint_count() + joint);
  }
  return joint == 0 ? Eigen::Vector3d(root_positions_.col(frame))
                    : skeleton_->joint(joint).rest_offset;
}

Clip Clip::slice(int begin, int end) const {
  if (begin < 0 || begin >= end || end > frame_count()) {
    throw Error(ErrorKind::kUsage, "clip: frames [" + std::to_string(begin) + ", " +
                                       std::to_string(end) + ") do not lie in its " +
                                       std::to_string(frame_count()) + " frames");
  }
  const auto joints = static_cast<std::ptrdiff_t>(joint_count());
  std::vector<Eigen::Quaterniond> rotations(rotations_.begin() + begin * joints,
                                            rotations_.begin() + end * joints);
  Eigen::Matrix3Xd translations;
  if (has_translations())
    translations = translations_.middleCols(begin * joints, (end - begin) * joints);
  return {skeleton_, frame_rate_hz_, root_positions_.middleCols(begin, end - begin),
          std::move(rotations), std::move(translations)};
}

}  // namespace laban::motion
