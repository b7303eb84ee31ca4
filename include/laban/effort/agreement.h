#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/effort/label_table.h"

namespace laban::effort {

// How far raters agree, on ratings of one interval scale: U x R matrices, a row a unit (what is
// rated), a column a rater, NaN where a rater has not rated a unit.

/// Confidence interval of an estimate.
struct Interval {
  double low = 0.0;
  double high = 0.0;
};

struct BootstrapOptions {
  int resamples = 2000;
  std::uint64_t seed = 1;
  double level = 0.95;  ///< of the interval, in (0, 1)

  /// Broken rules, each naming field, value and rule; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Krippendorff's alpha: 1 is perfect agreement, 0 that of values dealt out at random.
struct KrippendorffAlpha {
  /// nullopt if nothing can be paired, or if all values are equal: then agreement is not to be told
  /// from a scale that nobody uses.
  std::optional<double> alpha;
  /// Percentiles of alpha over samples of units drawn with replacement; nullopt if alpha is, or if
  /// it is defined in no resample.
  std::optional<Interval> interval;
  int units = 0;      ///< with at least two values: the others tell nothing of agreement
  int values = 0;     ///< in these units
  int resamples = 0;  ///< in which alpha was defined
};

/// alpha = 1 - D_o / D_e with the interval metric (c - k)^2 [Krippendorff11, C and D]: raters may
/// have rated any units; a unit with m values counts m times, each pair in it 1 / (m - 1).
/// @throws Error{kUsage} if `options` has problems. Time O(resamples * U + U * R).
[[nodiscard]] KrippendorffAlpha krippendorff_alpha(const Eigen::Ref<const Eigen::MatrixXd>& ratings,
                                                   const BootstrapOptions& options = {});

/// Intraclass correlation of single ratings.
struct IntraclassCorrelation {
  /// nullopt with fewer than two units, or raters, or if all values are equal.
  std::optional<double> value;
  std::optional<Interval> interval;
  int units = 0;    ///< that entered
  int dropped = 0;  ///< units with a value that did not: the analysis of variance needs them whole
};

/// ICC(2,1) of [ShroutFleiss79], ICC(A,1) of [McGrawWong96]: raters are a random sample, and a
/// rater's bias counts against agreement. The interval is that of [ShroutFleiss79, p. 424], by F
/// with Satterthwaite's degrees of freedom. Only units that all R raters have rated enter.
/// @param level  of the interval, in (0, 1). @throws Error{kUsage} otherwise.
[[nodiscard]] IntraclassCorrelation icc_two_way(const Eigen::Ref<const Eigen::MatrixXd>& ratings,
                                                double level = 0.95);

/// ICC(1,1) of [ShroutFleiss79]: columns have no meaning of their own (repeats of one rater). Units
/// with at least two values enter; where their counts differ, k is replaced by k_0 = (N - sum
/// k_u^2 / N) / (U - 1) [Donner86] and there is no interval.
/// @param level  of the interval, in (0, 1). @throws Error{kUsage} otherwise.
[[nodiscard]] IntraclassCorrelation icc_one_way(const Eigen::Ref<const Eigen::MatrixXd>& ratings,
                                                double level = 0.95);

/// Mean over units with at least two values of the mean absolute difference of their pairs; nullopt
/// if there is no such unit.
[[nodiscard]] std::optional<double> mean_absolute_difference(
    const Eigen::Ref<const Eigen::MatrixXd>& ratings);

struct AgreementOptions {
  /// Raters to compare, by name; empty: every observer whose source is expert or performer. (An
  /// observer that is a formula agrees with itself, and is asked for by name.)
  std::vector<std::string> raters;
  BootstrapOptions bootstrap;
};

/// Agreement between raters on one factor.
struct FactorAgreement {
  std::string factor;  ///< "flow", "weight", "time" or "space"
  KrippendorffAlpha alpha;
  IntraclassCorrelation icc;  ///< icc_two_way
};

/// Agreement of one rater with that rater's own repeats, on one factor.
struct RepeatAgreement {
  std::string rater;
  std::string factor;
  int units = 0;   ///< judged more than once
  int values = 0;  ///< in these
  double mean_absolute_difference = 0.0;
  IntraclassCorrelation icc;  ///< icc_one_way
};

struct AgreementReport {
  std::vector<std::string> raters;       ///< compared, in order of first appearance
  int fragments = 0;                     ///< fragments and blends that one of them has rated
  std::vector<FactorAgreement> factors;  ///< those rated; empty if there is one rater only
  std::vector<RepeatAgreement> repeats;  ///< by rater, then factor
};

/// Agreement between and within the raters of a label table, factor by factor.
///
/// A unit is a fragment or blend, a rater an observer (of one source; an observer with two is two
/// raters, the second told apart as "ann (performer)"). Between raters, each one's first judgement
/// counts, repeats only within. Rows of confidence 0 count nowhere; other confidences are not
/// looked at. Factors may be left blank.
/// @throws Error{kUsage} if options have problems or name a rater that the table has not;
///         Error{kData} if there is neither a second rater nor a repeat.
[[nodiscard]] AgreementReport rater_agreement(const LabelTable& table,
                                              const AgreementOptions& options = {});

}  // namespace laban::effort
