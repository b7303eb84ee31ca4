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
    weights_ = samples.weights.size() == 0 ? Eigen::VectorXd::Ones(N) : samples.weights;
    interpolated_ = linear_interpolation(samples.features).transpose();
    Eigen::MatrixXd both = samples.features;
    if (options.symmetric) {
      both.conservativeResize(Eigen::NoChange, 2 * N);
      both.rightCols(N) = swap_order(samples.features);
    }
    scale_ = learn::fit_standardizer(both);
    standardized_ = scale_.apply(both);
    number_blends(samples);
    base::Rng rng(options.seed);
    folds_ = learn::assign_folds(blends_, options.folds, rng);
    median_ = learn::median_distance(standardized_);
    squared_ = learn::squared_distances(standardized_.leftCols(N), standardized_);
  }

  const StyleRegressorOptions& options() const { return options_; }
  const learn::Standardizer& scale() const { return scale_; }
  const Eigen::MatrixXd& labels() const { return labels_; }
  /// Of the N samples' losses; 1 if none were told.
  const Eigen::VectorXd& weights() const { return weights_; }
  const Eigen::MatrixXd& interpolated() const { return interpolated_; }
  const Eigen::MatrixXd& standardized() const { return standardized_; }
  const std::vector<int>& folds() const { return folds_; }
  /// Number of each sample's blend, 0 .. blend_count() - 1; samples of one group are one blend.
  const std::vector<int>& blends() const { return blends_; }
  int blend_count() const { return blend_count_; }
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
  void number_blends(const StyleSamples& samples) {
    blends_.resize(static_cast<std::size_t>(samples.count()));
    std::iota(blends_.begin(), blends_.end(), 0);
    blend_count_ = samples.count();
    if (samples.groups.empty()) return;
    std::vector<int> labels = samples.groups;
    std::sort(labels.begin(), labels.end());
    labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
    blend_count_ = static_cast<int>(labels.size());
    for (std::size_t n = 0; n < blends_.size(); ++n) {
      blends_[n] = static_cast<int>(
          std::lower_bound(labels.begin(), labels.end(), samples.groups[n]) - labels.begin());
    }
  }

  StyleRegressorOptions options_;
  Eigen::MatrixXd labels_;        // N x 3
  Eigen::VectorXd weights_;       // N
  Eigen::MatrixXd interpolated_;  // N x 3
  learn::Standardizer scale_;
  Eigen::MatrixXd standardized_;  // D x N, or D x 2 N: the samples, then their twins
  std::vector<int> blends_;       // N
  int blend_count_ = 0;
  std::vector<int> folds_;  // N
  double median_ = 1.0;
  Eigen::MatrixXd squared_;  // N x N or N x 2 N
};

// Where SVR's solver stops, in deviations of the labels. The selection may be coarser: with 1e-3
// it made the same 36 choices of 36 and took 1.25 times as long.
constexpr double kSelectionTolerance = 1e-2;
constexpr double kFinalTolerance = 1e-3;

double weighted_mean_square(const Eigen::Ref<const Eigen::VectorXd>& values,
                            const Eigen::VectorXd& weights) {
  return weights.dot(values.cwiseAbs2()) / weights.sum();
}

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
        weighted_mean_square((set.labels() - set.interpolated()).col(f), set.weights());
  }
  return StyleRegressor(std::move(state));
}

StyleRegressor fit_linear(const TrainingSet& set) {
  StyleRegressorState state = empty_state(set, RegressorKind::kLinearRidge);
  Eigen::MatrixXd targets(set.standardized().cols(), kFactorCount);
  for (int f = 0; f < kFactorCount; ++f) {
    targets.col(f) = set.for_both(Eigen::VectorXd(set.labels().col(f)));
  }
  const auto choices = learn::select_linear_ridge(
      set.standardized(), targets, set.options().grid.linear_loss_weights,
      set.for_both(set.folds()), set.for_both(set.weights()));
  for (int f = 0; f < kFactorCount; ++f) {
    const CrossValidationChoice& choice = choices[static_cast<std::size_t>(f)];
    const learn::LinearRidge model =
        learn::fit_linear_ridge(set.standardized(), targets.col(f),
                                {.loss_weight = choice.loss_weight}, set.for_both(set.weights()));
    state.weights.row(f) = model.weights.transpose();
    state.offset[f] = model.intercept;
    state.fits[static_cast<std::size_t>(f)] = {.loss_weight = choice.loss_weight,
                                               .held_out_squared_error = choice.mean_squared_error};
  }
  return StyleRegressor(std::move(state));
}

