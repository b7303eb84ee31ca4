#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/rng.h"
#include "laban/texture/motion_texture.h"

namespace laban::texture {

/// How one joint is turned, about its own axes, on top of going to where two motions meet and on
/// from there, so that it gets there by what it was seen to do.
struct JointDetour {
  int joint = 0;
  Eigen::Matrix3Xd leaving;   ///< radians, of the last frames, up to the second that meets
  Eigen::Matrix3Xd entering;  ///< of the first frames, from the first that meets
};

/// From one texton to the next: frames `leave` and `leave` + 1 of the corpus, near the end of
/// segment `leaving`, become frames `enter` and `enter` + 1, near the beginning of `entering`.
struct TextonChange {
  int leaving = 0;
  int entering = 0;
  int leave = 0;
  int enter = 0;
  /// What the two frames are where they meet, d x 2 observations, but for joints that make a
  /// detour: halfway between the two places.
  Eigen::MatrixXd meeting;
  /// Joints that would so be led far from all that they were seen to do.
  std::vector<JointDetour> detours;
  bool jump = false;  ///< nothing in the captures goes from the one texton to the other

  /// Whether the capture itself went on so: there is nothing to join.
  [[nodiscard]] bool is_captured() const noexcept { return leave == enter; }
};

/// A random walk over textons, endless (METHODS 2.3, Texton path (a)).
///
/// The next texton is drawn as the row of M says, by drawing one of the corpus' own changes from
/// this one. If that was not made by the very segment that is walked on, the walk changes over to
/// where it was made at the frames where poses and velocities are nearest, unless even those are
/// farther apart than frames of the captures a quarter of a second apart are: then it goes on as
/// its own segment did. So M is followed as far as poses let it be.
///
/// A take that is near its end, or a texton that nothing is known to follow, is left for any
/// segment: at the frames, some of the last seconds' and some of all others, where poses and
/// velocities are near, little of the take is lost, little is repeated that was walked on lately,
/// and no joint on its way from the one pose to the other gets far from what it was seen to do.
/// Where a crossing leads to frames that can only be left by such turns, it costs what they do; an
/// end of a take is walked on the more seldom the more it costs to come back from there.
class TextonWalk {
 public:
  /// @param texture  must outlive the walk; at least one segment.
  /// @param first    texton to begin with; nullopt: a take's first, the likelier the longer the
  /// take.
  /// @throws Error{kUsage} if there is no such texton, or it has no segment.
  TextonWalk(const MotionTexture& texture, std::optional<int> first, base::Rng rng);
  TextonWalk(TextonWalk&&) noexcept;
  TextonWalk& operator=(TextonWalk&&) noexcept;
  ~TextonWalk();

  [[nodiscard]] int texton() const noexcept;
  /// The segment now walked on, and the frame of the corpus at which it was entered.
  [[nodiscard]] int segment() const noexcept;
  [[nodiscard]] int entered() const noexcept;
  /// Goes on to the next texton.
  TextonChange next();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace laban::texture
