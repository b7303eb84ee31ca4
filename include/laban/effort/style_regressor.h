#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/container.h"
#include "laban/effort/content_map.h"
#include "laban/effort/effort.h"
#include "laban/learn/standardizer.h"

namespace laban::effort {

/// The five regressors [Torresani06, 6 and table 1], METHODS 1.3.
enum class RegressorKind {
  kLinearInterpolation,  ///< (1 - alpha) e_i + alpha e_j
  kLinearRidge,          ///< theta' z
  kKernelRidge,          ///< Gaussian kernel ridge: the paper's choice
  kSupportVector,        ///< epsilon-insensitive, Gaussian kernel
  kResidualKernelRidge,  ///< (ours) linear interpolation + kernel ridges of what it misses,
                         ///< averaged; see fit_style_regressor
};

inline constexpr int kRegressorCount = 5;
inline constexpr std::array<RegressorKind, kRegressorCount> kRegressors = {
    RegressorKind::kLinearInterpolation, RegressorKind::kLinearRidge, RegressorKind::kKernelRidge,
    RegressorKind::kSupportVector, RegressorKind::kResidualKernelRidge};

/// "linear-interpolation", "linear-ridge", "kernel-ridge", "svr" or "residual-kernel-ridge".
[[nodiscard]] std::string_view name_of(RegressorKind kind);
/// The regressor of that name; nullopt if there is none.
[[nodiscard]] std::optional<RegressorKind> regressor_named(std::string_view name);

/// Rows of z = [c_i, c_j, e_i, e_j, alpha] for content coordinates of `components` values and
/// labels of `factors`.
[[nodiscard]] constexpr int feature_count(int components, int factors = kFactorCount) noexcept {
  return 2 * components + 2 * factors + 1;
}

/// z of one blend: alpha = 0 is fragment i, alpha = 1 fragment j.
/// @throws Error{kData} unless c_i and c_j have one size, and e_i and e_j.
[[nodiscard]] Eigen::VectorXd style_features(const Eigen::Ref<const Eigen::VectorXd>& c_i,
                                             const Eigen::Ref<const Eigen::VectorXd>& c_j,
                                             const EffortVector& e_i, const EffortVector& e_j,
                                             double alpha);

/// The same blends told from the other end: [c_j, c_i, e_j, e_i, 1 - alpha].
/// @param z  D x N, D = feature_count(components, factors). @throws Error{kData} for another D.
[[nodiscard]] Eigen::MatrixXd swap_order(const Eigen::Ref<const Eigen::MatrixXd>& z,
                                         int factors = kFactorCount);

/// `factors` x N: (1 - alpha) e_i + alpha e_j of each column of z (METHODS 1.3, model 1).
[[nodiscard]] EffortMatrix linear_interpolation(const Eigen::Ref<const Eigen::MatrixXd>& z,
                                                int factors = kFactorCount);

/// Labelled blends: what regressors learn from and are tested on.
struct StyleSamples {
  Eigen::MatrixXd features;  ///< D x N columns z
  EffortMatrix labels;       ///< F x N, (flow, weight, time) or those and space
  /// One label a column: columns of one group (one blend judged by several observers) stay together
  /// in every fold and split. Empty: each column by itself.
  std::vector<int> groups;
  /// Weight of each column's squared error, > 0: how far its label is trusted (a label's
  /// confidence). Empty: all 1. A column of weight 2 pulls as two equal ones would. Weights say
  /// nothing of the features: these are standardized alike.
  Eigen::VectorXd weights;

  [[nodiscard]] int count() const noexcept { return static_cast<int>(features.cols()); }
  /// F: kFactorCount or kMaxFactorCount.
  [[nodiscard]] int factor_count() const noexcept { return static_cast<int>(labels.rows()); }
  /// The chosen columns, in that order.
  [[nodiscard]] StyleSamples subset(std::span<const int> columns) const;
  /// @throws Error{kData} unless sizes agree, D is a feature_count of F, all values are finite and
  ///         weights > 0.
  void check() const;
};

/// Values that cross-validation chooses from; each factor chooses for itself (METHODS 1.3).
///
/// SVR's grid is searched in two steps, width and C at the middle epsilon first, then epsilon,
/// which costs half of all combinations.
///
/// Widths are in units of the median distance between standardized training samples; U multiplies
/// the squared loss (ridge = 1/U). SVR's C and epsilon are in units of the standard deviation of
/// the training labels, so that the grid does not depend on the scale of the labels.
struct RegressorGrid {
  std::vector<double> relative_widths = {0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 4.0, 8.0};
  std::vector<double> loss_weights = {1e-3, 1e-2, 0.1,   0.3, 1.0, 3.0,
                                      10.0, 30.0, 100.0, 1e3, 1e4, 1e5};
  std::vector<double> linear_loss_weights = {1e-4, 1e-3, 3e-3, 1e-2, 3e-2,
                                             0.1,  0.3,  1.0,  10.0, 100.0};
  std::vector<double> svr_relative_widths = {0.5, 0.7, 1.0, 1.4, 2.0};
  std::vector<double> svr_loss_weights = {1.0, 5.0, 25.0, 100.0};
  std::vector<double> svr_epsilons = {0.03, 0.1, 0.3};
  /// The fifth's: widths, and noise variances in units of the signal's (each a ridge, 1/U).
  std::vector<double> averaged_relative_widths = {0.35, 0.5, 0.7, 1.0, 1.4, 2.0};
  std::vector<double> averaged_noise_ratios = {0.01, 0.03, 0.1,  0.3,   1.0,
                                               3.0,  10.0, 30.0, 100.0, 300.0};

