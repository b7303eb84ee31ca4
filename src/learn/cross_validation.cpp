#include "laban/learn/cross_validation.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "laban/learn/linear_ridge.h"

#include "learn/checks.h"
#include "learn/ridge_system.h"

namespace laban::learn {
namespace {

using Indices = std::vector<int>;

struct Fold {
  Indices held_out;
  Indices rest;
};

/// The folds that hold a sample, in order of their numbers.
std::vector<Fold> list_folds(std::span<const int> folds, Eigen::Index count) {
  if (static_cast<Eigen::Index>(folds.size()) != count) {
    throw base::Error(base::ErrorKind::kData, "cross-validation: " + std::to_string(folds.size()) +
                                                  " folds told for " + std::to_string(count) +
                                                  " samples, one each");
  }
  std::vector<int> numbers(folds.begin(), folds.end());
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  if (numbers.size() < 2) {
    throw base::Error(base::ErrorKind::kData,
                      "cross-validation: one fold holds all samples, at least two folds");
  }
  std::vector<Fold> result(numbers.size());
  for (std::size_t f = 0; f < numbers.size(); ++f) {
    for (int n = 0; n < static_cast<int>(count); ++n) {
      const bool held_out = folds[static_cast<std::size_t>(n)] == numbers[f];
      (held_out ? result[f].held_out : result[f].rest).push_back(n);
    }
  }
  return result;
}

/// The inverse of a lower triangular matrix, by halves: [A 0; B C]^-1 = [A^-1 0; -C^-1 B A^-1
/// C^-1].
Eigen::MatrixXd inverse_of_lower(const Eigen::Ref<const Eigen::MatrixXd>& lower) {
  constexpr Eigen::Index kSmall = 16;
  const Eigen::Index n = lower.rows();
  if (n <= kSmall) {
    return lower.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(n, n));
  }
  const Eigen::Index half = n / 2;
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
  inverse.topLeftCorner(half, half) = inverse_of_lower(lower.topLeftCorner(half, half));
  inverse.bottomRightCorner(n - half, n - half) =
      inverse_of_lower(lower.bottomRightCorner(n - half, n - half));
  inverse.bottomLeftCorner(n - half, half).noalias() =
      -inverse.bottomRightCorner(n - half, n - half) *
      (lower.bottomLeftCorner(n - half, half) * inverse.topLeftCorner(half, half));
  return inverse;
}

Eigen::MatrixXd held_out_residuals(const Eigen::Ref<const Eigen::MatrixXd>& kernel,
                                   const Eigen::Ref<const Eigen::MatrixXd>& targets,
                                   double loss_weight, const std::vector<Fold>& folds,
                                   const Eigen::VectorXd& weights) {
  const Eigen::LLT<Eigen::MatrixXd> factor =
      factorize_ridge_system("cross-validation", kernel, loss_weight, weights);
  // A refit without S solves for y - m 1, m the weighted mean of y outside S. Then its residual on
  // S is (G_SS)^-1 (G (y - m 1))_S, by block inversion of G^-1 = K + W^-1/U: G_SS^-1 is the Schur
  // complement of the other samples' block, and G (y - m 1) restricted to S multiplies it. The
  // weights of S are in both and cancel. With G = R' R, G_SS needs the columns S of R only.
  const Eigen::MatrixXd R = inverse_of_lower(factor.matrixLLT());
  const Eigen::MatrixXd Gy = R.transpose() * (R * targets);
  const Eigen::VectorXd G1 = R.transpose() * R.rowwise().sum();
  Eigen::MatrixXd residuals(kernel.rows(), targets.cols());
  for (const Fold& fold : folds) {
    const Indices& S = fold.held_out;
    const Eigen::VectorXd w = weights(fold.rest);
    const Eigen::RowVectorXd m = w.transpose() * targets(fold.rest, Eigen::all) / w.sum();
    const Eigen::MatrixXd R_S = R(Eigen::all, S);
    const Eigen::MatrixXd G_SS = R_S.transpose() * R_S;
    const Eigen::VectorXd G1_S = G1(S);
    const Eigen::MatrixXd Gy_S = Gy(S, Eigen::all);
    const Eigen::MatrixXd solved = G_SS.llt().solve(Gy_S - G1_S * m);
    residuals(S, Eigen::all) = solved;
  }
  return residuals;
}

/// One choice a target, none made yet.
std::vector<CrossValidationChoice> no_choices(Eigen::Index targets) {
  CrossValidationChoice none;
  none.mean_squared_error = std::numeric_limits<double>::infinity();
  return std::vector<CrossValidationChoice>(static_cast<std::size_t>(targets), none);
}

void require_choices(const std::vector<CrossValidationChoice>& choices) {
  for (const CrossValidationChoice& choice : choices) {
    if (choice.mean_squared_error == std::numeric_limits<double>::infinity()) {
      throw base::Error(base::ErrorKind::kNumeric,
                        "cross-validation: no point of the grid solves, offer lower loss weights");
    }
  }
}

/// Keeps, for each target, the better of what it has and `candidate` with these residuals.
void keep_better(const Eigen::Ref<const Eigen::MatrixXd>& residuals, const Eigen::VectorXd& weights,
                 CrossValidationChoice candidate, std::vector<CrossValidationChoice>& best) {
  const Eigen::RowVectorXd errors = weights.transpose() * residuals.cwiseAbs2() / weights.sum();
  for (Eigen::Index target = 0; target < errors.size(); ++target) {
    CrossValidationChoice& kept = best[static_cast<std::size_t>(target)];
    candidate.mean_squared_error = errors[target];
    if (!(candidate.mean_squared_error < kept.mean_squared_error)) continue;
    kept = candidate;
    kept.residuals = residuals.col(target);
  }
}

template <typename List>
void require_offered(const List& list, const char* what) {
  if (list.empty()) {
    throw base::Error(base::ErrorKind::kUsage,
                      std::string("cross-validation: no ") + what + " offered, at least one");
  }
}

}  // namespace

