#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "laban/base/error.h"
#include "laban/effort/style_regressor.h"
#include "laban/learn/cross_validation.h"
#include "laban/learn/kernel_ridge.h"
#include "laban/learn/linear_ridge.h"

namespace laban::effort {
namespace {

using learn::CrossValidationChoice;

void append_grid_problems(const char* name, const std::vector<double>& values, bool zero_allowed,
                          std::vector<std::string>& problems) {
  const std::string place = std::string("RegressorGrid::") + name;
  if (values.empty()) problems.push_back(place + " is empty (must hold at least one value)");
  for (const double value : values) {
    const bool fine = std::isfinite(value) && (value > 0.0 || (zero_allowed && value == 0.0));
    if (!fine) {
      problems.push_back(place + " holds " + std::to_string(value) + " (must be " +
                         (zero_allowed ? ">= 0)" : "> 0)"));
    }
  }
}

/// What the models of one training set share.
///
/// With `symmetric` a blend and its twin (told from the other end) are both training samples, with
/// one label. Swapping is an isometry of the standardized features, whose statistics come from both
/// orders; so the solution gives twins one coefficient, and the system of 2 N samples with kernel k
/// is the system of N samples with the kernel k(z, w) + k(z, twin of w): same solution, same folds,
/// an eighth of the work. It does not depend on the order, so there is nothing to average.
class TrainingSet {
 public:
  TrainingSet(const StyleSamples& samples, const StyleRegressorOptions& options)
      : options_(options), labels_(samples.labels.transpose()) {
    const Eigen::Index N = samples.features.cols();
    interpolated_ = linear_interpolation(samples.features).transpose();
    Eigen::MatrixXd both = samples.features;
    if (options.symmetric) {
      both.conservativeResize(Eigen::NoChange, 2 * N);
      both.rightCols(N) = swap_order(samples.features);
    }
    scale_ = learn::fit_standardizer(both);
    standardized_ = scale_.apply(both);
    base::Rng rng(options.seed);
    folds_ = samples.groups.empty() ? learn::assign_folds(static_cast<int>(N), options.folds, rng)
                                    : learn::assign_folds(samples.groups, options.folds, rng);
    median_ = learn::median_distance(standardized_);
    squared_ = learn::squared_distances(standardized_.leftCols(N), standardized_);
  }

  const StyleRegressorOptions& options() const { return options_; }
  const learn::Standardizer& scale() const { return scale_; }
  const Eigen::MatrixXd& labels() const { return labels_; }
  const Eigen::MatrixXd& interpolated() const { return interpolated_; }
  const Eigen::MatrixXd& standardized() const { return standardized_; }
  const std::vector<int>& folds() const { return folds_; }
  Eigen::Index count() const { return labels_.rows(); }
  double width(double relative) const { return relative * median_; }

  Eigen::MatrixXd kernel(double relative_width) const {
    Eigen::MatrixXd K = learn::gaussian_kernel(squared_.leftCols(count()), width(relative_width));
    if (options_.symmetric) {
      K += learn::gaussian_kernel(squared_.rightCols(count()), width(relative_width));
    }
    return K;
  }

  std::vector<Eigen::MatrixXd> kernels(const std::vector<double>& relative_widths) const {
    std::vector<Eigen::MatrixXd> result;
    result.reserve(relative_widths.size());
    for (const double relative : relative_widths) result.push_back(kernel(relative));
    return result;
  }

  /// `values` of the N samples for all columns of standardized(): twins repeat them.
  template <typename Vector>
  Vector for_both(const Vector& values) const {
    if (!options_.symmetric) return values;
    Vector result(2 * values.size());
    std::copy(values.begin(), values.end(), result.begin());
    std::copy(values.begin(), values.end(), result.begin() + static_cast<long>(values.size()));
    return result;
  }

