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

#include "effort/averaged_process.h"
#include "effort/balanced_scale.h"
#include "effort/error_spread.h"

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
  /// @param balanced  scales features so that contents, efforts and alpha, as groups, count alike
  ///                  in distances, instead of each feature by itself.
  TrainingSet(const StyleSamples& samples, const StyleRegressorOptions& options,
              bool balanced = false)
      : options_(options), labels_(samples.labels.transpose()) {
    const Eigen::Index N = samples.features.cols();
    weights_ = samples.weights.size() == 0 ? Eigen::VectorXd::Ones(N) : samples.weights;
    interpolated_ = linear_interpolation(samples.features, samples.factor_count()).transpose();
    Eigen::MatrixXd both = samples.features;
    if (options.symmetric) {
      both.conservativeResize(Eigen::NoChange, 2 * N);
      both.rightCols(N) = swap_order(samples.features, samples.factor_count());
    }
    scale_ =
        balanced ? fit_balanced_scale(both, samples.factor_count()) : learn::fit_standardizer(both);
    alpha_ = samples.features.bottomRows(1);
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
  const Eigen::RowVectorXd& alpha() const { return alpha_; }
  const std::vector<int>& folds() const { return folds_; }
  /// Number of each sample's blend, 0 .. blend_count() - 1; samples of one group are one blend.
  const std::vector<int>& blends() const { return blends_; }
  int blend_count() const { return blend_count_; }
  Eigen::Index count() const { return labels_.rows(); }
  int factor_count() const { return static_cast<int>(labels_.cols()); }
  double median() const { return median_; }
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
  Eigen::MatrixXd labels_;        // N x F
  Eigen::VectorXd weights_;       // N
  Eigen::RowVectorXd alpha_;      // N
  Eigen::MatrixXd interpolated_;  // N x F
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
  const int F = set.factor_count();
  state.interpolation = state.offset = state.bulge_offset = EffortVector::Zero(F);
  state.weights = EffortMatrix::Zero(F, set.scale().mean.size());
  state.coefficients = state.bulge = EffortMatrix::Zero(F, 0);
  state.fits.resize(static_cast<std::size_t>(F));
  return state;
}

void give_centers(const TrainingSet& set, StyleRegressorState& state) {
  state.centers = set.standardized();
  state.coefficients = EffortMatrix::Zero(set.factor_count(), state.centers.cols());
  state.bulge = state.coefficients;
}

/// Options of the fifth model and of standard errors, which never depend on the order.
StyleRegressorOptions in_both_orders(StyleRegressorOptions options) {
  options.symmetric = true;
  return options;
}

/// What the standard errors of all models of one training set share.
class SpreadFit {
 public:
  explicit SpreadFit(const TrainingSet& balanced) : bulge_(bulge_of(balanced.alpha())) {
    spread_.scale = balanced.scale();
    spread_.centers = balanced.standardized();
    spread_.width = balanced.median();
    spread_.bulge_mean_square = bulge_.square().mean();
    if (!(spread_.bulge_mean_square > 0.0)) spread_.bulge_mean_square = 1.0;
    novelty_ = held_out_novelty(spread_.centers, spread_.width, balanced.folds());
  }

  /// @param held_out  N residuals of each factor.
  ErrorSpread of(const std::vector<Eigen::VectorXd>& held_out) const {
    ErrorSpread result = spread_;
    const int F = static_cast<int>(held_out.size());
    result.unit = result.bulge_share = EffortVector::Zero(F);
    for (int f = 0; f < F; ++f) {
      fit_spread(bulge_, novelty_, held_out[static_cast<std::size_t>(f)], f, result);
    }
    return result;
  }

 private:
  Eigen::ArrayXd bulge_;
  Eigen::ArrayXd novelty_;
  ErrorSpread spread_;
};

/// A model without its standard errors, and the held-out residuals that they come from.
struct Fitted {
  StyleRegressorState state;
  std::vector<Eigen::VectorXd> held_out;  ///< one a factor
};

Fitted empty_fit(const TrainingSet& set, RegressorKind kind) {
  return {empty_state(set, kind), {}};
}

