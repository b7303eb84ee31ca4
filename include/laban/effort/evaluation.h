#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
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

/// The paper's figure for a factor and model; nullopt for Space and for the fifth, which it has
/// not.
[[nodiscard]] std::optional<double> paper_mean_squared_error(Factor factor, RegressorKind kind);

/// How blends are held out of training, to be tested on.
enum class Protocol {
  kRandom,             ///< random splits of the blends, the paper's
  kLeavePerformerOut,  ///< one run a performer: tested on every blend with a parent by them
  kLeaveContentOut,    ///< one run a content: tested on its blends
};

inline constexpr std::array<Protocol, 3> kProtocols = {
    Protocol::kRandom, Protocol::kLeavePerformerOut, Protocol::kLeaveContentOut};

/// "random", "leave-performer-out" or "leave-content-out".
[[nodiscard]] std::string_view name_of(Protocol protocol);
/// The protocol of that name; nullopt if there is none.
[[nodiscard]] std::optional<Protocol> protocol_named(std::string_view name);

/// Columns of the samples that one run trains and tests on; ascending, disjoint.
struct Split {
  std::vector<int> train;
  std::vector<int> test;
};

/// The groups (performers, contents) that the parents of each blend belong to.
struct ParentGroups {
  std::vector<int> first;          ///< of parent i of each column; a number of `names`
  std::vector<int> second;         ///< of parent j; equal to `first` if both are of one group
  std::vector<std::string> names;  ///< of group 0, 1, ..

  /// @throws Error{kData} unless there is a known group for both parents of `count` columns.
  void check(int count) const;
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

/// What an interval says of a difference: on which side of zero it lies.
enum class Verdict { kBelow, kWithinNoise, kAbove };

/// "below", "within noise" or "above".
[[nodiscard]] std::string_view name_of(Verdict verdict);

/// A mean and how sure it is.
struct Estimate {
  double mean = 0.0;
  /// Random splits: standard deviation over runs / sqrt(runs), how far the mean is from that of
  /// endlessly many splits of *these* blends. Leaving one out: that of the tested blends, as if
  /// they were independent. Infinite for a single one.
  double standard_error = 0.0;
  /// For *other* blends. Random splits share blends: variance over runs * (1 / runs + test / train)
  /// [NadeauBengio03]. Leaving one out: blends share performers, math::dyadic_mean. Infinite where
  /// it cannot be told.
  double corrected_standard_error = 0.0;
  /// Runs - 1, or groups (performers, contents) met - 1.
  int degrees_of_freedom = 0;
  /// 95 % interval of the mean: corrected_standard_error times Student's t.
  double low = 0.0;
  double high = 0.0;

  /// Of the interval and zero; at its very end it is noise.
  [[nodiscard]] Verdict verdict() const noexcept;
};

struct ModelScore {
  RegressorKind kind = RegressorKind::kLinearInterpolation;
  Estimate error;                       ///< mean squared error on the test blends
  double ratio_to_interpolation = 0.0;  ///< of the means; 0 / 0 is 1
  std::optional<double> paper;          ///< the paper's mean squared error
};

/// One model against another on the same test blends.
struct PairedDifference {
  RegressorKind model = RegressorKind::kResidualKernelRidge;
  RegressorKind against = RegressorKind::kKernelRidge;
  Estimate difference;  ///< of mean squared errors, model - against: below 0 is better
};

/// What the paired differences say of the fifth regressor, at 95 %.
struct FifthStanding {
  bool below_interpolation = false;  ///< its interval against linear interpolation is below zero
  /// The interval of linear interpolation's own error is above zero. If it is not, these blends and
  /// performers cannot tell: not even a model without error would be surely below.
  bool could_be_below = false;
  bool not_above_others = true;  ///< none of those against the paper's other three is above
};

struct FactorReport {
  Factor factor = Factor::kFlow;
  double label_variance = 0.0;  ///< of all labels given, divisor N
  std::vector<ModelScore> models;
  /// Every model against linear interpolation, then the fifth against each other of the paper's, in
  /// the order of `models`, as far as they are evaluated.
  std::vector<PairedDifference> differences;
  /// The fifth against the best (lowest mean) of the others; nullopt if either is not evaluated.
  std::optional<PairedDifference> fifth_against_best;