 private:
  StyleRegressorOptions options_;
  Eigen::MatrixXd labels_;        // N x 3
  Eigen::MatrixXd interpolated_;  // N x 3
  learn::Standardizer scale_;
  Eigen::MatrixXd standardized_;  // D x N, or D x 2 N: the samples, then their twins
  std::vector<int> folds_;        // N
  double median_ = 1.0;
  Eigen::MatrixXd squared_;  // N x N or N x 2 N
};

// Where SVR's solver stops, in deviations of the labels. The selection may be coarser: with 1e-3
// it made the same 36 choices of 36 and took 1.25 times as long.
constexpr double kSelectionTolerance = 1e-2;
constexpr double kFinalTolerance = 1e-3;

/// A state that predicts 0.
StyleRegressorState empty_state(const TrainingSet& set, RegressorKind kind) {
  StyleRegressorState state;
  state.kind = kind;
  state.symmetric = set.options().symmetric;
  state.scale = set.scale();
  state.weights = Eigen::Matrix3Xd::Zero(kFactorCount, set.scale().mean.size());
  return state;
}

void give_centers(const TrainingSet& set, StyleRegressorState& state) {
  state.centers = set.standardized();
  state.coefficients = Eigen::Matrix3Xd::Zero(kFactorCount, state.centers.cols());
}

StyleRegressor fit_linear_interpolation(const TrainingSet& set) {
  StyleRegressorState state = empty_state(set, RegressorKind::kLinearInterpolation);
  state.interpolation.setOnes();
  for (int f = 0; f < kFactorCount; ++f) {
    state.fits[static_cast<std::size_t>(f)].held_out_squared_error =
        (set.labels() - set.interpolated()).col(f).squaredNorm() / static_cast<double>(set.count());
  }
  return StyleRegressor(std::move(state));
}

StyleRegressor fit_linear(const TrainingSet& set) {
  StyleRegressorState state = empty_state(set, RegressorKind::kLinearRidge);
  Eigen::MatrixXd targets(set.standardized().cols(), kFactorCount);
  for (int f = 0; f < kFactorCount; ++f) {
    targets.col(f) = set.for_both(Eigen::VectorXd(set.labels().col(f)));
  }
  const auto choices =
      learn::select_linear_ridge(set.standardized(), targets,
                                 set.options().grid.linear_loss_weights, set.for_both(set.folds()));
  for (int f = 0; f < kFactorCount; ++f) {
    const CrossValidationChoice& choice = choices[static_cast<std::size_t>(f)];
    const learn::LinearRidge model = learn::fit_linear_ridge(set.standardized(), targets.col(f),
                                                             {.loss_weight = choice.loss_weight});
    state.weights.row(f) = model.weights.transpose();
    state.offset[f] = model.intercept;
    state.fits[static_cast<std::size_t>(f)] = {.loss_weight = choice.loss_weight,
                                               .held_out_squared_error = choice.mean_squared_error};
  }
  return StyleRegressor(std::move(state));
}

/// Kernel ridge of `targets` (N x 3) at the chosen grid points.
StyleRegressor fit_kernel_machine(const TrainingSet& set, RegressorKind kind,
                                  const Eigen::MatrixXd& targets,
                                  std::span<const Eigen::MatrixXd> kernels,
                                  std::span<const CrossValidationChoice> choices) {
  StyleRegressorState state = empty_state(set, kind);
  if (kind == RegressorKind::kResidualKernelRidge) state.interpolation.setOnes();
  give_centers(set, state);
  for (int f = 0; f < kFactorCount; ++f) {
    const CrossValidationChoice& choice = choices[static_cast<std::size_t>(f)];
    const auto kernel = static_cast<std::size_t>(choice.kernel);
    const Eigen::VectorXd y = targets.col(f);
    const learn::KernelRidgeSolution solution =
        learn::solve_kernel_ridge(kernels[kernel], y, choice.loss_weight);
    state.coefficients.row(f) = set.for_both(solution.coefficients).transpose();
    state.offset[f] = solution.offset;
    state.signal_variance[f] = (y.array() - solution.offset).matrix().dot(solution.coefficients) /
                               static_cast<double>(set.count());
    const double relative = set.options().grid.relative_widths[kernel];
    state.fits[static_cast<std::size_t>(f)] = {.width = set.width(relative),
                                               .relative_width = relative,
                                               .loss_weight = choice.loss_weight,
                                               .held_out_squared_error = choice.mean_squared_error};
  }
  return StyleRegressor(std::move(state));
}

std::vector<double> scaled(const std::vector<double>& values, double factor) {
  std::vector<double> result = values;
  for (double& value : result) value *= factor;
  return result;
}

StyleRegressor fit_support_vectors(const TrainingSet& set) {
  StyleRegressorState state = empty_state(set, RegressorKind::kSupportVector);
  give_centers(set, state);
  const RegressorGrid& grid = set.options().grid;
  std::vector<learn::SupportVectorKernel> kernels;
  for (const double relative : grid.svr_relative_widths) kernels.emplace_back(set.kernel(relative));
  std::vector<int> all(static_cast<std::size_t>(set.count()));
  std::iota(all.begin(), all.end(), 0);
  for (int f = 0; f < kFactorCount; ++f) {
    const Eigen::VectorXd y = set.labels().col(f);
    const double deviation = std::sqrt((y.array() - y.mean()).square().mean());
    const double unit = deviation > 0.0 ? deviation : 1.0;
    const CrossValidationChoice choice = learn::select_support_vector_regression(
        kernels, y, scaled(grid.svr_loss_weights, unit), scaled(grid.svr_epsilons, unit),
        set.folds(), kSelectionTolerance * unit);
    const auto kernel = static_cast<std::size_t>(choice.kernel);
    const learn::SupportVectorSolution solution =
        kernels[kernel].solve(all, y,
                              {.loss_weight = choice.loss_weight,
                               .epsilon = choice.epsilon,
                               .tolerance = kFinalTolerance * unit});
    state.coefficients.row(f) = set.for_both(solution.coefficients).transpose();
    state.offset[f] = -solution.rho;
    const double relative = grid.svr_relative_widths[kernel];
    state.fits[static_cast<std::size_t>(f)] = {set.width(relative), relative, choice.loss_weight,
                                               choice.epsilon, choice.mean_squared_error};
  }
  return StyleRegressor(std::move(state));
}

/// Kernel ridge of the labels and of the residuals: one system, one selection, six targets.
class KernelRidgePair {
 public:
  explicit KernelRidgePair(const TrainingSet& set)
      : set_(set), kernels_(set.kernels(set.options().grid.relative_widths)) {
    targets_.resize(set.count(), 2 * kFactorCount);
    targets_ << set.labels(), set.labels() - set.interpolated();
    choices_ = learn::select_kernel_ridge(kernels_, targets_, set.options().grid.loss_weights,
                                          set.folds());
  }

