#pragma once

#include <vector>

#include <Eigen/Dense>

#include "laban/texture/motion_texture.h"
#include "laban/texture/texture_motion.h"

namespace laban::texture {

/// A way from one pose to another in a given time.
struct Choreography {
  std::vector<PlannedTexton> path;  ///< their lengths sum to the frames asked for
  double cost = 0.0;                ///< nats
  int jumps = 0;                    ///< changes that the captures never made
};

/// The cheapest path of textons between two poses whose lengths sum to `frames` ([Li02, Fig. 1],
/// "virtual choreographer"): by dynamic programming over frames and textons, exactly. What it
/// costs:
///
/// - how much less likely the first (last) texton is to hold the pose it begins (ends) with than
/// the
///   likeliest one is, two frames under its start moments;
/// - -log of each transition; one the captures never made only if there is no way without, then
///   the more the farther its poses lie apart;
/// - a length that is not that of one of the texton's segments: half the square of its log ratio to
///   the nearest over 0.1. First and last textons may be cut to half their shortest for nothing,
///   for their pose may be one from their middle.
///
/// @param from, to  two neighbouring frames each, d x 2.
/// @throws Error{kUsage} if an end has another size or frames is not in 5 .. 36000; Error{kData} if
///         no textons sum to so few frames.
/// Time O(frames Nt (Nt + lengths)), memory O(frames Nt).
[[nodiscard]] Choreography plan_choreography(const MotionTexture& texture,
                                             const Eigen::Ref<const Eigen::MatrixXd>& from,
                                             const Eigen::Ref<const Eigen::MatrixXd>& to,
                                             int frames);

}  // namespace laban::texture
