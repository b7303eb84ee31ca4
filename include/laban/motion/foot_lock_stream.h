#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/motion/clip.h"
#include "laban/motion/foot_lock.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {

/// lock_feet for a motion that comes in pieces and need not end: feet are held in stretches of
/// eight seconds that know two seconds on either side of them and fade into one another, so that
/// memory does not grow with the frames that have passed. Contacts are found in the motion itself
/// (find_foot_contacts). The frames do not depend on the pieces in which they come.
class FootLockStream {
 public:
  /// @param floor  where the feet stand, one for the whole motion.
  FootLockStream(Humanoid humanoid, const FootFloor& floor);

  /// Frames that follow those pushed before.
  /// @throws Error{kUsage} after finish(); Error{kData} for another skeleton or rate than before.
  void push(const Clip& piece);
  /// Nothing follows: all frames become ready.
  void finish();
  /// Frames that can be taken now.
  [[nodiscard]] int ready() const noexcept { return static_cast<int>(done_.size()); }
  /// @throws Error{kUsage} unless 1 <= count <= ready().
  [[nodiscard]] Clip take(int count);

 private:
  struct Frame {
    Eigen::Vector3d root = Eigen::Vector3d::Zero();
    std::vector<Eigen::Quaterniond> rotations;
    Eigen::Matrix3Xd translations;  // none, or a column a joint
  };

  [[nodiscard]] static Frame mix(const Frame& a, const Frame& b, double share);
  [[nodiscard]] static std::vector<Frame> frames_of(const Clip& clip);
  template <typename Frames>
  [[nodiscard]] Clip to_clip(const Frames& frames) const;
  void hold(int count);

  Humanoid humanoid_;
  FootFloor floor_;
  std::shared_ptr<const Skeleton> skeleton_;
  double frame_rate_hz_ = 0.0;
  int stretch_ = 0;  // frames
  int margin_ = 0;
  int fade_ = 0;
  bool finished_ = false;
  std::int64_t pushed_ = 0;
  std::int64_t next_ = 0;   // first frame that is not done
  std::int64_t first_ = 0;  // number of raw_.front()
  std::deque<Frame> raw_;
  std::vector<Frame> tail_;  // frames next_ .. as the stretch before held them
  std::deque<Frame> done_;
};

}  // namespace laban::motion