  /// nullopt if the fifth is not evaluated.
  [[nodiscard]] std::optional<FifthStanding> fifth_standing() const;
};

/// One run, as it was made.
struct EvaluationRun {
  std::string held_out;  ///< performer or content; empty for random and given splits
  int train = 0;         ///< columns
  int test = 0;
};

/// A run that was not made, and why.
struct SkippedRun {
  EvaluationRun run;
  std::string reason;
};

/// Squared errors of single blends, for protocols in which each is tested in few runs.
struct TestedBlends {
  std::vector<int> columns;  ///< of the samples, ascending
  std::vector<int> first;    ///< groups of their parents
  std::vector<int> second;
  /// Per factor, blends x models: the squared error, mean over the runs that held the blend out.
  std::vector<Eigen::MatrixXd> squared_errors;
};

struct EvaluationReport {
  Protocol protocol = Protocol::kRandom;
  int runs = 0;
  int train = 0;  ///< blends (of given splits and when leaving one out: columns of the first run)
  int test = 0;
  double test_to_train = 0.0;         ///< columns tested over columns trained on, mean over runs
  std::vector<FactorReport> factors;  ///< those of the labels, in order
  std::vector<EvaluationRun> run_list;
  std::vector<SkippedRun> skipped;  ///< leaving one out only
  /// Per factor, a runs x models matrix of test errors, columns as in FactorReport::models, for
  /// plots and other comparisons.
  std::vector<Eigen::MatrixXd> run_errors;
  /// What means and intervals are of when one group is left out; nullopt for other protocols, in
  /// which they are over runs.
  std::optional<TestedBlends> blends;

  /// Any model against any other. Differences that are round-off of the two errors count as zero.
  /// @throws Error{kUsage} if one was not evaluated.
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

/// The same on given splits, which may overlap as random ones do; runs, train, test and the splits'
/// seed of `options` are not read.
[[nodiscard]] EvaluationReport evaluate_splits(const StyleSamples& samples,
                                               std::span<const Split> splits,
                                               const EvaluationOptions& options = {},
                                               base::Progress* progress = nullptr);

/// One split a group, in their order: every column with a parent in it is held out, the rest is
/// trained on. Either part may be empty.
/// @throws Error{kData} if the groups do not fit.
[[nodiscard]] std::vector<Split> leave_one_out_splits(const ParentGroups& groups, int count);

/// The features of all columns (D x N) as they are known without a group.
using FeaturesWithout = std::function<Eigen::MatrixXd(int group)>;

/// Leaves one performer or one content out at a time: does what was learnt carry over to others?
///
/// A group whose blends leave fewer than three to train on, or that has none, is not run but told
/// in `skipped`. Each tested blend counts once, whatever the size of its group: its error is the
/// mean over the runs that hold it out (two if its parents are of two performers). Intervals are
/// for other performers or contents: Student's t with groups - 1 degrees of freedom on the standard
/// error of math::dyadic_mean.
///
/// @param features_without  makes what a run may know, so that nothing is learnt from the group it
///        leaves out; called from several threads. Empty: samples.features in every run.
/// @param options  runs, train and test are not read; the seed is of the folds.
/// @throws Error{kData} if the groups do not fit or no run is left; as evaluate.
[[nodiscard]] EvaluationReport evaluate_leaving_one_out(const StyleSamples& samples,
                                                        const ParentGroups& groups,
                                                        Protocol protocol,
                                                        const FeaturesWithout& features_without,
                                                        const EvaluationOptions& options = {},
                                                        base::Progress* progress = nullptr);

}  // namespace laban::effort
