#include "loop/held_feet.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

constexpr double kPieceS = 8.0;
constexpr double kMarginS = 2.0;
constexpr double kFadeS = 0.5;

motion::FootContacts contacts_of(const std::vector<BodyFrame>& frames, double frame_rate_hz) {
  motion::FootContacts contacts{frame_rate_hz, Eigen::Matrix4Xd(4, std::ssize(frames))};
  for (std::size_t f = 0; f < frames.size(); ++f) {
    contacts.share.col(static_cast<Eigen::Index>(f)) = frames[f].contacts;
  }
  return contacts;
}

std::array<Eigen::Matrix3Xd, 2> added_steps_of(const std::vector<BodyFrame>& frames) {
  std::array<Eigen::Matrix3Xd, 2> steps;
  for (std::size_t side = 0; side < 2; ++side) {
    steps[side].resize(3, std::ssize(frames));
    for (std::size_t f = 0; f < frames.size(); ++f) {
      steps[side].col(static_cast<Eigen::Index>(f)) =
          frames[f].added_steps.col(static_cast<Eigen::Index>(side));
    }
  }
  return steps;
}

int frames_of(double seconds, double frame_rate_hz) {
  return std::max(2, static_cast<int>(std::lround(seconds * frame_rate_hz)));
}

}  // namespace

HeldFrames hold_feet(const std::vector<BodyFrame>& frames, const BodyRows& rows,
                     const motion::Capture& capture, const motion::FootFloor& floor,
                     std::vector<int> joins, bool level_parts) {
  motion::FootLockOptions options;
  options.floor = floor;
  options.joins = std::move(joins);
  options.level_parts = level_parts;
  if (!level_parts) {
    options.added_steps = added_steps_of(frames);
    // The body keeps its captured height: a centimetre down is farther off the capture than a foot
    // that slides the rest of its way.
    options.deepest_m = 0.0;
  }
  const motion::FootContacts contacts = contacts_of(frames, capture.clip.frame_rate_hz());
  const motion::LockedFeet locked =
      motion::lock_feet(to_clip(frames, rows, capture.clip), capture.humanoid, contacts, options);
  HeldFrames held{to_body_frames(locked.clip, rows, contacts), locked.stances};
  for (std::size_t f = 0; f < frames.size(); ++f) {
    held.frames[f].source_frame = frames[f].source_frame;
    held.frames[f].added_steps = frames[f].added_steps;
  }
  return held;
}

HeldFeet::HeldFeet(const BodyRows& rows, const motion::Capture& capture,
                   std::optional<motion::FootFloor> floor)
    : rows_(rows),
      capture_(capture),
      floor_(floor),
      piece_(frames_of(kPieceS, capture.clip.frame_rate_hz())),
      margin_(frames_of(kMarginS, capture.clip.frame_rate_hz())),
      fade_(frames_of(kFadeS, capture.clip.frame_rate_hz())) {}

void HeldFeet::push(BodyFrame frame) {
  ++pushed_;
  if (!floor_) {
    joins_.clear();
    done_.push_back(std::move(frame));
    return;
  }
  raw_.push_back(std::move(frame));
  if (pushed_ == next_ + piece_ + margin_) hold_piece();
}

void HeldFeet::hold_piece() {
  std::vector<int> joins;
  for (const std::int64_t join : joins_) {
    if (join > first_ && join < pushed_) joins.push_back(static_cast<int>(join - first_));
  }
  HeldFrames held = hold_feet({raw_.begin(), raw_.end()}, rows_, capture_, *floor_, joins, false);
  const auto begin = static_cast<std::size_t>(next_ - first_);
  for (std::size_t f = 0; f < tail_.size(); ++f) {
    const double x = (static_cast<double>(f) + 0.5) / static_cast<double>(tail_.size());
    BodyFrame& frame = held.frames[begin + f];
    frame = mix(tail_[f], frame, x * x * (3.0 - 2.0 * x));
  }
  const auto end = begin + static_cast<std::size_t>(piece_);
  const auto at = [&](std::size_t f) {
    return held.frames.begin() + static_cast<std::ptrdiff_t>(f);
  };
  done_.insert(done_.end(), at(begin), at(end));
  tail_.assign(at(end), at(end + static_cast<std::size_t>(fade_)));
  // Stances of the margins are counted with the pieces they belong to, as far as a share tells.
  stances_ += static_cast<int>(std::lround(static_cast<double>(held.stances) * piece_ /
                                           static_cast<double>(held.frames.size())));
  next_ += piece_;
  while (first_ < next_ - margin_) {
    raw_.pop_front();
    ++first_;
  }
  while (!joins_.empty() && joins_.front() <= first_) joins_.pop_front();
}

HeldFrames HeldFeet::take(int count) {
  LABAN_CHECK(count <= ready());
  HeldFrames taken;
  taken.frames.assign(std::make_move_iterator(done_.begin()),
                      std::make_move_iterator(done_.begin() + count));
  done_.erase(done_.begin(), done_.begin() + count);
  taken.stances = std::exchange(stances_, 0);
  return taken;
}

}  // namespace laban::loop
