#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "laban/texture/motion_texture.h"

#include "texture/pose_index.h"

namespace laban::texture {

/// Ways of single joints from one motion to another through what they were seen to do.
///
/// Two poses of a limb may be far apart with nothing captured halfway between them: the arm went
/// round. A detour goes round too. It is the way through captured rotations of the joint that turns
/// least, frame by frame, from the motion it is a detour of (dynamic programming every tenth of a
/// second, over a few hundred rotations spread evenly over the captured ones), smoothed in time.
class JointDetours {
 public:
  /// @param texture, range  must outlive this.
  JointDetours(const MotionTexture& texture, const RotationRange& range)
      : texture_(texture),
        range_(range),
        nets_(static_cast<std::size_t>(motion::kStandardJointCount)) {}

  /// Turns on top of a joint's rotations that lead it through what it was seen in; they come from 0
  /// and go to 0 without speed, C1.
  /// @param rotations  of the joint, one a frame, from where it is still left alone to where it is
  ///                   again.
  /// @param free_turn  radians: so far from what was seen the rotations themselves may be.
  /// @returns 3 x frames, radians, in the joint's own axes; none if there is no time for a detour,
  ///          or it would lead the joint once around itself.
  [[nodiscard]] std::optional<Eigen::Matrix3Xd> around(
      int joint, std::span<const Eigen::Quaterniond> rotations, double free_turn);

 private:
  /// Turns that are in the way of nodes, as rotations on top of them. Empty: once around.
  [[nodiscard]] Eigen::Matrix3Xd cheapest(int joint, std::span<const Eigen::Quaterniond> rotations,
                                          double free_turn);
  /// Adds what leads rotations back to within `free_turn` of captured ones, smoothed by a Gaussian
  /// of that deviation in frames.
  /// @returns whether any was not within it.
  bool draw_near(int joint, std::span<const Eigen::Quaterniond> rotations, double free_turn,
                 double deviation, Eigen::Matrix3Xd& turns);
  /// How much any joint's turn from a frame to the next was captured to change at most, radians.
  double captured_bend();
  /// Captured rotations, a row each, spread evenly.
  const Eigen::MatrixX4f& net(int joint);

  const MotionTexture& texture_;
  const RotationRange& range_;
  std::vector<std::optional<Eigen::MatrixX4f>> nets_;  // of each joint, once it was asked for
  std::optional<double> bend_;
};

}  // namespace laban::texture