  /// Broken rules, each naming field, value and rule; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

struct StyleRegressorOptions {
  /// (Ours.) A blend counts in both orders, X_ij at alpha and X_ji at 1 - alpha, always in the same
  /// fold, and predictions do not depend on the order. Off in the paper's protocol.
  bool symmetric = true;
  /// Folds of the cross-validation on the training samples; >= 2.
  int folds = 10;
  /// Of the random assignment to folds.
  std::uint64_t seed = 1;
  RegressorGrid grid;

  /// Broken rules, each naming field, value and rule; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// What training settled on for one factor; for the training record and for reports.
struct FactorFit {
  double width = 0.0;           ///< of the Gaussian, in standardized features; 0 if there is none
  double relative_width = 0.0;  ///< the same in median distances
  double loss_weight = 0.0;     ///< U or C (in label units); 0 if there is none
  double epsilon = 0.0;         ///< SVR's tube, in label units
  /// Pooled tenfold (weighted) squared error of the choice on the training samples; for linear
  /// interpolation, which learns nothing, its plain squared error there.
  double held_out_squared_error = 0.0;
};

/// Prediction with its standard error: about 68 % of labels that were not seen in training lie in
/// mean +- standard_error.
struct StylePrediction {
  EffortMatrix mean;
  EffortMatrix standard_error;
};

/// How far labels lie from predictions: for a factor f the standard error is unit_f times
///   sqrt((1 - bulge_share_f + bulge_share_f b(alpha)^2 / bulge_mean_square) * (1 + v(z)) / 2),
/// b(alpha) = alpha (1 - alpha), which is 0 at the seeds, and v(z) in [0, 1] the share of variance
/// that a Gaussian process of noise as strong as its signal is left with at z: it grows with the
/// distance to the training blends. The shape is the one that makes the held-out residuals
/// likeliest; the unit is such that it covers 68 % of them (split-conformal calibration on
/// cross-validated residuals).
struct ErrorSpread {
  learn::Standardizer scale;
  Eigen::MatrixXd centers;  ///< D x 2 N scaled training features, then told from the other end
  double width = 1.0;       ///< of the Gaussian
  double bulge_mean_square = 1.0;
  EffortVector bulge_share;  ///< in [0, 1]
  EffortVector unit;
};

/// Scratch memory of predictions; give the same one to every call to spare allocations.
struct StyleScratch {
  Eigen::MatrixXd standardized;
  Eigen::MatrixXd squared;
  Eigen::MatrixXd kernel;
};

/// What a StyleRegressor is made of; C centers (0 if no factor uses a kernel), D features, F
/// factors. The form of every kind, for a factor f with s(z) the standardized features:
///   interpolation_f * linear interpolation + offset_f + weights_f' s(z)
///     + sum_n coefficients_fn exp(-|s(z) - center_n|^2 / (2 width_f^2))
///     + b(alpha) (bulge_offset_f + sum_n bulge_fn exp(-|s(z) - center_n|^2 / (2 width_f^2))),
/// b(alpha) = alpha (1 - alpha), cut to [-3, 3] if `bounded`.
struct StyleRegressorState {
  RegressorKind kind = RegressorKind::kLinearInterpolation;
  /// Then center n and center n + C / 2 are one training blend told from its two ends.
  bool symmetric = false;
  /// Labels lie in [-3, 3], so does what is expected of them.
  bool bounded = false;
  learn::Standardizer scale;
  EffortVector interpolation;   ///< F values, 0 or 1
  EffortVector offset;          ///< F
  EffortMatrix weights;         ///< F x D
  Eigen::MatrixXd centers;      ///< D x C, standardized training features
  EffortMatrix coefficients;    ///< F x C
  EffortVector bulge_offset;    ///< F
  EffortMatrix bulge;           ///< F x C
  std::vector<FactorFit> fits;  ///< F
  /// nullopt: of a model file older than it; then the held-out error of the fit stands for it.
  std::optional<ErrorSpread> spread;
};

/// Predicts the Effort of a blend from z. Immutable; const members may be called from many threads.
class StyleRegressor {
 public:
  /// From its parts; use fit_style_regressor to learn one.
  /// @throws Error{kData} if sizes do not agree, a value is not finite, or a width is not > 0
  ///         where a factor has a coefficient.
  explicit StyleRegressor(StyleRegressorState state);

