#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/rng.h"

namespace laban::manifold {

struct KMeansOptions {
  int clusters = 10;  ///< >= 1; no more than samples are used
  int restarts = 10;  ///< the best of so many beginnings, >= 1
  /// Each beginning first breathes in so many centres more, then fewer, at most; >= 0.
  int breath = 5;
  /// The best of them then swaps one centre, any, for a sample, any, so often, >= 0; kept if
  /// better.
  int swaps = 5000;
  int max_iterations = 300;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct KMeans {
  Eigen::MatrixXd centers;  ///< D x K
  std::vector<int> labels;  ///< N, nearest centre, the first of equals
  double inertia = 0.0;     ///< sum of squared distances to the nearest centre
  int iterations = 0;       ///< of the best beginning
  bool converged = false;   ///< labels stood still before max_iterations
};

/// Lloyd's k-means [Lloyd82], begun by greedy k-means++ [Arthur07]: each further centre is the best
/// of 2 + log K samples drawn with probability proportional to their squared distance from the
/// centres so far. A cluster that falls empty takes the sample farthest from its centre. Breathing
/// [Fritzke20] and random swaps of a centre [Franti18] then lead out of the nearest optimum.
///
/// @param x  D x N, N >= 1, finite.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if x is empty or not finite.
/// Time O((restarts * breath + swaps) * iterations * N * D * K). The result depends on samples,
/// options and rng alone.
[[nodiscard]] KMeans k_means(const Eigen::Ref<const Eigen::MatrixXd>& x,
                             const KMeansOptions& options, base::Rng& rng);

/// Reconstruction error against the number of clusters, and where it bends.
struct ElbowCurve {
  std::vector<double> errors;  ///< errors[k - 1]: root mean squared distance with k clusters
  int clusters = 1;            ///< at the elbow
};

/// The number of clusters at the elbow of the reconstruction error: the first from which three
/// further clusters lower it by less than 1 % each of the error of one cluster. Unlike the point
/// farthest from the chord of the curve it does not depend on how far the curve is followed, and a
/// loop of poses, whose error falls as 1 / k, gets 10, a surface, as 1 / sqrt k, 14: the paper
/// finds 10 for a walk and 15 for a ballet.
/// @param most  >= 1; no more than samples are tried.
/// Of three beginnings at most and without swaps, whatever `options` say.
/// @throws as k_means.
[[nodiscard]] ElbowCurve find_elbow(const Eigen::Ref<const Eigen::MatrixXd>& x, int most,
                                    const KMeansOptions& options, base::Rng& rng);

}  // namespace laban::manifold
