#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/progress.h"
#include "laban/effort/effort.h"
#include "laban/effort/style_regressor.h"

namespace laban::effort {

/// Mean squared errors that the paper reports [Torresani06, table 1], rows Flow, Weight, Time;
/// columns linear interpolation, linear ridge, kernel ridge, SVR (METHODS 1.4). Expert labels of
/// captures that are not public: to be printed beside ours, not to be equalled.
inline constexpr std::array<std::array<double, 4>, kFactorCount> kPaperMeanSquaredError = {{
    {0.65, 1.03, 0.50, 0.48},
    {0.97, 1.04, 0.39, 0.48},
    {1.01, 1.01, 0.60, 0.61},
}};

/// The paper's figure for a factor and model; nullopt for the fifth, which it has not.
[[nodiscard]] std::optional<double> paper_mean_squared_error(Factor factor, RegressorKind kind);

/// Columns of the samples that one run trains and tests on; ascending, disjoint.
struct Split {
  std::vector<int> train;
  std::vector<int> test;
};

struct EvaluationOptions {
  /// Random splits; >= 2. The paper's protocol: 500 runs of 85 / 20 of 105 blends.
  int runs = 500;
  /// Blends trained on and tested on in a run; train >= 3, test >= 1, together at most the blends
  /// there are. A blend is a column, or a group of columns if the samples name groups.
  int train = 85;
  int test = 20;
  /// Compared models, in the order of the report; linear interpolation is always evaluated for the
  /// ratios (appended if not named).
  std::vector<RegressorKind> models = {kRegressors.begin(), kRegressors.end()};
  /// Of splits and folds.
  std::uint64_t seed = 1;
  /// Threads over runs; 0: all cores. The result does not depend on it.
  int threads = 0;
  /// Paper's protocol: off (METHODS 1.3).
  bool symmetric = false;
  int folds = 10;
  RegressorGrid grid;

  /// Broken rules, each naming field, value and rule; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Mean over runs and how sure it is.
struct Estimate {
  double mean = 0.0;
  /// Standard deviation over runs / sqrt(runs): how far the mean is from that of endlessly many
  /// splits of *these* blends.
  double standard_error = 0.0;
  /// Runs share blends, so the above says little about other blends. This one does: variance over
  /// runs * (1 / runs + test / train) [NadeauBengio03].
  double corrected_standard_error = 0.0;
};

struct ModelScore {
  RegressorKind kind = RegressorKind::kLinearInterpolation;
  Estimate error;                       ///< mean squared error on the test blends
  double ratio_to_interpolation = 0.0;  ///< of the means; 0 / 0 is 1
  std::optional<double> paper;          ///< the paper's mean squared error
};

/// One model against another on the same splits.
struct PairedDifference {
  RegressorKind model = RegressorKind::kResidualKernelRidge;
  RegressorKind against = RegressorKind::kKernelRidge;
  Estimate difference;  ///< of mean squared errors, model - against: below 0 is better
};

struct FactorReport {
  Factor factor = Factor::kFlow;
  double label_variance = 0.0;  ///< of all labels given, divisor N
  std::vector<ModelScore> models;
  /// The fifth against the best (lowest mean) of the others; nullopt if either is not evaluated.
  std::optional<PairedDifference> fifth_against_best;
};

struct EvaluationReport {
  int runs = 0;
  int train = 0;  ///< blends (of given splits: columns of the first)
  int test = 0;
  double test_to_train = 0.0;  ///< columns tested over columns trained on, mean over runs
  std::array<FactorReport, kFactorCount> factors;
  /// Per factor, a runs x models matrix of test errors, columns as in FactorReport::models, for
  /// plots and other comparisons.
  std::array<Eigen::MatrixXd, kFactorCount> run_errors;

  /// Any model against any other. @throws Error{kUsage} if one was not evaluated.
  [[nodiscard]] PairedDifference compare(Factor factor, RegressorKind model,
                                         RegressorKind against) const;
};

/// Seeded random splits of the samples' blends; split r depends on seed and r only.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if there are too few blends.
[[nodiscard]] std::vector<Split> random_splits(const StyleSamples& samples,
                                               const EvaluationOptions& options);

/// The protocol of Table 1 [Torresani06, 6; METHODS 1.4]: every model learns on the same training
/// part of every split, hyper-parameters chosen inside it, and is tested on the rest.
///
/// @param progress  told the share of runs done; may be null.
/// @throws as random_splits and fit_style_regressors; Error{kUsage} "interrupted" if progress asks.
[[nodiscard]] EvaluationReport evaluate(const StyleSamples& samples,
                                        const EvaluationOptions& options = {},
                                        base::Progress* progress = nullptr);

/// The same on given splits (leave one performer out, ..); runs, train, test and the splits' seed
/// of `options` are not read.
[[nodiscard]] EvaluationReport evaluate_splits(const StyleSamples& samples,
                                               std::span<const Split> splits,
                                               const EvaluationOptions& options = {},
                                               base::Progress* progress = nullptr);

}  // namespace laban::effort
