#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

namespace laban::align {

/// DTW of every pair of N fragments; both matrices are N x N, symmetric, 0 on the diagonal.
struct PairCosts {
  Eigen::MatrixXd cost;       ///< sum of local distances along the path (SSD)
  Eigen::MatrixXd mean_cost;  ///< SSD / L, the mean of a path cell
};

/// Aligns all pairs i < j of fragments, dtw_cost(features[i], features[j]) in single precision: to
/// 1e-5 of the mean cell, equal fragments at exactly 0. Machines with and without AVX2 and FMA
/// agree to that; on one machine the result is the same bytes for any number of threads.
/// @param features  each D x T_i with one D.
/// @param threads   0: all cores.
/// @throws Error{kData} if a sequence is empty, D differs or a value is not finite.
/// Time O(D sum T_i T_j); memory 12 D bytes a frame.
[[nodiscard]] PairCosts all_pair_costs(std::span<const Eigen::MatrixXd> features, int threads = 1);

/// Distances for clustering: sqrt(c_ij / sqrt(s_i s_j)), s_i the cost from fragment i to its
/// `neighbors`-th nearest other one (self-tuning [ZelnikManor04]).
///
/// Path costs differ in scale from content to content and from fragment to fragment: large, rare
/// movements are far from everything and would each be a group of their own, small ones are near
/// all. Divided by the scale of both neighbourhoods, 1 is "as far as neighbours are" everywhere.
/// @param mean_cost  N x N of all_pair_costs, N >= 2.
/// @param neighbors  >= 1; at most N - 1 are used.
/// @throws Error{kUsage} for neighbors; Error{kData} for the matrix, as content_groups.
[[nodiscard]] Eigen::MatrixXd locally_scaled(const Eigen::Ref<const Eigen::MatrixXd>& mean_cost,
                                             int neighbors = 5);

/// When agglomerative clustering stops: exactly one of the two is given.
struct ClusterOptions {
  std::optional<int> group_count = std::nullopt;  ///< at this many groups, 1 .. N
  std::optional<double> threshold =
      std::nullopt;  ///< when the nearest two groups are farther apart than this

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Agglomerative clustering by average linkage: every item starts alone, and the two groups with
/// the least mean distance between their members are joined until the options say stop.
///
/// @param distances  N x N, symmetric, N >= 1; `locally_scaled` path costs do best.
/// @returns the group of each item, groups numbered 0, 1, .. by their first item.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if the matrix is not square,
///         symmetric and finite. Ties go to the lowest indices. Time O(N^3), memory O(N^2).
[[nodiscard]] std::vector<int> content_groups(const Eigen::Ref<const Eigen::MatrixXd>& distances,
                                              const ClusterOptions& options);

/// What a good match inside a group costs (DESIGN 5, "No content match").
struct GroupCostStatistics {
  double median = 0.0;     ///< of the mean path costs of all pairs inside the group; 0 without any
  double threshold = 0.0;  ///< a match dearer than this is no content match
  bool has_pairs = false;  ///< the group has two members or more
};

/// How `group_cost_statistics` sets thresholds.
struct MatchThreshold {
  /// Which of the group's fragments says what a match may cost, by the costs to their nearest other
  /// members, in [0, 100]: 100 is the one that is farthest from all others.
  double percentile = 100.0;
  /// Times its cost, > 0; 1.5 leaves room for a performer unlike those of the database.
  double margin = 1.5;
};

/// For each group 0 .. G - 1 the median of the mean path costs of its pairs, and the threshold for
/// "no content match": a percentile, over the group's fragments, of a fragment's cost to its
/// nearest other member, times a margin. A group without pairs takes the largest threshold of the
/// others (infinity if there is none).
///
/// @param mean_cost  N x N of all_pair_costs or unseen_costs; of an entry (i, j) and its mirror,
///                   i < j, the median asks the first. Infinite ones are of pairs not to be asked.
/// @param groups     N group numbers, 0 .. G - 1.
/// @throws Error{kData} if sizes differ, N = 0 or a group is negative; Error{kUsage} for the
///         threshold's percentile or margin.
[[nodiscard]] std::vector<GroupCostStatistics> group_cost_statistics(
    const Eigen::Ref<const Eigen::MatrixXd>& mean_cost, std::span<const int> groups,
    const MatchThreshold& threshold = {});

}  // namespace laban::align