Fitted fit_linear_interpolation(const TrainingSet& set) {
  Fitted fitted = empty_fit(set, RegressorKind::kLinearInterpolation);
  StyleRegressorState& state = fitted.state;
  state.interpolation.setOnes();
  for (int f = 0; f < set.factor_count(); ++f) {
    state.fits[static_cast<std::size_t>(f)].held_out_squared_error =
        weighted_mean_square((set.labels() - set.interpolated()).col(f), set.weights());
    fitted.held_out.push_back((set.labels() - set.interpolated()).col(f));
  }
  return fitted;
}

Fitted fit_linear(const TrainingSet& set) {
  Fitted fitted = empty_fit(set, RegressorKind::kLinearRidge);
  StyleRegressorState& state = fitted.state;
  Eigen::MatrixXd targets(set.standardized().cols(), set.factor_count());
  for (int f = 0; f < set.factor_count(); ++f) {
    targets.col(f) = set.for_both(Eigen::VectorXd(set.labels().col(f)));
  }
  const auto choices = learn::select_linear_ridge(
      set.standardized(), targets, set.options().grid.linear_loss_weights,
      set.for_both(set.folds()), set.for_both(set.weights()));
  for (int f = 0; f < set.factor_count(); ++f) {
    const CrossValidationChoice& choice = choices[static_cast<std::size_t>(f)];
    const learn::LinearRidge model =
        learn::fit_linear_ridge(set.standardized(), targets.col(f),
                                {.loss_weight = choice.loss_weight}, set.for_both(set.weights()));
    state.weights.row(f) = model.weights.transpose();
    state.offset[f] = model.intercept;
    state.fits[static_cast<std::size_t>(f)] = {.loss_weight = choice.loss_weight,
                                               .held_out_squared_error = choice.mean_squared_error};
    fitted.held_out.push_back(choice.residuals.head(set.count()));
  }
  return fitted;
}

/// The paper's kernel ridge: for each factor the width and U of least pooled held-out error.
Fitted fit_kernel_ridge(const TrainingSet& set) {
  Fitted fitted = empty_fit(set, RegressorKind::kKernelRidge);
  give_centers(set, fitted.state);
  const RegressorGrid& grid = set.options().grid;
  const std::vector<Eigen::MatrixXd> kernels = set.kernels(grid.relative_widths);
  const auto choices = learn::select_kernel_ridge(kernels, set.labels(), grid.loss_weights,
                                                  set.folds(), set.weights());
  for (int f = 0; f < set.factor_count(); ++f) {
    const CrossValidationChoice& choice = choices[static_cast<std::size_t>(f)];
    const auto kernel = static_cast<std::size_t>(choice.kernel);
    const learn::KernelRidgeSolution solution = learn::solve_kernel_ridge(
        kernels[kernel], set.labels().col(f), choice.loss_weight, set.weights());
    fitted.state.coefficients.row(f) = set.for_both(solution.coefficients).transpose();
    fitted.state.offset[f] = solution.offset;
    const double relative = grid.relative_widths[kernel];
    fitted.state.fits[static_cast<std::size_t>(f)] = {
        set.width(relative), relative, choice.loss_weight, 0.0, choice.mean_squared_error};
    fitted.held_out.push_back(choice.residuals);
  }
  return fitted;
}

/// How sure an advantage must be before the fifth model acts on it, in standard errors.
constexpr double kSureness = 2.0;

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

/// What interpolation misses has outliers: seeds whose labels stand at an end of the scale, where
/// they say less than they seem to. Residuals beyond so many robust standard deviations are cut.
constexpr double kOutlier = 2.5;

Eigen::VectorXd without_outliers(const Eigen::VectorXd& residuals) {
  Eigen::ArrayXd sizes = residuals.array().abs();
  const auto middle = sizes.begin() + sizes.size() / 2;
  std::nth_element(sizes.begin(), middle, sizes.end());
  const double bound = kOutlier * 1.4826 * *middle;  // 1.4826: of a normal distribution's median
  if (!(bound > 0.0)) return residuals;  // interpolation is exact for most: no scale to judge by
  return residuals.cwiseMax(-bound).cwiseMin(bound);
}

