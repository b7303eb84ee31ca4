#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/learn/gaussian_kernel.h"

namespace laban::learn {

struct SupportVectorOptions {
  /// Width of the Gaussian, in the samples' unit; > 0.
  double width = 1.0;
  /// C: weight of the loss, U of [Torresani06, eq. 7]; the bound of every coefficient; > 0.
  double loss_weight = 1.0;
  /// Half-width of the tube inside which an error costs nothing, in the targets' unit; >= 0.
  double epsilon = 0.1;
  /// The solver stops when no pair of samples breaks the optimality conditions by more; > 0.
  double tolerance = 1e-3;

  /// Broken rules, each naming field, value and rule; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// f = K coefficients - rho on the training samples; |coefficients| <= C, their sum is 0.
struct SupportVectorSolution {
  Eigen::VectorXd coefficients;  ///< one a sample; 0 for a sample that is no support vector
  double rho = 0.0;
};

/// A kernel matrix made ready for many epsilon-SVR fits on subsets of its samples (folds, targets):
/// the solver reads its rows in place. Immutable; fits may run in several threads at once.
class SupportVectorKernel {
 public:
  /// @param kernel  N x N, symmetric positive semi-definite, finite.
  /// @throws Error{kData} otherwise (definiteness is not checked).
  explicit SupportVectorKernel(const Eigen::Ref<const Eigen::MatrixXd>& kernel);
  ~SupportVectorKernel();
  SupportVectorKernel(SupportVectorKernel&&) noexcept;
  SupportVectorKernel& operator=(SupportVectorKernel&&) noexcept;

  /// epsilon-insensitive regression by libsvm on the samples `rows` (all different); `y` holds
  /// their targets, `options.width` is not read.
  /// @throws Error{kUsage} if `options` has problems; Error{kData} if sizes differ, `rows` is empty
  ///         or out of range, or a target is not finite.
  [[nodiscard]] SupportVectorSolution solve(std::span<const int> rows,
                                            const Eigen::Ref<const Eigen::VectorXd>& y,
                                            const SupportVectorOptions& options) const;

  /// Predictions of `solution`, fitted on the samples `rows`, at the samples `at` of this kernel.
  /// @throws Error{kData} if sizes differ or an index is out of range.
  [[nodiscard]] Eigen::VectorXd predict(std::span<const int> rows,
                                        const SupportVectorSolution& solution,
                                        std::span<const int> at) const;

 private:
  struct Nodes;
  std::unique_ptr<Nodes> nodes_;
};

/// Epsilon-insensitive support vector regression with a Gaussian kernel. The model is our own
/// arrays (the support vectors as centers, their coefficients, offset = -rho): predicting calls no
/// library, and no library's file format is ever read.
///
/// @param x  D x N samples, N >= 1, @param y  N targets.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if sizes differ, there is no
///         sample or a value is not finite.
/// The solution is libsvm's to within `tolerance`; it depends on nothing but its arguments.
[[nodiscard]] KernelExpansion fit_support_vector_regression(
    const Eigen::Ref<const Eigen::MatrixXd>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
    const SupportVectorOptions& options = {});

}  // namespace laban::learn
