#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/rng.h"

namespace laban::manifold {

struct GaussianMixtureOptions {
  int max_iterations = 500;
  /// Ends when the mean log-likelihood rises by less, > 0.
  double tolerance = 1e-6;
  /// Added to every covariance's diagonal, in squared units of the samples, >= 0 (scikit-learn's).
  double floor = 1e-6;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct GaussianMixture {
  Eigen::VectorXd weights;                   ///< K, sum 1
  Eigen::MatrixXd means;                     ///< D x K
  std::vector<Eigen::MatrixXd> covariances;  ///< K of D x D, positive definite
  Eigen::MatrixXd responsibilities;          ///< K x N, columns sum to 1
  double mean_log_likelihood = 0.0;          ///< of a sample
  double first_mean_log_likelihood = 0.0;    ///< after the first M-step
  int iterations = 0;
  bool converged = false;
};

/// A mixture of Gaussians with full covariances by EM [Dempster77].
///
/// @param x       D x N, @param labels  N clusters 0 .. K - 1 to begin from, e.g. k-means'.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if sizes differ, there is no
///         sample, a label is negative or a value not finite; Error{kNumeric} if a covariance is
///         not positive definite (raise the floor).
/// Time O(iterations * K * (N D^2 + D^3)).
[[nodiscard]] GaussianMixture gaussian_mixture(const Eigen::Ref<const Eigen::MatrixXd>& x,
                                               const std::vector<int>& labels,
                                               const GaussianMixtureOptions& options = {});

struct MixtureSearchOptions {
  GaussianMixtureOptions em;
  int beginnings = 10;  ///< the given labels and k-means of one beginning each, >= 1
  /// Then so often in a round one component, any, is put on a few samples, any; 0: never.
  int swaps = 20;
  int carried = 6;            ///< of them, those most promising after one step of EM, >= 1
  int patience = 3;           ///< ends after so many rounds without a gain, >= 0
  int brief_iterations = 20;  ///< of EM for each of these, >= 1

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// EM ends in the optimum nearest to where it begins: the best of several short runs, improved by
/// random swaps of a component as in [Zhao12] while they help, and carried to its end.
///
/// @param x       D x N, @param labels  N clusters 0 .. K - 1, one of the beginnings.
/// @throws as gaussian_mixture. The result depends on samples, labels, options and rng alone.
[[nodiscard]] GaussianMixture best_gaussian_mixture(const Eigen::Ref<const Eigen::MatrixXd>& x,
                                                    const std::vector<int>& labels,
                                                    const MixtureSearchOptions& search,
                                                    base::Rng& rng);

}  // namespace laban::manifold