/// The fifth model (ours), see fit_style_regressor.
/// @param set  of both orders, balanced.
Fitted fit_residual_kernel_ridge(const TrainingSet& set) {
  Fitted fitted = empty_fit(set, RegressorKind::kResidualKernelRidge);
  StyleRegressorState& state = fitted.state;
  state.bounded = true;
  give_centers(set, state);
  const RegressorGrid& grid = set.options().grid;
  const ProcessGrid processes(set.standardized(), set.alpha(), set.weights(), set.folds(),
                              set.median(), grid.averaged_relative_widths,
                              grid.averaged_noise_ratios);
  for (int f = 0; f < set.factor_count(); ++f) {
    const Eigen::VectorXd missed = (set.labels() - set.interpolated()).col(f);
    const Eigen::VectorXd learnt_from = without_outliers(missed);
    AveragedProcess chosen = processes.average(learnt_from, ProcessForm::kBulge);
    chosen.held_out += missed - learnt_from;
    const Eigen::VectorXd label = set.labels().col(f);
    const double mean = label.dot(set.weights()) / set.weights().sum();
    AveragedProcess plain = processes.average(label.array() - mean, ProcessForm::kPlain);
    if (surely_at_most(chosen.held_out, plain.held_out, set) < 0.0) {
      chosen = std::move(plain);
      state.offset[f] = mean + chosen.offset;
      state.coefficients.row(f) = chosen.coefficients.transpose();
    } else {
      state.interpolation[f] = 1.0;
      state.bulge_offset[f] = chosen.offset;
      state.bulge.row(f) = chosen.coefficients.transpose();
    }
    state.fits[static_cast<std::size_t>(f)] = {
        chosen.width, chosen.relative_width, chosen.loss_weight, 0.0,
        weighted_mean_square(chosen.held_out, set.weights())};
    fitted.held_out.push_back(chosen.held_out);
  }
  return fitted;
}

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

Fitted fit_support_vectors(const TrainingSet& set) {
  const double weight = common_weight(set);
  Fitted fitted = empty_fit(set, RegressorKind::kSupportVector);
  StyleRegressorState& state = fitted.state;
  give_centers(set, state);
  const RegressorGrid& grid = set.options().grid;
  std::vector<learn::SupportVectorKernel> kernels;
  for (const double relative : grid.svr_relative_widths) kernels.emplace_back(set.kernel(relative));
  std::vector<int> all(static_cast<std::size_t>(set.count()));
  std::iota(all.begin(), all.end(), 0);
  for (int f = 0; f < set.factor_count(); ++f) {
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
    fitted.held_out.push_back(choice.residuals);
  }
  return fitted;
}

Fitted fit_kind(RegressorKind kind, const TrainingSet& set, const TrainingSet& balanced) {
  switch (kind) {
    case RegressorKind::kLinearInterpolation:
      return fit_linear_interpolation(set);
    case RegressorKind::kLinearRidge:
      return fit_linear(set);
    case RegressorKind::kKernelRidge:
      return fit_kernel_ridge(set);
    case RegressorKind::kSupportVector:
      return fit_support_vectors(set);
    case RegressorKind::kResidualKernelRidge:
      return fit_residual_kernel_ridge(balanced);
  }
  LABAN_CHECK(false);
  return {};
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
  append_grid_problems("averaged_relative_widths", averaged_relative_widths, false, problems);
  append_grid_problems("averaged_noise_ratios", averaged_noise_ratios, false, problems);
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
  const TrainingSet balanced(samples, in_both_orders(options), true);
  const SpreadFit spread(balanced);
  std::vector<StyleRegressor> result;
  result.reserve(kinds.size());
  for (const RegressorKind kind : kinds) {
    Fitted fitted = fit_kind(kind, set, balanced);
    fitted.state.spread = spread.of(fitted.held_out);
    result.emplace_back(std::move(fitted.state));
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
