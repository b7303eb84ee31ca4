#include "laban/motion/foot_lock_stream.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

#include "laban/base/error.h"

namespace laban::motion {
namespace {

using base::Error;
using base::ErrorKind;

constexpr double kStretchS = 8.0;
constexpr double kMarginS = 2.0;
constexpr double kPieceFadeS = 0.5;

int frames_in(double seconds, double frame_rate_hz) {
  return std::max(2, static_cast<int>(std::lround(seconds * frame_rate_hz)));
}

}  // namespace

FootLockStream::FootLockStream(Humanoid humanoid, const FootFloor& floor)
    : humanoid_(std::move(humanoid)), floor_(floor) {}

std::vector<FootLockStream::Frame> FootLockStream::frames_of(const Clip& clip) {
  std::vector<Frame> frames(static_cast<std::size_t>(clip.frame_count()));
  for (int f = 0; f < clip.frame_count(); ++f) {
    Frame& frame = frames[static_cast<std::size_t>(f)];
    frame.root = clip.root_positions().col(f);
    const auto rotations = clip.rotations(f);
    frame.rotations.assign(rotations.begin(), rotations.end());
    if (!clip.has_translations()) continue;
    frame.translations.resize(3, clip.joint_count());
    for (int j = 0; j < clip.joint_count(); ++j) frame.translations.col(j) = clip.translation(f, j);
  }
  return frames;
}

template <typename Frames>
Clip FootLockStream::to_clip(const Frames& frames) const {
  Eigen::Matrix3Xd roots(3, std::ssize(frames));
  std::vector<Eigen::Quaterniond> rotations;
  Eigen::Matrix3Xd translations;
  const Eigen::Index joints = skeleton_->joint_count();
  if (frames.front().translations.cols() > 0) {
    translations.resize(3, joints * std::ssize(frames));
  }
  Eigen::Index f = 0;
  for (const Frame& frame : frames) {
    roots.col(f) = frame.root;
    rotations.insert(rotations.end(), frame.rotations.begin(), frame.rotations.end());
    if (translations.cols() > 0) translations.middleCols(joints * f, joints) = frame.translations;
    ++f;
  }
  return {skeleton_, frame_rate_hz_, std::move(roots), std::move(rotations),
          std::move(translations)};
}

FootLockStream::Frame FootLockStream::mix(const Frame& a, const Frame& b, double share) {
  Frame frame;
  frame.root = (1.0 - share) * a.root + share * b.root;
  for (std::size_t j = 0; j < a.rotations.size(); ++j) {
    frame.rotations.push_back(a.rotations[j].slerp(share, b.rotations[j]).normalized());
  }
  frame.translations = (1.0 - share) * a.translations + share * b.translations;
  return frame;
}

void FootLockStream::push(const Clip& piece) {
  if (finished_) throw Error(ErrorKind::kUsage, "FootLockStream: nothing follows finish()");
  if (!skeleton_) {
    skeleton_ = piece.shared_skeleton();
    frame_rate_hz_ = piece.frame_rate_hz();
    stretch_ = frames_in(kStretchS, frame_rate_hz_);
    margin_ = frames_in(kMarginS, frame_rate_hz_);
    fade_ = frames_in(kPieceFadeS, frame_rate_hz_);
  }
  if (piece.shared_skeleton() != skeleton_ || piece.frame_rate_hz() != frame_rate_hz_) {
    throw Error(ErrorKind::kData,
                "FootLockStream: a piece of another skeleton or frame rate than the first");
  }
  for (Frame& frame : frames_of(piece)) {
    raw_.push_back(std::move(frame));
    ++pushed_;
    if (pushed_ == next_ + stretch_ + margin_) hold(stretch_);
  }
}

void FootLockStream::finish() {
  finished_ = true;
  if (pushed_ > next_) hold(static_cast<int>(pushed_ - next_));
}

/// Makes the next `count` frames ready.
void FootLockStream::hold(int count) {
  FootLockOptions options;
  options.floor = floor_;
  const Clip raw = to_clip(raw_);
  const FootContacts contacts = find_foot_contacts(raw, humanoid_).contacts;
  std::vector<Frame> held = frames_of(lock_feet(raw, humanoid_, contacts, options).clip);
  const auto begin = static_cast<std::size_t>(next_ - first_);
  const std::size_t fading = std::min(tail_.size(), static_cast<std::size_t>(count));
  for (std::size_t f = 0; f < fading; ++f) {
    const double x = (static_cast<double>(f) + 0.5) / static_cast<double>(tail_.size());
    Frame& frame = held[begin + f];
    frame = mix(tail_[f], frame, x * x * (3.0 - 2.0 * x));
  }
  const std::size_t end = begin + static_cast<std::size_t>(count);
  const std::size_t tail_end = std::min(held.size(), end + static_cast<std::size_t>(fade_));
  const auto at = [&](std::size_t f) {
    return std::make_move_iterator(held.begin() + static_cast<std::ptrdiff_t>(f));
  };
  done_.insert(done_.end(), at(begin), at(end));
  tail_.assign(at(end), at(tail_end));
  next_ += count;
  while (first_ < next_ - margin_) {
    raw_.pop_front();
    ++first_;
  }
}

Clip FootLockStream::take(int count) {
  if (count < 1 || count > ready()) {
    throw Error(ErrorKind::kUsage, "FootLockStream: " + std::to_string(count) + " of " +
                                       std::to_string(ready()) + " frames");
  }
  const std::vector<Frame> frames(std::make_move_iterator(done_.begin()),
                                  std::make_move_iterator(done_.begin() + count));
  done_.erase(done_.begin(), done_.begin() + count);
  return to_clip(frames);
}

}  // namespace laban::motion