  StyleRegressor fit(RegressorKind kind) const {
    const int first = kind == RegressorKind::kResidualKernelRidge ? kFactorCount : 0;
    return fit_kernel_machine(
        set_, kind, targets_.middleCols(first, kFactorCount), kernels_,
        std::span(choices_).subspan(static_cast<std::size_t>(first), kFactorCount));
  }

 private:
  const TrainingSet& set_;
  std::vector<Eigen::MatrixXd> kernels_;
  Eigen::MatrixXd targets_;
  std::vector<CrossValidationChoice> choices_;
};

void require_trainable(const StyleSamples& samples, const StyleRegressorOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw base::Error(base::ErrorKind::kUsage, problems.front());
  }
  samples.check();
  std::vector<int> groups = samples.groups;
  std::sort(groups.begin(), groups.end());
  groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
  const int count = groups.empty() ? samples.count() : static_cast<int>(groups.size());
  if (count < 3) {
    throw base::Error(base::ErrorKind::kData, "style regressor: " + std::to_string(count) +
                                                  " labelled blends, at least 3 to learn from");
  }
}

}  // namespace

std::vector<std::string> RegressorGrid::problems() const {
  std::vector<std::string> problems;
  append_grid_problems("relative_widths", relative_widths, false, problems);
  append_grid_problems("loss_weights", loss_weights, false, problems);
  append_grid_problems("linear_loss_weights", linear_loss_weights, false, problems);
  append_grid_problems("svr_relative_widths", svr_relative_widths, false, problems);
  append_grid_problems("svr_loss_weights", svr_loss_weights, false, problems);
  append_grid_problems("svr_epsilons", svr_epsilons, true, problems);
  return problems;
}

std::vector<std::string> StyleRegressorOptions::problems() const {
  std::vector<std::string> problems = grid.problems();
  if (folds < 2) {
    problems.push_back("StyleRegressorOptions::folds = " + std::to_string(folds) +
                       " (must be >= 2)");
  }
  return problems;
}

std::vector<StyleRegressor> fit_style_regressors(const StyleSamples& samples,
                                                 std::span<const RegressorKind> kinds,
                                                 const StyleRegressorOptions& options) {
  require_trainable(samples, options);
  const TrainingSet set(samples, options);
  std::optional<KernelRidgePair> kernel_ridge;
  std::vector<StyleRegressor> result;
  result.reserve(kinds.size());
  for (const RegressorKind kind : kinds) {
    switch (kind) {
      case RegressorKind::kLinearInterpolation:
        result.push_back(fit_linear_interpolation(set));
        break;
      case RegressorKind::kLinearRidge:
        result.push_back(fit_linear(set));
        break;
      case RegressorKind::kKernelRidge:
      case RegressorKind::kResidualKernelRidge:
        if (!kernel_ridge) kernel_ridge.emplace(set);
        result.push_back(kernel_ridge->fit(kind));
        break;
      case RegressorKind::kSupportVector:
        result.push_back(fit_support_vectors(set));
        break;
    }
  }
  return result;
}

StyleRegressor fit_style_regressor(const StyleSamples& samples, RegressorKind kind,
                                   const StyleRegressorOptions& options) {
  return fit_style_regressors(samples, std::span(&kind, 1), options).front();
}

StyleRegressor fit_default_regressor(const StyleSamples& samples,
                                     const StyleRegressorOptions& options) {
  const std::array kinds = {RegressorKind::kResidualKernelRidge, RegressorKind::kKernelRidge};
  std::vector<StyleRegressor> models = fit_style_regressors(samples, kinds, options);
  double residual = 0.0, plain = 0.0;
  for (std::size_t f = 0; f < kFactorCount; ++f) {
    const auto labels = samples.labels.row(static_cast<Eigen::Index>(f)).array();
    const double variance = (labels - labels.mean()).square().mean();
    if (variance <= 0.0) continue;
    residual += models[0].fits()[f].held_out_squared_error / variance;
    plain += models[1].fits()[f].held_out_squared_error / variance;
  }
  return residual <= plain ? std::move(models[0]) : std::move(models[1]);
}

}  // namespace laban::effort
