#pragma once

#include <vector>

#include <Eigen/Dense>

namespace laban::loop {

/// What it costs to cut each edge of the joints x time graph of an overlap [Graphcut, section 4.1].
/// Rows are joints, columns frames of the overlap; joints form a tree (a frame's graph is its
/// skeleton).
struct SeamCosts {
  std::vector<int> parents;  ///< of each row, -1 for the root (row 0); parents come first
  /// R x (N - 1): column t is the edge of a row from frame t to t + 1, >= 0; infinite where the row
  /// may not switch.
  Eigen::MatrixXd along_time;
  /// R x N: the edge from a row to its parent's at frame t, finite and >= 0; row 0 unused.
  Eigen::MatrixXd to_parent;
};

struct Seam {
  /// For each row the first frame, 1 .. N - 1, that comes from the incoming clip.
  std::vector<int> switch_frames;
  double cost = 0.0;  ///< capacity of all edges that are cut
};

/// The minimum cut between the first column (all of the outgoing clip) and the last (all of the
/// incoming), infinite arcs keeping each row from switching back, so that every joint switches
/// exactly once and each at its own frame.
///
/// Exact. Where a frame's graph is a tree, as a skeleton is, the minimum cut needs no maximum flow:
/// cutting parent and child at frames p and s costs |V(s) - V(p)| with V the running sum of the
/// edges between the two, so the best frame of a child for every frame of its parent is a
/// distance transform, two passes along time, and the whole O(R N). It equals Boykov-Kolmogorov's
/// cut (a test) at a thousandth of the time.
///
/// Ties go to the earliest frame of the root, then of its children.
/// @throws Error{kData} if sizes disagree, N < 2, a parent does not come first, a cost is negative
///         or not a number, or some row may switch nowhere.
[[nodiscard]] Seam minimum_seam(const SeamCosts& costs);

/// What a cut costs, all edges added up one by one: what minimum_seam minimises.
[[nodiscard]] double seam_cost(const SeamCosts& costs, const std::vector<int>& switch_frames);

/// What an edge of the graph is charged for.
enum class SeamMetric {
  /// M = ||A(s) - B(s)|| + ||A(t) - B(t)|| [Graphcut, eq. 8], like the sum of differences of
  /// [Kwatra03].
  kDifference,
  /// 1 - exp(-M / G), G the gradients along the edge [Graphcut, eq. 7, 9]; the paper's exp(-M / G)
  /// is a
  /// similarity, of which a cut must be charged the complement (METHODS 3.2). Cheap in fast motion.
  kGradient,
};

/// Costs of an overlap of N frames in which row r of the outgoing clip is outgoing[r], D x N, and
/// of the incoming one incoming[r] (unit quaternions in one hemisphere, of the root its height
/// too).
/// @param parents       as SeamCosts::parents.
/// @param weights       of each row's costs, > 0.
/// @param keep_columns  so many columns at either end cannot be switched at: a blend needs them.
/// @throws Error{kData} if sizes disagree or keep_columns leaves no edge.
[[nodiscard]] SeamCosts seam_costs(const std::vector<Eigen::MatrixXd>& outgoing,
                                   const std::vector<Eigen::MatrixXd>& incoming,
                                   const std::vector<int>& parents, const Eigen::VectorXd& weights,
                                   SeamMetric metric, int keep_columns);

/// Weight of the outgoing clip at frame p of a blend of k frames [Graphcut, eq. 12]:
/// 2 ((p+1)/k)^3 - 3 ((p+1)/k)^2 + 1 for 0 <= p < k, 1 before, 0 after. p may be fractional, from
/// -1 on; k >= 1.
[[nodiscard]] double blend_weight(double p, double k);

}  // namespace laban::loop
