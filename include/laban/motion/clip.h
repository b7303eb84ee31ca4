#pragma once

#include <memory>
#include <span>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/motion/skeleton.h"

namespace laban::motion {

/// F uniformly sampled frames of one skeleton with J joints.
///
/// Invariant: F >= 1, frame_rate_hz > 0, F*J unit rotations (| |q|^2 - 1 | <= 1e-9), all finite.
/// The constructor puts every joint's rotations into one hemisphere along time.
class Clip {
 public:
  /// @param root_positions  3 x F, metres, model space (replaces the root's rest offset).
  /// @param rotations       F*J, frame-major, parent-from-joint.
  /// @param translations    empty, or 3 x F*J, frame-major, metres: each joint's offset from its
  ///                        parent, for captures that animate position on joints other than the
  ///                        root; the root's columns must equal root_positions.
  /// @throws Error{kData} naming the first frame and joint that break the invariant.
  Clip(std::shared_ptr<const Skeleton> skeleton, double frame_rate_hz,
       Eigen::Matrix3Xd root_positions, std::vector<Eigen::Quaterniond> rotations,
       Eigen::Matrix3Xd translations = {});

  [[nodiscard]] const Skeleton& skeleton() const noexcept { return *skeleton_; }
  [[nodiscard]] const std::shared_ptr<const Skeleton>& shared_skeleton() const noexcept {
    return skeleton_;
  }
  [[nodiscard]] double frame_rate_hz() const noexcept { return frame_rate_hz_; }
  [[nodiscard]] int frame_count() const noexcept {
    return static_cast<int>(root_positions_.cols());
  }
  [[nodiscard]] int joint_count() const noexcept { return skeleton_->joint_count(); }
  [[nodiscard]] double duration_s() const noexcept { return (frame_count() - 1) / frame_rate_hz_; }

  /// J rotations parent-from-joint at `frame`, in joint order. Valid while the clip lives.
  [[nodiscard]] std::span<const Eigen::Quaterniond> rotations(int frame) const;
  [[nodiscard]] const Eigen::Quaterniond& rotation(int frame, int joint) const {
    return rotations_[static_cast<std::size_t>(frame) * static_cast<std::size_t>(joint_count()) +
                      static_cast<std::size_t>(joint)];
  }
  /// 3 x F, metres, model space.
  [[nodiscard]] const Eigen::Matrix3Xd& root_positions() const noexcept { return root_positions_; }
  /// True if joints other than the root animate their position.
  [[nodiscard]] bool has_translations() const noexcept { return translations_.cols() > 0; }
  /// Offset of a joint from its parent at `frame`, metres: its own column if the clip animates
  /// positions, else the root position or the rest offset.
  [[nodiscard]] Eigen::Vector3d translation(int frame, int joint) const;

  /// Frames [begin, end). @throws Error{kUsage} unless 0 <= begin < end <= F.
  [[nodiscard]] Clip slice(int begin, int end) const;

 private:
  std::shared_ptr<const Skeleton> skeleton_;  // never null
  double frame_rate_hz_;
  Eigen::Matrix3Xd root_positions_;            // 3 x F, metres, model space
  std::vector<Eigen::Quaterniond> rotations_;  // F*J, frame-major
  Eigen::Matrix3Xd translations_;              // empty or 3 x F*J, metres, parent space
};

}  // namespace laban::motion
