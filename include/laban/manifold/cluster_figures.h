#pragma once

#include <vector>

#include <Eigen/Dense>

namespace laban::manifold {

/// How compact clusters are and how far apart: what clusterings of the same samples are compared by
/// [Manifold 4.1].
struct ClusterFigures {
  double within = 0.0;  ///< mean distance of samples to their cluster's centre
  double separation =
      0.0;  ///< mean distance of a centre to the nearest other one; 0 for one cluster
  /// Mean over clusters of the worst (within_i + within_j) / distance_ij [Davies79]; less is
  /// better; 0 for one cluster.
  double davies_bouldin = 0.0;
};

/// @param x  D x N, @param centers  D x K, @param labels  N of 0 .. K - 1.
/// Clusters without samples are left out of all but `separation`.
/// @throws Error{kData} if sizes differ, there is no sample or a label is out of range.
[[nodiscard]] ClusterFigures cluster_figures(const Eigen::Ref<const Eigen::MatrixXd>& x,
                                             const Eigen::Ref<const Eigen::MatrixXd>& centers,
                                             const std::vector<int>& labels);

/// For each column the row of its greatest value, the first of equals: memberships as labels.
[[nodiscard]] std::vector<int> hard_labels(const Eigen::Ref<const Eigen::MatrixXd>& memberships);

}  // namespace laban::manifold
