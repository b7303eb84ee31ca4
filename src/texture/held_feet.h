#pragma once

#include <deque>
#include <vector>

#include "laban/motion/foot_lock_stream.h"

namespace laban::texture {

/// motion::FootLockStream for motion that was put together: where its poses do not fit the place
/// that a foot is held at, legs and feet would be bent as no capture bends them. Here no joint is
/// turned by more than 7 degrees: what the lock does to a frame is taken back as far as that needs,
/// smoothly over 0.15 s on either side, and the foot slides a little.
class HeldFeet {
 public:
  HeldFeet(const motion::Humanoid& humanoid, const motion::FootFloor& floor)
      : stream_(humanoid, floor) {}

  /// As of FootLockStream.
  void push(const motion::Clip& piece);
  void finish();
  [[nodiscard]] int ready() const;
  [[nodiscard]] motion::Clip take(int count);

 private:
  void hold();
  [[nodiscard]] double share(int frame) const;

  motion::FootLockStream stream_;
  bool finished_ = false;
  int reach_ = 0;                   // frames
  std::deque<motion::Clip> plain_;  // frames as they came, one a clip, from the first not taken
  std::deque<motion::Clip> held_;   // the same as the lock holds them, as far as it has come
  std::deque<double> shares_;       // how far each frame of held_, and some before, may be held
  int before_ = 0;                  // how many before
};

/// Frames of a clip, some of them as another one has them: with share 0 as `plain`, with 1 as
/// `held`.
/// @param shares  one a frame.
[[nodiscard]] motion::Clip mixed(const motion::Clip& plain, const motion::Clip& held,
                                 const std::vector<double>& shares);

}  // namespace laban::texture
