#pragma once

#include <vector>

#include <Eigen/Dense>

#include "laban/texture/motion_texture.h"
#include "laban/texture/texton_fit.h"

namespace laban::texture {

struct GapInfillOptions {
  /// Frames on either side of the gap by which textons are chosen, at most.
  int context = 15;
  /// Textons whose likeliest motions are averaged, each by its probability.
  int textons = 8;
  /// Log-likelihoods are divided by this before they become probabilities: frames of motion are far
  /// from independent, and textons surer of themselves than they are right.
  double temperature = 100.0;
  /// Whether one texton of all takes is among those weighed.
  bool texton_of_all = true;
};

/// Fills gaps of motion by what a texture knows: the likeliest motion of textons between the two
/// frames before the gap and the two after it.
///
/// Textons are weighed by how likely they make the frames on both sides, and the way from the one
/// to the other: log p(frames before) + log p(frames after) + log p(two frames after | two before),
/// all exact. Among them is one of all the texture's takes together, in nearly all of their
/// dimensions: it knows of any motion how it goes on for a moment, where no other texton fits. What
/// lies outside a texton's basis is carried over the gap linearly, and the root path's closing
/// error is spread over it.
///
/// What has been made so is drawn towards arcs of rotations (slerp) from the one side to the other,
/// as much as leaves the least error in gaps of 5 to 60 frames of the texture's own takes where it
/// strayed as far from the arcs, filled
/// by the texton of all (stacking, Wolpert 1992). A gap does not tell how often a joint turned
/// about itself in it; it turns the shorter way.
class GapInfill {
 public:
  explicit GapInfill(const MotionTexture& texture, const GapInfillOptions& options = {});

  /// @param y    d x F, of which frames [begin, end) and the step to frame `end`, which begins in
  /// the
  ///             gap, are not looked at; at least two frames on either side.
  /// @param way  planar step from frame begin - 1 to frame `end`: x, z in leg lengths in the
  /// heading
  ///             frame of begin - 1, and the yaw, radians.
  /// @returns d x F: y with the gap filled, and the step to frame `end` such that `way` is hit.
  /// @throws Error{kUsage} if the gap has no two frames on a side.
  [[nodiscard]] Eigen::MatrixXd fill(const Eigen::Ref<const Eigen::MatrixXd>& y, int begin, int end,
                                     const Eigen::Vector3d& way) const;

  /// The frame that follows `y`: what textons make of its last two frames (what one cannot show
  /// goes on at constant velocity) and constant velocity itself, each weighed by how well it would
  /// have told the last frames: by the inverse fourth power of its squared error.
  /// @param y  d x F, F >= 3.
  /// @throws Error{kUsage} if F < 3.
  [[nodiscard]] Eigen::VectorXd next(const Eigen::Ref<const Eigen::MatrixXd>& y) const;

 private:
  [[nodiscard]] double trust(int gap, double size) const;
  void learn_trust(const MotionTexture& texture);

  GapInfillOptions options_;
  ObservationSpace space_;
  /// How far to trust textons in gaps of one length: the share at each of some sizes of what they
  /// make beside straight arcs.
  struct Trust {
    std::vector<double> sizes;  // ascending
    std::vector<double> shares;
  };
  std::vector<Trust> trusts_;  // at the gaps of kTrustGaps; none: 1
  std::vector<Texton> textons_;
  std::vector<TextonLikelihood> likelihoods_;
};

}  // namespace laban::texture