  [[nodiscard]] RegressorKind kind() const noexcept { return state_.kind; }
  [[nodiscard]] int feature_rows() const noexcept {
    return static_cast<int>(state_.scale.mean.size());
  }
  /// Predictions do not depend on the order of i and j.
  [[nodiscard]] bool symmetric() const noexcept { return state_.symmetric; }
  /// 3, or 4 where Space was labelled.
  [[nodiscard]] int factor_count() const noexcept { return static_cast<int>(state_.offset.size()); }
  [[nodiscard]] std::span<const Factor> factors() const noexcept {
    return factors_of(factor_count());
  }
  [[nodiscard]] const std::vector<FactorFit>& fits() const noexcept { return state_.fits; }
  [[nodiscard]] const StyleRegressorState& state() const noexcept { return state_; }

  /// F x N predictions; those of the paper's models are not cut to [-3, 3].
  /// @param z  D x N. @throws Error{kData} unless D = feature_rows().
  /// Time about N * C * (F exponentials + D multiplications); C is the number of training samples,
  /// twice that if symmetric.
  [[nodiscard]] EffortMatrix predict(const Eigen::Ref<const Eigen::MatrixXd>& z) const;
  [[nodiscard]] EffortMatrix predict(const Eigen::Ref<const Eigen::MatrixXd>& z,
                                     StyleScratch& scratch) const;

  /// Every pair at every alpha: column p * M + m of the result is pair p at alphas[m].
  ///
  /// Many times faster than predict on a grid: along one pair only alpha moves, so each Gaussian
  /// splits into a factor of the pair and one of alpha, and the sum over samples is a matrix
  /// product.
  /// @param pairs   (D - 1) x P: z without its last row.
  /// @throws Error{kData} unless pairs has feature_rows() - 1 rows.
  [[nodiscard]] EffortMatrix predict_curves(const Eigen::Ref<const Eigen::MatrixXd>& pairs,
                                            std::span<const double> alphas,
                                            StyleScratch& scratch) const;

  /// The same with the standard error of each, for every kind; for a model file from before it was
  /// stored the root of the held-out squared error. Never nullopt (it was for some kinds).
  /// Factorises a kernel at each call: give it all columns at once.
  [[nodiscard]] std::optional<StylePrediction> predict_with_error(
      const Eigen::Ref<const Eigen::MatrixXd>& z) const;

  /// F x alphas.size() standard errors as they are of blends like those learnt from, whatever the
  /// pair: a search asks for very many. The held-out error for models from before there were any.
  [[nodiscard]] EffortMatrix typical_errors(std::span<const double> alphas) const;

  /// Adds this model's arrays to a model file, each name beginning with `prefix` + ".".
  void save(base::Container& container, const std::string& prefix) const;
  /// @throws Error{kFormat} if an array is missing, sizes do not agree or a value breaks a rule.
  [[nodiscard]] static StyleRegressor load(const base::Container& container,
                                           const std::string& prefix);

 private:
  StyleRegressorState state_;
  Eigen::VectorXd center_norms_;  // C squared norms of the centers
};

/// Learns one regressor a factor. Hyper-parameters are chosen by cross-validation on these samples
/// only; features are standardized with their statistics (with `symmetric`, of both orders).
///
/// The paper's models take the grid point of least pooled held-out squared error.
///
/// The fifth (ours) adds to linear interpolation what it is seen to miss, cautiously, for that is
/// small and has heavy tails. It does not depend on the order of a blend, whatever `symmetric`
/// says; content, efforts and alpha count alike in its distances; what interpolation misses is cut
/// to 2.5 of its robust standard deviations before it is learnt from; kernel ridges of every ridge
/// of a grid are averaged, with and without a part common to all blends, each with the whole grid's
/// worth of "nothing at all", by their tempered Gaussian process evidence (only the common part is
/// left far from all blends); all are in proportion to alpha (1 - alpha), for a blend at alpha = 0
/// or 1 is its seed; predictions are cut to [-3, 3]. Where the same average of kernel ridges on the
/// labels themselves is surely better (by more than two standard errors of the paired held-out
/// differences) interpolation misleads, and it is that: StyleRegressorState::interpolation tells.
///
/// Every learner minimises the weighted loss, U sum_n w_n L(f(z_n) - e_n), and choices are made by
/// the weighted error. SVR alone can not: libsvm's regression has one C for all samples.
///
/// @throws Error{kUsage} if `options` has problems, or for SVR on samples of different weights;
///         Error{kData} if samples.check() fails or there are fewer than 3 samples (or groups);
///         Error{kNumeric} if no grid point solves.
[[nodiscard]] StyleRegressor fit_style_regressor(const StyleSamples& samples, RegressorKind kind,
                                                 const StyleRegressorOptions& options = {});

/// The same for several kinds, sharing folds, distances and kernels: result k is what
/// fit_style_regressor gives for kinds[k].
[[nodiscard]] std::vector<StyleRegressor> fit_style_regressors(
    const StyleSamples& samples, std::span<const RegressorKind> kinds,
    const StyleRegressorOptions& options = {});

/// The regressor for style transfer (METHODS 1.3): the fifth, which decides factor by factor.
[[nodiscard]] StyleRegressor fit_default_regressor(const StyleSamples& samples,
                                                   const StyleRegressorOptions& options = {});

}  // namespace laban::effort
