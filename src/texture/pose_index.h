#pragma once

#include <algorithm>
#include <vector>

#include <Eigen/Dense>

#include "laban/texture/motion_texture.h"

namespace laban::texture {

/// Every so many frames one is looked at where all are compared with all.
inline constexpr int kIndexStride = 6;

/// Rotation of a joint in a frame of the corpus, away from the reference.
[[nodiscard]] Eigen::Quaterniond captured_rotation(const MotionTexture& texture, int joint,
                                                   int frame);

/// Poses and velocities of a corpus, to find frames at which one motion can become another.
///
/// A frame is told by two columns of each joint's rotation matrix (which have no branches), by how
/// they change to the next frame times 0.15 s (so far a joint goes before a change of course
/// shows), by height and by steps in observation units.
class PoseIndex {
 public:
  /// @param texture  must outlive this.
  explicit PoseIndex(const MotionTexture& texture);

  /// Features of frames [begin, begin + count), a column each; each frame has a successor in its
  /// take. @param stride  every so many frames.
  [[nodiscard]] Eigen::MatrixXf features(int begin, int count, int stride = 1) const;
  /// Frames of which coarse_features() holds one column each: those of each take, kIndexStride
  /// apart, that have a successor.
  [[nodiscard]] const std::vector<int>& coarse_frames() const noexcept { return coarse_frames_; }
  [[nodiscard]] const Eigen::MatrixXf& coarse_features() const noexcept { return coarse_; }
  /// The median distance between frames a quarter of a second apart in a take: what is nearer is as
  /// near as motion goes on. 0 for takes shorter than that.
  [[nodiscard]] double usual_distance() const noexcept { return usual_; }
  /// Whether a frame is among the nine tenths of the corpus around which joints are accelerated
  /// least.
  [[nodiscard]] bool is_calm(int frame) const {
    return restless_[static_cast<std::size_t>(frame)] <= calm_;
  }
  /// The calmest frame of [begin, end).
  [[nodiscard]] int calmest(int begin, int end) const {
    const auto from = restless_.begin();
    return static_cast<int>(std::min_element(from + begin, from + end) - from);
  }
  /// Number of the take that a frame is of.
  [[nodiscard]] int take_of(int frame) const;

 private:
  void find_calm_frames();

  const MotionTexture& texture_;
  std::vector<int> coarse_frames_;
  Eigen::MatrixXf coarse_;
  double usual_ = 0.0;
  std::vector<float> restless_;  // of each frame: the joints' largest acceleration around it
  float calm_ = 0.0F;
};

/// Squared distances of every column of a (rows) to every one of b.
[[nodiscard]] Eigen::MatrixXf squared_distances(const Eigen::MatrixXf& a, const Eigen::MatrixXf& b);

/// The largest angle, radians, by which a joint differs between every feature column of a and every
/// one of b: from two columns of its rotation matrices, which say it to within a fifth.
[[nodiscard]] Eigen::MatrixXf largest_turns(const Eigen::MatrixXf& a, const Eigen::MatrixXf& b);

/// How far rotations are from what joints were seen to do.
class RotationRange {
 public:
  explicit RotationRange(const MotionTexture& texture);

  /// Angle from a rotation of a joint (radians; as observed, away from the reference) to the
  /// nearest captured one of that joint. Time O(frames).
  [[nodiscard]] double distance(int joint, const Eigen::Quaterniond& rotation) const;
  /// The captured rotation itself.
  [[nodiscard]] Eigen::Quaterniond nearest(int joint, const Eigen::Quaterniond& rotation) const;
  /// Captured rotations of a joint (x, y, z, w), a row each: all, or some evenly over time.
  [[nodiscard]] const Eigen::MatrixX4f& captured(int joint) const {
    return captured_[static_cast<std::size_t>(joint)];
  }

 private:
  std::vector<Eigen::MatrixX4f> captured_;  // of each joint
};

}  // namespace laban::texture
