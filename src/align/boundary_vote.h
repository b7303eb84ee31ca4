#pragma once

#include <span>
#include <vector>

#include <Eigen/Dense>

#include "laban/align/one_stage_dp.h"
#include "laban/base/progress.h"

namespace laban::align {

/// How boundaries are voted on.
struct BoundaryVote {
  int voters = 0;        ///< most fragments of a content that are asked, >= 1
  int stride = 1;        ///< every stride-th frame is looked at, >= 1
  int reach_frames = 0;  ///< farthest that a boundary moves, input frames
  /// How fast the input moves at each of its frames, as a share of its quick moments; empty: places
  /// in motion are as good as still ones.
  std::vector<double> speed = {};
  /// What a place amid quick motion costs, in looked-at frames of the snippets' mean cost; >= 0.
  double stillness = 1.0;
  /// How much dearer the two snippets may become by their own fragments, as a share; >= 0.
  double most_rise = 0.0;
};

/// Moves each boundary between snippets of two contents to where several fragments of the one
/// before and of the one after agree best, not the best one of each alone: what one take does as it
/// begins and ends is its own, what its content does is in most of them.
///
/// The voters are the fragments of a content that are nearest to the snippet as it stands. The cost
/// of a place is the mean of the voters' path costs of all from the snippet before's begin to
/// there, and the same of all from there to the snippet after's end, each voter's weight one over
/// the square of his cost as it stands: who fits twice as well counts four times. To that comes how
/// fast the input moves there, against its quick moments: people pause between two actions rather
/// than amid one. Places where the snippets' own fragments fit clearly worse are left out: they are
/// what the snippets are matched to. Snippets keep their fragments; their costs are those of their
/// new frames.
///
/// @param input      D x T.
/// @param fragments  each D x T_i.
/// @param groups     content of each fragment.
/// @param snippets   cover the input.
/// @param progress   may be null.
void vote_on_boundaries(const Eigen::MatrixXd& input, std::span<const Eigen::MatrixXd> fragments,
                        std::span<const int> groups, const BoundaryVote& vote,
                        std::vector<Snippet>& snippets, base::Progress* progress = nullptr);

}  // namespace laban::align
