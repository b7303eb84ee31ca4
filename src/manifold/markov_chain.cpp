#include "laban/manifold/markov_chain.h"

#include <algorithm>
#include <string>

#include "laban/base/error.h"

namespace laban::manifold {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;

/// States other than i that may follow it, the likeliest first, at most two.
std::vector<int> likeliest(const Eigen::RowVectorXd& row, int i) {
  std::vector<int> best;
  for (int rank = 0; rank < 2; ++rank) {
    int found = -1;
    for (int j = 0; j < row.size(); ++j) {
      if (j == i || row[j] <= 0.0 || (rank == 1 && j == best.front())) continue;
      if (found < 0 || row[j] > row[found]) found = j;
    }
    if (found < 0) break;
    best.push_back(found);
  }
  return best;
}

}  // namespace

Eigen::MatrixXd count_transitions(std::span<const std::vector<int>> sequences, int states) {
  Eigen::MatrixXd counts = Eigen::MatrixXd::Zero(states, states);
  for (const std::vector<int>& sequence : sequences) {
    for (const int state : sequence) {
      if (state >= 0 && state < states) continue;
      throw Error(ErrorKind::kData, "count_transitions: state " + std::to_string(state) +
                                        " (must be 0 .. " + std::to_string(states - 1) + ")");
    }
    for (std::size_t t = 1; t < sequence.size(); ++t) counts(sequence[t - 1], sequence[t]) += 1.0;
  }
  return counts;
}

TransitionMatrix transition_matrix(const Eigen::Ref<const Eigen::MatrixXd>& counts) {
  TransitionMatrix matrix = counts;
  for (Index i = 0; i < matrix.rows(); ++i) {
    const double sum = matrix.row(i).sum();
    if (sum > 0.0) matrix.row(i) /= sum;
  }
  return matrix;
}

TransitionMatrix perturbed(const TransitionMatrix& matrix, double scale, base::Rng& rng) {
  TransitionMatrix noisy = matrix;
  if (scale == 0.0) return noisy;
  for (Index i = 0; i < noisy.rows(); ++i) {
    for (Index j = 0; j < noisy.cols(); ++j) {
      noisy(i, j) = std::max(0.0, noisy(i, j) + scale * rng.normal());
    }
    const double sum = noisy.row(i).sum();
    if (sum > 0.0) {
      noisy.row(i) /= sum;
    } else {
      noisy.row(i) = matrix.row(i);
    }
  }
  return noisy;
}

std::vector<int> walk_states(const TransitionMatrix& matrix, int start) {
  return walk_states([&matrix](int, int state) { return matrix.row(state); },
                     static_cast<int>(matrix.rows()), start, -1);
}

std::vector<int> walk_states(const TransitionRow& row, int state_count, int start, int before) {
  if (start < 0 || start >= state_count) {
    throw Error(ErrorKind::kUsage, "walk_states: start = " + std::to_string(start) +
                                       " (must be 0 .. " + std::to_string(state_count - 1) + ")");
  }
  std::vector<int> states{start};
  std::vector<bool> visited(static_cast<std::size_t>(state_count), false);
  for (;;) {
    visited[static_cast<std::size_t>(states.back())] = true;
    if (states.size() > 1) before = states[states.size() - 2];
    const std::vector<int> next = likeliest(row(before, states.back()), states.back());
    if (next.empty()) return states;
    const auto fresh = std::find_if(next.begin(), next.end(),
                                    [&](int j) { return !visited[static_cast<std::size_t>(j)]; });
    states.push_back(fresh != next.end() ? *fresh : next.front());
    if (fresh == next.end()) return states;
  }
}

Eigen::VectorXd mean_stay(const Eigen::Ref<const Eigen::MatrixXd>& counts) {
  Eigen::VectorXd stay(counts.rows());
  for (Index i = 0; i < counts.rows(); ++i) {
    const double left = counts.row(i).sum() - counts(i, i);
    stay[i] = left > 0.0 ? counts.row(i).sum() / left : std::max(1.0, counts(i, i));
  }
  return stay;
}

}  // namespace laban::manifold
