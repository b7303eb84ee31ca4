#pragma once

#include <limits>
#include <vector>

#include <Eigen/Dense>

#include "laban/texture/texton_fit.h"

#include "texture/term_table.h"

namespace laban::texture {

struct GreedyOptions {
  int min_frames = 60;
  /// Root mean square one-step prediction error of a row, observation units, that a texton may
  /// have.
  double threshold = 0.0;
  /// With so many textons the best is taken whatever its error.
  int most_textons = std::numeric_limits<int>::max();
  TextonFit fit;
};

/// Greedy initialisation of [Li02, 4.1] (METHODS 2.2): a texton is fitted to T_min frames and
/// extended, without refit, while its error over the segment is below the threshold; then the
/// textons so far are tried on the next T_min frames. A tail shorter than T_min joins the segment
/// before it.
/// @returns segments of all takes in order, textons numbered as they appear.
[[nodiscard]] std::vector<Segment> segment_greedily(const Eigen::MatrixXd& observations,
                                                    const FloatObservations& y,
                                                    const std::vector<Take>& takes,
                                                    const GreedyOptions& options);

}  // namespace laban::texture