/// A kernel ridge machine that cross-validation chose for one factor.
struct KernelChoice {
  std::size_t kernel = 0;                                  ///< index of its relative width
  double loss_weight = 0.0;                                ///< 0: no machine at all
  double score = std::numeric_limits<double>::infinity();  ///< what was minimised
  Eigen::VectorXd held_out;                                ///< residuals of the samples
};

/// How sure an advantage must be before the fifth model acts on it, in standard errors.
constexpr double kSureness = 1.0;

/// Upper confidence bound of the change of squared error from `before` to `after`, held-out
/// residuals of the same samples: mean + kSureness * standard error of the paired differences.
/// Below 0 the change is an improvement, surely. Samples of one blend (several observers) are one
/// observation, their weighted mean, which weighs as much as they do on average.
double surely_at_most(const Eigen::Ref<const Eigen::VectorXd>& before,
                      const Eigen::Ref<const Eigen::VectorXd>& after, const TrainingSet& set) {
  const int blend_count = set.blend_count();
  Eigen::ArrayXd difference = Eigen::ArrayXd::Zero(blend_count);
  Eigen::ArrayXd samples = Eigen::ArrayXd::Zero(blend_count);
  Eigen::ArrayXd weights = Eigen::ArrayXd::Zero(blend_count);
  for (Eigen::Index n = 0; n < before.size(); ++n) {
    const int blend = set.blends()[static_cast<std::size_t>(n)];
    difference[blend] += set.weights()[n] * (after[n] * after[n] - before[n] * before[n]);
    weights[blend] += set.weights()[n];
    samples[blend] += 1.0;
  }
  difference /= weights;
  weights /= samples;
  weights /= weights.sum();
  const double mean = (weights * difference).sum();
  // Of a weighted mean; with equal weights the textbook's variance / count, divisor count - 1.
  const double variance =
      (weights * (difference - mean)).square().sum() * blend_count / (blend_count - 1.0);
  return mean + kSureness * std::sqrt(variance);
}

/// The kernel ridge models of one training set: one pass over one grid, six targets.
///
/// Kernel ridge (the paper's) takes the point of least pooled error. The fifth (ours) learns what
/// linear interpolation misses, and is more careful, for what is missed is small and has heavy
/// tails: two badly interpolated blends that resemble each other make a wild correction look good
/// by the mean. So it takes the point of the least upper confidence bound of the change against
/// interpolation, no correction at all if no bound is below 0. And where kernel ridge is surely
/// better than that (interpolation misleads), it is kernel ridge.
class KernelRidgeSelection {
 public:
  explicit KernelRidgeSelection(const TrainingSet& set)
      : set_(set), kernels_(set.kernels(set.options().grid.relative_widths)) {
    targets_.resize(set.count(), 2 * kFactorCount);
    targets_ << set.labels(), set.labels() - set.interpolated();
    for (int f = 0; f < kFactorCount; ++f) {
      residual_[static_cast<std::size_t>(f)].score = 0.0;
      residual_[static_cast<std::size_t>(f)].held_out = targets_.col(kFactorCount + f);
    }
    learn::visit_kernel_ridge_grid(
        kernels_, targets_, set.options().grid.loss_weights, set.folds(),
        [&](int kernel, double loss_weight, const Eigen::Ref<const Eigen::MatrixXd>& held_out) {
          consider(static_cast<std::size_t>(kernel), loss_weight, held_out);
        },
        set.weights());
    for (const KernelChoice& choice : plain_) {
      if (choice.loss_weight == 0.0) {
        throw base::Error(base::ErrorKind::kNumeric,
                          "style regressor: no point of the kernel ridge grid solves, offer lower "
                          "loss weights");
      }
    }
  }

  StyleRegressor fit(RegressorKind kind) const {
    StyleRegressorState state = empty_state(set_, kind);
    give_centers(set_, state);
    for (int f = 0; f < kFactorCount; ++f) {
      const KernelChoice& plain = plain_[static_cast<std::size_t>(f)];
      const KernelChoice& residual = residual_[static_cast<std::size_t>(f)];
      const bool use_plain =
          kind == RegressorKind::kKernelRidge || bound(residual.held_out, plain.held_out) < 0.0;
      state.interpolation[f] = use_plain ? 0.0 : 1.0;
      fit_factor(use_plain ? plain : residual, targets_.col(use_plain ? f : kFactorCount + f), f,
                 state);
    }
    return StyleRegressor(std::move(state));
  }

