#pragma once

#include <vector>

#include <Eigen/Dense>

#include "laban/texture/texton_fit.h"

#include "texture/term_table.h"

namespace laban::texture {

/// Joins textons of a greedy start that are one by BIC: pairs of which one texton, fitted to the
/// segments of both, loses less log-likelihood than half log(N) for each parameter it saves, N the
/// frames of the corpus; the best pair first. (Ours: the greedy start fits a texton to T_min
/// frames, which show a part of what it does, so that the same motion seen again is often taken for
/// new.) A texton that does not predict a segment within the threshold is not made: of a short
/// corpus BIC would make one texton of everything.
/// @param segments  of all takes, labels 0 .. Nt - 1, each with a segment.
/// @param threshold  as GreedyOptions::threshold.
/// @returns the segments, labels renumbered without gap in order of first appearance.
[[nodiscard]] std::vector<Segment> merge_textons(const Eigen::MatrixXd& observations,
                                                 const FloatObservations& y,
                                                 const std::vector<Segment>& segments,
                                                 double threshold, const TextonFit& fit,
                                                 int threads);

}  // namespace laban::texture
