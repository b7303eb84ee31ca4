#include "texture/held_feet.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "laban/math/constants.h"
#include "laban/math/rotation.h"

namespace laban::texture {
namespace {

using Eigen::Index;

constexpr double kMostTurn = 7.0 * math::kDegree;
constexpr double kReachS = 0.15;

double largest_turn(const motion::Clip& a, const motion::Clip& b) {
  double largest = 0.0;
  for (int j = 0; j < a.joint_count(); ++j) {
    largest = std::max(largest, math::angle_between(a.rotation(0, j), b.rotation(0, j)));
  }
  return largest;
}

/// Clips of one skeleton, one after the other.
motion::Clip joined(const std::vector<motion::Clip>& frames) {
  Eigen::Matrix3Xd roots(3, std::ssize(frames));
  std::vector<Eigen::Quaterniond> rotations;
  const motion::Clip& first = frames.front();
  const Index joints = first.joint_count();
  Eigen::Matrix3Xd translations;
  if (first.has_translations()) translations.resize(3, joints * std::ssize(frames));
  for (std::size_t n = 0; n < frames.size(); ++n) {
    const auto f = static_cast<Index>(n);
    roots.col(f) = frames[n].root_positions().col(0);
    const auto one = frames[n].rotations(0);
    rotations.insert(rotations.end(), one.begin(), one.end());
    for (int j = 0; j < first.joint_count() && first.has_translations(); ++j) {
      translations.col(f * joints + j) = frames[n].translation(0, j);
    }
  }
  return {first.shared_skeleton(), first.frame_rate_hz(), std::move(roots), std::move(rotations),
          std::move(translations)};
}

}  // namespace

motion::Clip mixed(const motion::Clip& plain, const motion::Clip& held,
                   const std::vector<double>& shares) {
  Eigen::Matrix3Xd roots = plain.root_positions();
  std::vector<Eigen::Quaterniond> rotations;
  Eigen::Matrix3Xd translations;
  const Index joints = held.joint_count();
  if (held.has_translations()) translations.resize(3, held.frame_count() * joints);
  for (int f = 0; f < held.frame_count(); ++f) {
    const double share = shares[static_cast<std::size_t>(f)];
    roots.col(f) += share * (held.root_positions().col(f) - plain.root_positions().col(f));
    for (int j = 0; j < held.joint_count(); ++j) {
      rotations.push_back(plain.rotation(f, j).slerp(share, held.rotation(f, j)).normalized());
      if (held.has_translations()) {
        translations.col(f * joints + j) =
            (1.0 - share) * plain.translation(f, j) + share * held.translation(f, j);
      }
    }
  }
  return {held.shared_skeleton(), held.frame_rate_hz(), std::move(roots), std::move(rotations),
          std::move(translations)};
}

void HeldFeet::push(const motion::Clip& piece) {
  reach_ = static_cast<int>(std::lround(kReachS * piece.frame_rate_hz()));
  for (int f = 0; f < piece.frame_count(); ++f) plain_.push_back(piece.slice(f, f + 1));
  stream_.push(piece);
  hold();
}

void HeldFeet::finish() {
  stream_.finish();
  finished_ = true;
  hold();
}

void HeldFeet::hold() {
  if (stream_.ready() == 0) return;
  const motion::Clip clip = stream_.take(stream_.ready());
  for (int f = 0; f < clip.frame_count(); ++f) {
    motion::Clip one = clip.slice(f, f + 1);
    const double turn = largest_turn(plain_[held_.size()], one);
    shares_.push_back(turn > kMostTurn ? kMostTurn / turn : 1.0);
    held_.push_back(std::move(one));
  }
}

int HeldFeet::ready() const {
  const auto held = static_cast<int>(held_.size());
  return finished_ ? held : std::max(0, held - 2 * reach_);
}

// The mean over a window of the least over the same window is smooth, and nowhere above what it
// is made of.
double HeldFeet::share(int frame) const {
  const int last = static_cast<int>(shares_.size()) - 1;
  const auto from = shares_.begin();
  double sum = 0.0;
  int count = 0;
  for (int f = frame - reach_; f <= frame + reach_; ++f) {
    if (f < 0 || f > last) continue;
    sum += *std::min_element(from + std::max(0, f - reach_), from + std::min(last, f + reach_) + 1);
    ++count;
  }
  return sum / count;
}

motion::Clip HeldFeet::take(int count) {
  std::vector<motion::Clip> taken;
  for (int n = 0; n < count; ++n) {
    taken.push_back(mixed(plain_.front(), held_.front(), {share(before_)}));
    plain_.pop_front();
    held_.pop_front();
    if (before_ < 2 * reach_) {
      ++before_;
    } else {
      shares_.pop_front();
    }
  }
  return joined(taken);
}

}  // namespace laban::texture
