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

 private:
  GapInfillOptions options_;
  Eigen::VectorXd step_scale_;
  std::vector<Texton> textons_;
  std::vector<TextonLikelihood> likelihoods_;
};

}  // namespace laban::texture
