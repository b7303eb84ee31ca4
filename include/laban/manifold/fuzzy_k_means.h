#pragma once

#include <string>
#include <vector>

#include <Eigen/Dense>

namespace laban::manifold {

struct FuzzyKMeansOptions {
  double fuzzifier = 2.0;  ///< m > 1; towards 1 memberships become hard
  int max_iterations = 1000;
  /// Ends when no membership changes by more, > 0.
  double tolerance = 1e-6;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct FuzzyKMeans {
  Eigen::MatrixXd centers;      ///< D x K
  Eigen::MatrixXd memberships;  ///< K x N, >= 0, columns sum to 1
  double objective = 0.0;       ///< J = sum of u^m |x - c|^2 [Bezdek81]
  double first_objective = 0.0;
  int iterations = 0;
  bool converged = false;
};

/// Fuzzy k-means [Bezdek81]: u_kn = 1 / sum_j (d_kn / d_jn)^(2 / (m - 1)), c_k = sum u^m x / sum
/// u^m, in turn; J never rises. A sample on a centre belongs to it (to all of those it lies on,
/// evenly).
///
/// @param x        D x N, @param centers  D x K to begin from, e.g. k-means'.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if sizes differ, are 0 or a value
///         is not finite.
[[nodiscard]] FuzzyKMeans fuzzy_k_means(const Eigen::Ref<const Eigen::MatrixXd>& x,
                                        const Eigen::Ref<const Eigen::MatrixXd>& centers,
                                        const FuzzyKMeansOptions& options = {});

}  // namespace laban::manifold