std::vector<int> assign_folds(std::span<const int> groups, int fold_count, base::Rng& rng) {
  if (fold_count < 2) {
    throw base::Error(base::ErrorKind::kUsage,
                      "assign_folds: " + std::to_string(fold_count) + " folds, at least 2");
  }
  std::vector<int> labels(groups.begin(), groups.end());
  std::sort(labels.begin(), labels.end());
  labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
  if (labels.size() < 2) {
    throw base::Error(base::ErrorKind::kData, "assign_folds: " + std::to_string(labels.size()) +
                                                  " groups of samples, at least 2");
  }
  const std::vector<int> order = rng.permutation(static_cast<int>(labels.size()));
  std::vector<int> result;
  result.reserve(groups.size());
  for (const int group : groups) {
    const auto rank = std::lower_bound(labels.begin(), labels.end(), group) - labels.begin();
    result.push_back(order[static_cast<std::size_t>(rank)] % fold_count);
  }
  return result;
}

std::vector<int> assign_folds(int sample_count, int fold_count, base::Rng& rng) {
  std::vector<int> groups(static_cast<std::size_t>(std::max(sample_count, 0)));
  std::iota(groups.begin(), groups.end(), 0);
  return assign_folds(groups, fold_count, rng);
}

Eigen::MatrixXd kernel_ridge_held_out_residuals(
    const Eigen::Ref<const Eigen::MatrixXd>& kernel,
    const Eigen::Ref<const Eigen::MatrixXd>& targets, double loss_weight,
    std::span<const int> folds, const Eigen::Ref<const Eigen::VectorXd>& sample_weights) {
  require_samples("kernel_ridge_held_out_residuals", kernel);
  require_rows("kernel_ridge_held_out_residuals", kernel.rows(), kernel.cols());
  require_targets("kernel_ridge_held_out_residuals", targets, kernel.rows());
  require_weights("kernel_ridge_held_out_residuals", sample_weights, kernel.rows());
  return held_out_residuals(kernel, targets, loss_weight, list_folds(folds, kernel.rows()),
                            weights_or_ones(sample_weights, kernel.rows()));
}

void visit_kernel_ridge_grid(std::span<const Eigen::MatrixXd> kernels,
                             const Eigen::Ref<const Eigen::MatrixXd>& targets,
                             std::span<const double> loss_weights, std::span<const int> folds,
                             const HeldOutVisitor& visit,
                             const Eigen::Ref<const Eigen::VectorXd>& sample_weights) {
  require_offered(kernels, "kernel");
  require_offered(loss_weights, "loss weight");
  const std::vector<Fold> fold_list = list_folds(folds, targets.rows());
  require_weights("visit_kernel_ridge_grid", sample_weights, targets.rows());
  const Eigen::VectorXd weights = weights_or_ones(sample_weights, targets.rows());
  for (std::size_t k = 0; k < kernels.size(); ++k) {
    require_samples("visit_kernel_ridge_grid", kernels[k]);
    require_rows("visit_kernel_ridge_grid", kernels[k].rows(), kernels[k].cols());
    require_targets("visit_kernel_ridge_grid", targets, kernels[k].rows());
    for (const double loss_weight : loss_weights) {
      Eigen::MatrixXd residuals;
      try {
        residuals = held_out_residuals(kernels[k], targets, loss_weight, fold_list, weights);
      } catch (const base::Error& error) {
        if (error.kind() != base::ErrorKind::kNumeric) throw;
        continue;
      }
      visit(static_cast<int>(k), loss_weight, residuals);
    }
  }
}