 private:
  /// Keeps a point of the grid where it is better than what there is; of equals the first.
  void consider(std::size_t kernel, double loss_weight,
                const Eigen::Ref<const Eigen::MatrixXd>& held_out) {
    const auto keep_better = [&](KernelChoice& kept, double score, int column) {
      if (score < kept.score) kept = {kernel, loss_weight, score, held_out.col(column)};
    };
    for (int f = 0; f < kFactorCount; ++f) {
      const int column = kFactorCount + f;
      keep_better(plain_[static_cast<std::size_t>(f)],
                  weighted_mean_square(held_out.col(f), set_.weights()), f);
      keep_better(residual_[static_cast<std::size_t>(f)],
                  bound(targets_.col(column), held_out.col(column)), column);
    }
  }

  double bound(const Eigen::Ref<const Eigen::VectorXd>& before,
               const Eigen::Ref<const Eigen::VectorXd>& after) const {
    return surely_at_most(before, after, set_);
  }

  void fit_factor(const KernelChoice& choice, const Eigen::VectorXd& y, int f,
                  StyleRegressorState& state) const {
    FactorFit& fit = state.fits[static_cast<std::size_t>(f)];
    fit.held_out_squared_error = weighted_mean_square(choice.held_out, set_.weights());
    if (choice.loss_weight == 0.0) {
      state.signal_variance[f] = y.squaredNorm() / static_cast<double>(y.size());
      return;
    }
    const learn::KernelRidgeSolution solution =
        learn::solve_kernel_ridge(kernels_[choice.kernel], y, choice.loss_weight, set_.weights());
    state.coefficients.row(f) = set_.for_both(solution.coefficients).transpose();
    state.offset[f] = solution.offset;
    state.signal_variance[f] = (y.array() - solution.offset).matrix().dot(solution.coefficients) /
                               static_cast<double>(y.size());
    fit.relative_width = set_.options().grid.relative_widths[choice.kernel];
    fit.width = set_.width(fit.relative_width);
    fit.loss_weight = choice.loss_weight;
  }

  const TrainingSet& set_;
  std::vector<Eigen::MatrixXd> kernels_;             // one a relative width
  Eigen::MatrixXd targets_;                          // N x 6: labels, and what interpolation misses
  std::array<KernelChoice, kFactorCount> plain_;     // of the labels
  std::array<KernelChoice, kFactorCount> residual_;  // of what interpolation misses
};

std::vector<double> scaled(const std::vector<double>& values, double factor) {
  std::vector<double> result = values;
  for (double& value : result) value *= factor;
  return result;
}

/// The weight of all samples. @throws Error{kUsage} if they differ.
double common_weight(const TrainingSet& set) {
  const double least = set.weights().minCoeff(), greatest = set.weights().maxCoeff();
  if (least != greatest) {
    throw base::Error(base::ErrorKind::kUsage,
                      "style regressor: svr with label weights from " + std::to_string(least) +
                          " to " + std::to_string(greatest) +
                          " (libsvm's regression weighs all samples alike); choose another "
                          "regressor or leave the weights out");
  }
  return least;
}

StyleRegressor fit_support_vectors(const TrainingSet& set) {
  const double weight = common_weight(set);
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
    const auto select = [&](std::span<const learn::SupportVectorKernel> offered,
                            const std::vector<double>& loss_weights,
                            const std::vector<double>& epsilons) {
      return learn::select_support_vector_regression(offered, y, loss_weights, epsilons,
                                                     set.folds(), kSelectionTolerance * unit);
    };
    const std::vector<double> epsilons = scaled(grid.svr_epsilons, unit);
    CrossValidationChoice choice = select(kernels, scaled(grid.svr_loss_weights, unit * weight),
                                          {epsilons[epsilons.size() / 2]});
    const auto kernel = static_cast<std::size_t>(choice.kernel);
    choice = select(std::span(kernels).subspan(kernel, 1), {choice.loss_weight}, epsilons);
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
  std::optional<KernelRidgeSelection> kernel_ridge;
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
  return fit_style_regressor(samples, RegressorKind::kResidualKernelRidge, options);
}

}  // namespace laban::effort
