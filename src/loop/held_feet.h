#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "laban/motion/foot_lock.h"

#include "loop/body_track.h"

namespace laban::loop {

struct HeldFrames {
  std::vector<BodyFrame> frames;
  int stances = 0;
};

/// Feet of frames held where they touch the ground (motion::lock_feet).
/// @param level_parts  each part between joins is put on the floor as a whole.
/// @param joins  first frames of what follows a join, ascending, inside the frames.
[[nodiscard]] HeldFrames hold_feet(const std::vector<BodyFrame>& frames, const BodyRows& rows,
                                   const motion::Capture& capture, const motion::FootFloor& floor,
                                   std::vector<int> joins, bool level_parts);

/// The same for an endless row of frames, in pieces that know two seconds on either side of them
/// and fade into one another: memory does not grow with the frames that have passed.
class HeldFeet {
 public:
  /// Both must outlive this. @param floor  nullopt: frames pass as they are.
  HeldFeet(const BodyRows& rows, const motion::Capture& capture,
           std::optional<motion::FootFloor> floor);

  void push(BodyFrame frame);
  /// What follows a join begins `ahead` frames after the next one that is pushed.
  void mark_join(int ahead) { joins_.push_back(pushed_ + ahead); }
  /// Frames that can be taken now.
  [[nodiscard]] int ready() const noexcept { return static_cast<int>(done_.size()); }
  [[nodiscard]] HeldFrames take(int count);

 private:
  void hold_piece();

  const BodyRows& rows_;
  const motion::Capture& capture_;
  std::optional<motion::FootFloor> floor_;
  int piece_;  // frames
  int margin_;
  int fade_;
  std::int64_t pushed_ = 0;
  std::int64_t next_ = 0;   // first frame that is not done
  std::int64_t first_ = 0;  // number of raw_.front()
  std::deque<BodyFrame> raw_;
  std::deque<std::int64_t> joins_;
  std::vector<BodyFrame> tail_;  // frames next_ .. next_ + fade_ as the piece before held them
  std::deque<BodyFrame> done_;
  int stances_ = 0;
};

}  // namespace laban::loop
