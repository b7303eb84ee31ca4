#pragma once

#include <functional>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/rng.h"

namespace laban::manifold {

/// Transitions between K states: row = from, column = to; each row sums to 1, or is 0 for a state
/// that nothing is known to follow.
using TransitionMatrix = Eigen::MatrixXd;

/// Counts of each state's successors from frame to frame, within each sequence, never across two:
/// K x K whole numbers.
/// @throws Error{kData} if a state is not 0 .. K - 1.
[[nodiscard]] Eigen::MatrixXd count_transitions(std::span<const std::vector<int>> sequences,
                                                int states);

/// Counts with each row divided by its sum (a row of zeros stays) [Manifold eq. 3, whose sum is
/// over k, not j].
[[nodiscard]] TransitionMatrix transition_matrix(const Eigen::Ref<const Eigen::MatrixXd>& counts);

/// The matrix with normal noise of deviation `scale` on every entry, negative ones set to 0, rows
/// normalised [Manifold 4.2]. A scale of 0 gives the matrix back; a row that noise has emptied
/// stays as it was.
[[nodiscard]] TransitionMatrix perturbed(const TransitionMatrix& matrix, double scale,
                                         base::Rng& rng);

/// The paper's walk over states: from state i to the likeliest j other than i (eq. 5), and where
/// that has been visited, to the second likeliest if that has not ("would close a cycle too
/// early"); it ends where both have been visited, with the state that closes the cycle last, or
/// where nothing is known to follow. The first of equals wins.
/// @returns states from `start` on; at least that one.
/// @throws Error{kUsage} if `start` is not a state.
[[nodiscard]] std::vector<int> walk_states(const TransitionMatrix& matrix, int start);

/// What leads on from a state, given the state before it (-1: none): a row of the matrix.
using TransitionRow = std::function<Eigen::RowVectorXd(int before, int state)>;

/// The same over `states` states, where what follows may depend on where the walk comes from.
[[nodiscard]] std::vector<int> walk_states(const TransitionRow& row, int states, int start,
                                           int before);

/// Mean number of frames that each state lasts, from counts: 1 / (1 - p_ii) of the transition
/// matrix; a state that is never left lasts as long as it was seen (at least 1 frame).
[[nodiscard]] Eigen::VectorXd mean_stay(const Eigen::Ref<const Eigen::MatrixXd>& counts);

}  // namespace laban::manifold
