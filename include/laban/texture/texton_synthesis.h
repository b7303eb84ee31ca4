#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "laban/texture/constrained_synthesis.h"
#include "laban/texture/motion_texture.h"

namespace laban::texture {

/// A frame of a texton that is given.
struct PinnedFrame {
  int frame = 0;
  Eigen::VectorXd observation;  ///< d
};

/// Observations as the texton's own states show them: what lies outside its basis is dropped.
[[nodiscard]] Eigen::MatrixXd reproject(const Texton& texton,
                                        const Eigen::Ref<const Eigen::MatrixXd>& observations);

/// A curve through given columns that is 0 away from them: beside a run of neighbouring frames it
/// goes on with the run's own slope (a single frame has none) and comes to rest at 0 over
/// `ramp_frames` by a cubic, or joins the next run where that is nearer than two ramps. C1.
/// @param frames  ascending. @param values  d x frames.
[[nodiscard]] Eigen::MatrixXd ramp_between(int length, const std::vector<int>& frames,
                                           const Eigen::Ref<const Eigen::MatrixXd>& values,
                                           int ramp_frames);

/// Makes motion of textons ([Li02, 5]), and keeps the factors of the systems that it has solved.
/// Not for two threads at once.
class TextonSynthesizer {
 public:
  /// @param textons      must outlive this.
  /// @param ramp_frames  over which what a texton cannot show of a pinned frame comes and goes.
  explicit TextonSynthesizer(std::span<const Texton> textons, int ramp_frames = 30)
      : textons_(textons), ramp_frames_(ramp_frames) {}

  /// A draw from the texton given some frames of it, those hit exactly; C1 beside them.
  /// @param pins      ascending, frames 0 and 1 among them.
  /// @param noise     as of ConstrainedStates::solve.
  /// @param residual  d x length: what the motion has beside what the texton shows (its part inside
  ///                  the basis is ignored); none (no column): nothing.
  /// @returns d x length observations.
  /// @throws as ConstrainedStates.
  [[nodiscard]] Eigen::MatrixXd synthesize(int texton, int length,
                                           std::span<const PinnedFrame> pins,
                                           const Eigen::Ref<const Eigen::MatrixXd>& noise,
                                           const Eigen::MatrixXd& residual = {});

  /// The factor for known frames, made or found again.
  [[nodiscard]] const ConstrainedStates& system(int texton, int length,
                                                const std::vector<int>& known);

 private:
  using Key = std::pair<std::pair<int, int>, std::vector<int>>;

  std::span<const Texton> textons_;
  int ramp_frames_;
  std::map<Key, ConstrainedStates> systems_;
};

/// A texton's motion with frames moved to where they were asked to be.
struct EditedTexton {
  Eigen::MatrixXd observations;  ///< d x l
  /// How far the pins lie from what the texton does, in its own deviations (rms over pins and
  /// dimensions): of its states given the rest of the motion, and of what it cannot show. 1 is an
  /// ordinary variation, beyond 3 the texton is spoilt.
  double state_deviations = 0.0;
  double residual_deviations = 0.0;

  [[nodiscard]] bool is_far_off() const {
    return state_deviations > 3.0 || residual_deviations > 3.0;
  }
};

/// Moves frames of a motion to given observations ([Li02, Fig. 11]): the texton's system solved
/// with the motion's own innovations and the pins as further known frames, so that a frame pinned
/// to where it is changes nothing. The first two and last two frames stay unless pinned.
/// @param original  d x l, l >= 5.
/// @param pins      ascending.
/// @throws Error{kUsage} if the original is shorter or a pin does not fit it.
[[nodiscard]] EditedTexton edit_texton(const Texton& texton,
                                       const Eigen::Ref<const Eigen::MatrixXd>& original,
                                       std::span<const PinnedFrame> pins, int ramp_frames = 30);

}  // namespace laban::texture
