#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/progress.h"

namespace laban::manifold {

/// A Kohonen map: a codebook of D-vectors on a lattice of rows x columns nodes. Node (row, column)
/// is codebook column row * columns + column.
struct SelfOrganizingMap {
  int rows = 0;
  int columns = 0;
  Eigen::MatrixXd codebook;  ///< D x rows * columns

  /// Lattice place of a node: (column, row).
  [[nodiscard]] Eigen::Vector2d position(int node) const {
    const int row = node / columns;
    return {static_cast<double>(node % columns), static_cast<double>(row)};
  }
};

struct SomOptions {
  int rows = 65;     ///< [Manifold] 5.1: smaller lattices put different poses on one node
  int columns = 65;  ///< 2 .. 1000, as rows
  int epochs = 50;   ///< passes over all samples, >= 1
  /// Width (standard deviation, nodes) of the Gaussian neighbourhood in the first epoch, > 0;
  /// nullopt: half the longer side [Kohonen01]. It falls by a constant factor to `last_radius`.
  std::optional<double> first_radius;
  double last_radius = 0.5;  ///< in the last epoch, > 0
  /// Rounds after the epochs in which nodes beside a unit are drawn to its samples, >= 0.
  int mending_rounds = 8;
  /// Threads of the search for best-matching units; 0: all cores. The result does not depend on it.
  int threads = 1;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Learns a map by the batch rule [Kohonen01, ch. 3.6]: every epoch finds the best-matching unit of
/// each sample and puts each node at the mean of all samples weighted by the neighbourhood between
/// node and unit. Begins on the plane of the first two principal components, two standard
/// deviations to each side, so nothing is random.
///
/// Units are searched in single precision by matrix product; sums a unit are kept in double and
/// smoothed along rows, then columns, since the neighbourhood is a product of two. It is a Gaussian
/// on a faint one of a ten-thousandth the height and eight times the width, which keeps nodes in
/// order where samples are fewer than nodes (ours). A node so far from all units that its weights
/// vanish keeps its place.
///
/// Where the second-best unit of a sample is no neighbour of its best, the nearest neighbour that
/// is no unit itself is then drawn to the sample until it is second best (ours): what surrounds a
/// unit looks like it. No sample comes to lie farther from its unit by that; where it does not
/// suffice, neighbours that are units are drawn too, as little as will do.
///
/// @param x         D x N, a column a sample, N >= 1, finite.
/// @param progress  may be null; told after each epoch.
/// @throws Error{kUsage} if `options` has problems or the work is stopped; Error{kData} if x is
///         empty or not finite.
/// Time O(epochs * N * D * nodes).
[[nodiscard]] SelfOrganizingMap fit_som(const Eigen::Ref<const Eigen::MatrixXd>& x,
                                        const SomOptions& options = {},
                                        base::Progress* progress = nullptr);

/// The node nearest to each column of x, and the second nearest; the first of equals.
struct BestUnits {
  std::vector<int> first;
  std::vector<int> second;  ///< the same as `first` on a map of one node
};
/// @throws Error{kData} if x has another number of rows than the codebook.
[[nodiscard]] BestUnits best_matching_units(const SelfOrganizingMap& map,
                                            const Eigen::Ref<const Eigen::MatrixXd>& x);

/// How well a map fits samples [Kiviluoto96].
struct MapErrors {
  double quantization = 0.0;  ///< mean distance of samples to their best-matching units
  double topographic = 0.0;   ///< share of samples whose two best units are not among 8 neighbours
};
/// @throws as best_matching_units; Error{kData} if there is no sample.
[[nodiscard]] MapErrors map_errors(const SelfOrganizingMap& map,
                                   const Eigen::Ref<const Eigen::MatrixXd>& x);

/// For each node the mean distance to its neighbours in row and column (U-matrix [Ultsch90]):
/// rows x columns.
[[nodiscard]] Eigen::MatrixXd unit_distances(const SelfOrganizingMap& map);

}  // namespace laban::manifold
