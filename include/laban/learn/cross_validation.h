#pragma once

#include <functional>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/rng.h"
#include "laban/learn/support_vector_regression.h"

namespace laban::learn {

/// Splits groups of samples into folds: groups in random order are dealt out in turn, so that folds
/// differ by at most one group; samples of one group (copies of one blend) share a fold.
///
/// @param groups      a label for each of the N samples.
/// @param fold_count  >= 2.
/// @returns a fold, 0 .. fold_count - 1, for each sample; with fewer groups than folds each group
///          is a fold of its own and the last folds are empty.
/// @throws Error{kUsage} for fold_count < 2; Error{kData} for fewer than two groups.
[[nodiscard]] std::vector<int> assign_folds(std::span<const int> groups, int fold_count,
                                            base::Rng& rng);

/// assign_folds of N samples, each its own group.
[[nodiscard]] std::vector<int> assign_folds(int sample_count, int fold_count, base::Rng& rng);

/// What cross-validation chose and the error it chose by.
struct CrossValidationChoice {
  int kernel = 0;            ///< index into the kernels offered (their widths); 0 if there are none
  double loss_weight = 1.0;  ///< U or C
  double epsilon = 0.0;      ///< SVR's tube; 0 for the others
  /// Weighted mean over all samples of the squared held-out residual, folds pooled (not a mean of
  /// fold means).
  double mean_squared_error = 0.0;
  Eigen::VectorXd residuals;  ///< N, held out, by which it was chosen
};

/// Held-out residuals y - f(x) of kernel ridge for every target at once, without refitting.
///
/// With G = (K + W^-1/U)^-1 the residual of the fold S is (G_SS)^-1 (G y)_S; targets are centred,
/// as a refit would do, by the weighted mean over the *other* folds.
///
/// @param kernel  N x N, @param targets  N x P, @param loss_weight  U > 0, @param folds  N folds.
/// @param sample_weights  w, N weights of the samples' losses, > 0; empty: all 1.
/// @returns N x P residuals (not weighted), equal to those of explicit refits.
/// @throws Error{kData} if sizes differ, one fold holds all samples or a weight is not > 0;
///         Error{kNumeric} if a system does not solve.
/// Time O(N^3), whatever the number of folds and targets.
[[nodiscard]] Eigen::MatrixXd kernel_ridge_held_out_residuals(
    const Eigen::Ref<const Eigen::MatrixXd>& kernel,
    const Eigen::Ref<const Eigen::MatrixXd>& targets, double loss_weight,
    std::span<const int> folds,
    const Eigen::Ref<const Eigen::VectorXd>& sample_weights = Eigen::VectorXd());

/// Told the held-out residuals (N x P) of one point of a grid.
using HeldOutVisitor = std::function<void(int kernel, double loss_weight,
                                          const Eigen::Ref<const Eigen::MatrixXd>& residuals)>;

/// Visits every point of the grid, kernel by kernel, with its held-out residuals, for selection by
/// any criterion. Points of the grid whose system does not solve are passed over.
///
/// @param kernels  N x N each (one a width), @param targets  N x P, @param sample_weights  as
/// above.
/// @throws Error{kUsage} if a list is empty; Error{kData} as above.
void visit_kernel_ridge_grid(
    std::span<const Eigen::MatrixXd> kernels, const Eigen::Ref<const Eigen::MatrixXd>& targets,
    std::span<const double> loss_weights, std::span<const int> folds, const HeldOutVisitor& visit,
    const Eigen::Ref<const Eigen::VectorXd>& sample_weights = Eigen::VectorXd());

/// The kernel and loss weight of least pooled squared error, for each target by itself; of equals
/// the first kernel, then the first loss weight. Points of the grid whose system does not solve are
/// passed over.
///
/// @param kernels  N x N each (one a width), @param targets  N x P, @param sample_weights  as
/// above.
/// @throws Error{kUsage} if a list is empty; Error{kData} as above; Error{kNumeric} if no point of
///         the grid solves.
[[nodiscard]] std::vector<CrossValidationChoice> select_kernel_ridge(
    std::span<const Eigen::MatrixXd> kernels, const Eigen::Ref<const Eigen::MatrixXd>& targets,
    std::span<const double> loss_weights, std::span<const int> folds,
    const Eigen::Ref<const Eigen::VectorXd>& sample_weights = Eigen::VectorXd());

/// The loss weight of least pooled squared error for linear ridge, for each target by itself.
/// @param x  D x N samples, @param targets  N x P, @param sample_weights  as above. Refits a fold
/// at a time.
[[nodiscard]] std::vector<CrossValidationChoice> select_linear_ridge(
    const Eigen::Ref<const Eigen::MatrixXd>& x, const Eigen::Ref<const Eigen::MatrixXd>& targets,
    std::span<const double> loss_weights, std::span<const int> folds,
    const Eigen::Ref<const Eigen::VectorXd>& sample_weights = Eigen::VectorXd());

/// The kernel, C and epsilon of least pooled squared error for epsilon-SVR on one target; of equals
/// the first kernel, then C, then epsilon. Refits a fold at a time; the kernel is shared by all.
/// There are no sample weights: libsvm's regression has one C for all samples.
/// @throws as select_kernel_ridge.
[[nodiscard]] CrossValidationChoice select_support_vector_regression(
    std::span<const SupportVectorKernel> kernels, const Eigen::Ref<const Eigen::VectorXd>& y,
    std::span<const double> loss_weights, std::span<const double> epsilons,
    std::span<const int> folds, double tolerance = 1e-3);

}  // namespace laban::learn