std::vector<CrossValidationChoice> select_kernel_ridge(
    std::span<const Eigen::MatrixXd> kernels, const Eigen::Ref<const Eigen::MatrixXd>& targets,
    std::span<const double> loss_weights, std::span<const int> folds,
    const Eigen::Ref<const Eigen::VectorXd>& sample_weights) {
  std::vector<CrossValidationChoice> best = no_choices(targets.cols());
  const Eigen::VectorXd weights = weights_or_ones(sample_weights, targets.rows());
  visit_kernel_ridge_grid(
      kernels, targets, loss_weights, folds,
      [&](int kernel, double loss_weight, const auto& residuals) {
        keep_better(residuals, weights, {.kernel = kernel, .loss_weight = loss_weight}, best);
      },
      sample_weights);
  require_choices(best);
  return best;
}

std::vector<CrossValidationChoice> select_linear_ridge(
    const Eigen::Ref<const Eigen::MatrixXd>& x, const Eigen::Ref<const Eigen::MatrixXd>& targets,
    std::span<const double> loss_weights, std::span<const int> folds,
    const Eigen::Ref<const Eigen::VectorXd>& sample_weights) {
  require_offered(loss_weights, "loss weight");
  require_samples("select_linear_ridge", x);
  require_targets("select_linear_ridge", targets, x.cols());
  require_weights("select_linear_ridge", sample_weights, x.cols());
  const Eigen::VectorXd weights = weights_or_ones(sample_weights, x.cols());
  const std::vector<Fold> fold_list = list_folds(folds, x.cols());
  std::vector<CrossValidationChoice> best = no_choices(targets.cols());
  for (const double loss_weight : loss_weights) {
    Eigen::MatrixXd residuals(targets.rows(), targets.cols());
    for (const Fold& fold : fold_list) {
      const Eigen::MatrixXd train = x(Eigen::all, fold.rest);
      const Eigen::MatrixXd test = x(Eigen::all, fold.held_out);
      for (Eigen::Index target = 0; target < targets.cols(); ++target) {
        const Eigen::VectorXd y = targets.col(target);
        const LinearRidge model =
            fit_linear_ridge(train, y(fold.rest), {.loss_weight = loss_weight}, weights(fold.rest));
        residuals(fold.held_out, target) = y(fold.held_out) - model.predict(test);
      }
    }
    keep_better(residuals, weights, {.loss_weight = loss_weight}, best);
  }
  require_choices(best);
  return best;
}

CrossValidationChoice select_support_vector_regression(std::span<const SupportVectorKernel> kernels,
                                                       const Eigen::Ref<const Eigen::VectorXd>& y,
                                                       std::span<const double> loss_weights,
                                                       std::span<const double> epsilons,
                                                       std::span<const int> folds,
                                                       double tolerance) {
  require_offered(kernels, "kernel");
  require_offered(loss_weights, "loss weight");
  require_offered(epsilons, "epsilon");
  const std::vector<Fold> fold_list = list_folds(folds, y.size());
  std::vector<CrossValidationChoice> best = no_choices(1);
  for (std::size_t k = 0; k < kernels.size(); ++k) {
    for (const double loss_weight : loss_weights) {
      for (const double epsilon : epsilons) {
        Eigen::MatrixXd residuals(y.size(), 1);
        for (const Fold& fold : fold_list) {
          const SupportVectorSolution solution = kernels[k].solve(
              fold.rest, y(fold.rest),
              {.loss_weight = loss_weight, .epsilon = epsilon, .tolerance = tolerance});
          residuals(fold.held_out, 0) =
              y(fold.held_out) - kernels[k].predict(fold.rest, solution, fold.held_out);
        }
        keep_better(residuals, Eigen::VectorXd::Ones(y.size()),
                    {.kernel = static_cast<int>(k), .loss_weight = loss_weight, .epsilon = epsilon},
                    best);
      }
    }
  }
  return best.front();
}

}  // namespace laban::learn
