#include "laban/effort/agreement.h"

#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "laban/base/csv.h"
#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "laban/math/f_distribution.h"
#include "laban/math/statistics.h"

namespace laban::effort {
namespace {

using base::Error;
using base::ErrorKind;
using Ratings = Eigen::Ref<const Eigen::MatrixXd>;

void require_level(double level) {
  if (level > 0.0 && level < 1.0) return;
  throw Error(ErrorKind::kUsage,
              "agreement: level = " + base::format_number(level) + " (must be in (0, 1))");
}

/// The values of each unit; a unit has at least one.
using Units = std::vector<std::vector<double>>;

Units values_by_unit(const Ratings& ratings) {
  Units units;
  for (Eigen::Index u = 0; u < ratings.rows(); ++u) {
    std::vector<double> values;
    for (Eigen::Index r = 0; r < ratings.cols(); ++r) {
      if (!std::isnan(ratings(u, r))) values.push_back(ratings(u, r));
    }
    if (!values.empty()) units.push_back(std::move(values));
  }
  return units;
}

/// The units with at least two values.
Units pairable(Units units) {
  std::erase_if(units, [](const auto& values) { return values.size() < 2; });
  return units;
}

double sum_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

double sum_of_squares_about(const std::vector<double>& values, double center) {
  double sum = 0.0;
  for (const double value : values) sum += (value - center) * (value - center);
  return sum;
}

/// A sum of squares that is no more than round-off of the values' own sum of squares is 0.
double without_round_off(double sum, double squares) {
  return sum > 1e-24 * squares ? sum : 0.0;
}

// Notation [Krippendorff11]     here
//   n     pairable values       UnitSums::count, summed
//   D_o   observed              sum of `within` / n
//   D_e   expected              sum of squares about the mean / (n - 1)
// Both without a common factor of 2: the sum of (c - k)^2 over all ordered pairs of m values is 2 m
// times their sum of squares about their mean, so alpha needs no pairs.

/// What a unit adds to alpha.
struct UnitSums {
  double count = 0.0;
  double sum = 0.0;      ///< of the values, about the mean of all
  double squares = 0.0;  ///< of the same
  double within = 0.0;   ///< m / (m - 1) times the sum of squares about the unit's own mean

  void add(const UnitSums& other) {
    count += other.count;
    sum += other.sum;
    squares += other.squares;
    within += other.within;
  }

  [[nodiscard]] std::optional<double> alpha() const {
    const double about_mean = squares - sum * sum / count;
    if (!(about_mean > 1e-12 * squares)) return std::nullopt;  // a difference of sums: round-off
    return 1.0 - (within / count) / (about_mean / (count - 1.0));
  }
};

std::vector<UnitSums> sums_of(const Units& units) {
  double count = 0.0, sum = 0.0, squares = 0.0;
  for (const auto& values : units) {
    count += static_cast<double>(values.size());
    sum += sum_of(values);
    squares += sum_of_squares_about(values, 0.0);
  }
  const double mean = sum / count;
  std::vector<UnitSums> sums;
  for (const auto& values : units) {
    const auto m = static_cast<double>(values.size());
    sums.push_back({m, sum_of(values) - m * mean,
                    without_round_off(sum_of_squares_about(values, mean), squares),
                    m / (m - 1.0) * sum_of_squares_about(values, sum_of(values) / m)});
  }
  return sums;
}

Interval percentile_interval(const std::vector<double>& values, double level) {
  return {math::percentile(values, 50.0 * (1.0 - level)),
          math::percentile(values, 50.0 * (1.0 + level))};
}

/// Mean squares of U units and k raters, letters as in [ShroutFleiss79, table 2].
struct MeanSquares {
  double n = 0.0, k = 0.0;
  double BMS = 0.0;  ///< between units
  double JMS = 0.0;  ///< between raters (judges)
  double EMS = 0.0;  ///< residual
};

MeanSquares two_way(const Eigen::MatrixXd& x) {
  const auto n = static_cast<double>(x.rows()), k = static_cast<double>(x.cols());
  const double mean = x.mean();
  const Eigen::VectorXd unit = x.rowwise().mean();
  const Eigen::RowVectorXd judge = x.colwise().mean();
  // Residuals one by one: what they leave of a difference of large sums would be round-off.
  const Eigen::MatrixXd residual = ((x.colwise() - unit).rowwise() - judge).array() + mean;
  const auto mean_square = [&](double sum, double degrees) {
    return without_round_off(sum, x.squaredNorm()) / degrees;
  };
  return {n, k, mean_square(k * (unit.array() - mean).square().sum(), n - 1.0),
          mean_square(n * (judge.array() - mean).square().sum(), k - 1.0),
          mean_square(residual.squaredNorm(), (n - 1.0) * (k - 1.0))};
}

/// [ShroutFleiss79, p. 424]: confidence interval of ICC(2,1), `rho` its estimate.
Interval interval_of_two_way(const MeanSquares& m, double rho, double level) {
  const auto& [n, k, BMS, JMS, EMS] = m;
  if (JMS == 0.0 && EMS == 0.0) return {1.0, 1.0};
  // Degrees of freedom v of the sum of JMS and EMS, both numerator and denominator of the paper's
  // formula multiplied by EMS^2, so that EMS may be 0.
  const double a = k * rho * JMS;
  const double b = (n * (1.0 + (k - 1.0) * rho) - k * rho) * EMS;
  const double v = (k - 1.0) * (n - 1.0) * (a + b) * (a + b) / ((n - 1.0) * a * a + b * b);
  // Where rho < 0, a and b may all but cancel; the bounds for v = 0.1 are those for 0 to any digit.
  const double df = std::max(v, 0.1);
  const double p = 0.5 * (1.0 + level);
  const double f_low = math::f_quantile(p, n - 1.0, df);
  const double f_high = math::f_quantile(p, df, n - 1.0);
  const double others = k * JMS + (k * n - k - n) * EMS;
  return {n * (BMS - f_low * EMS) / (f_low * others + n * BMS),
          n * (f_high * BMS - EMS) / (others + n * f_high * BMS)};
}

/// [ShroutFleiss79, p. 424]: confidence interval of ICC(1,1).
Interval interval_of_one_way(double n, double k, double BMS, double WMS, double level) {
  if (WMS == 0.0) return {1.0, 1.0};
  const double p = 0.5 * (1.0 + level);
  const double f = BMS / WMS;
  const double f_low = f / math::f_quantile(p, n - 1.0, n * (k - 1.0));
  const double f_high = f * math::f_quantile(p, n * (k - 1.0), n - 1.0);
  return {(f_low - 1.0) / (f_low + k - 1.0), (f_high - 1.0) / (f_high + k - 1.0)};
}

struct FactorField {
  const char* name;
  std::optional<double> LabelRow::*field;
};
constexpr std::array<FactorField, 4> kNamedFactors = {{{"flow", &LabelRow::flow},
                                                       {"weight", &LabelRow::weight},
                                                       {"time", &LabelRow::time},
                                                       {"space", &LabelRow::space}}};

using Rater = std::pair<std::string, LabelSource>;  // observer and source

bool counts(const LabelRow& row) {
  return row.confidence != 0.0 && (row.flow || row.weight || row.time || row.space);
}

/// Raters in order of first appearance.
struct Raters {
  std::map<Rater, std::size_t> number;
  std::vector<LabelSource> sources;
  std::vector<std::string> names;

  void add(const Rater& rater, const std::string& name) {
    number.emplace(rater, names.size());
    sources.push_back(rater.second);
    names.push_back(name);
  }
  [[nodiscard]] std::optional<std::size_t> find(const LabelRow& row) const {
    const auto at = number.find({row.observer, row.source});
    return at == number.end() ? std::nullopt : std::optional(at->second);
  }
};

Raters all_raters(const LabelTable& table) {
  Raters found;
  std::set<std::string> observers;
  for (const LabelRow& row : table.rows) {
    if (!counts(row) || found.find(row)) continue;
    const std::string source = "(" + std::string(to_string(row.source)) + ")";
    const bool again = !observers.insert(row.observer).second;
    found.add({row.observer, row.source}, row.observer.empty() ? source
                                          : again              ? row.observer + " " + source
                                                               : row.observer);
  }
  return found;
}

bool is_person(LabelSource source) {
  return source == LabelSource::kExpert || source == LabelSource::kPerformer;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "'" : ", '") + name + "'";
  return text.empty() ? "none" : text;
}

/// Those asked for by name, in the table's order; without names all who are people.
Raters chosen_raters(const LabelTable& table, const std::vector<std::string>& names) {
  const Raters all = all_raters(table);
  const std::set<std::string> asked(names.begin(), names.end());
  const std::set<std::string> there(all.names.begin(), all.names.end());
  for (const std::string& name : names) {
    if (there.contains(name)) continue;
    throw Error(ErrorKind::kUsage,
                "no row has labels by rater '" + name + "' (raters are " + listed(all.names) + ")");
  }
  std::vector<const Rater*> raters(all.names.size());
  for (const auto& [rater, number] : all.number) raters[number] = &rater;
  Raters chosen;
  for (std::size_t r = 0; r < raters.size(); ++r) {
    if (names.empty() ? is_person(all.sources[r]) : asked.contains(all.names[r])) {
      chosen.add(*raters[r], all.names[r]);
    }
  }
  return chosen;
}

/// By fragment in order of first appearance, then by rater: the rows in order of their repeat.
using Judgements = std::vector<std::map<std::size_t, std::vector<const LabelRow*>>>;

Judgements judgements_of(const LabelTable& table, const Raters& raters) {
  std::map<std::string, std::size_t> number;
  Judgements judgements;
  for (const LabelRow& row : table.rows) {
    const auto rater = raters.find(row);
    if (!rater || !counts(row)) continue;
    const auto [fragment, is_new] = number.try_emplace(row.fragment, judgements.size());
    if (is_new) judgements.emplace_back();
    judgements[fragment->second][*rater].push_back(&row);
  }
  for (auto& by_rater : judgements) {
    for (auto& [rater, rows] : by_rater) {
      std::stable_sort(rows.begin(), rows.end(), [](const LabelRow* a, const LabelRow* b) {
        return std::pair(a->is_repeat(), a->repeat) < std::pair(b->is_repeat(), b->repeat);
      });
    }
  }
  return judgements;
}

std::vector<double> values_of(const std::vector<const LabelRow*>& rows, const FactorField& factor) {
  std::vector<double> values;
  for (const LabelRow* row : rows) {
    if (const auto& value = row->*factor.field) values.push_back(*value);
  }
  return values;
}

/// Everyone's first word on one factor, raters in their order.
Units first_values(const Judgements& judgements, const FactorField& factor) {
  Units units;
  for (const auto& by_rater : judgements) {
    std::vector<double> firsts;
    for (const auto& [rater, rows] : by_rater) {
      const std::vector<double> values = values_of(rows, factor);
      if (!values.empty()) firsts.push_back(values.front());
    }
    if (!firsts.empty()) units.push_back(std::move(firsts));
  }
  return units;
}

/// All that each rater says of one factor, by rater, then fragment.
std::vector<Units> own_values(const Judgements& judgements, std::size_t rater_count,
                              const FactorField& factor) {
  std::vector<Units> units(rater_count);
  for (const auto& by_rater : judgements) {
    for (const auto& [rater, rows] : by_rater) {
      std::vector<double> values = values_of(rows, factor);
      if (!values.empty()) units[rater].push_back(std::move(values));
    }
  }
  return units;
}

/// krippendorff_alpha of pairable units.
KrippendorffAlpha alpha_of(const Units& units, const BootstrapOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  KrippendorffAlpha result;
  result.units = static_cast<int>(units.size());
  for (const auto& values : units) result.values += static_cast<int>(values.size());
  if (units.empty()) return result;
  const std::vector<UnitSums> sums = sums_of(units);
  UnitSums all;
  for (const UnitSums& unit : sums) all.add(unit);
  result.alpha = all.alpha();
  if (!result.alpha) return result;
  base::Rng rng(options.seed);
  std::vector<double> resampled;
  for (int n = 0; n < options.resamples; ++n) {
    UnitSums drawn;
    for (std::size_t u = 0; u < sums.size(); ++u) {
      drawn.add(sums[static_cast<std::size_t>(rng.index(result.units))]);
    }
    if (const auto alpha = drawn.alpha()) resampled.push_back(*alpha);
  }
  result.resamples = static_cast<int>(resampled.size());
  if (!resampled.empty()) result.interval = percentile_interval(resampled, options.level);
  return result;
}

/// icc_two_way of units, those with fewer than `rater_count` values dropped.
IntraclassCorrelation icc_two_way_of(const Units& units, std::size_t rater_count, double level) {
  IntraclassCorrelation result;
  std::vector<double> whole;
  for (const auto& values : units) {
    if (values.size() == rater_count)
      whole.insert(whole.end(), values.begin(), values.end());
    else
      ++result.dropped;
  }
  result.units = static_cast<int>(units.size()) - result.dropped;
  if (result.units < 2 || rater_count < 2) return result;
  const MeanSquares m = two_way(
      Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
          whole.data(), result.units, static_cast<Eigen::Index>(rater_count)));
  const auto& [n, k, BMS, JMS, EMS] = m;
  const double total = BMS + (k - 1.0) * EMS + k * (JMS - EMS) / n;
  if (!(total > 0.0)) return result;
  result.value = (BMS - EMS) / total;
  // Where raters differ by a constant and units not at all, nothing tells how sure the 0 is.
  if (BMS > 0.0 || EMS > 0.0) result.interval = interval_of_two_way(m, *result.value, level);
  return result;
}

/// Between- and within-unit mean squares of units of any sizes.
struct OneWay {
  double k = 0.0;  ///< k_0 [Donner86]; of units of one size, that
  double BMS = 0.0;
  double WMS = 0.0;
};

OneWay one_way(const Units& units) {
  double N = 0.0, sum = 0.0, squared_counts = 0.0, within = 0.0, between = 0.0, squares = 0.0;
  for (const auto& values : units) {
    const auto k = static_cast<double>(values.size());
    N += k;
    sum += sum_of(values);
    squared_counts += k * k;
    within += sum_of_squares_about(values, sum_of(values) / k);
    squares += sum_of_squares_about(values, 0.0);
  }
  for (const auto& values : units) {
    const auto k = static_cast<double>(values.size());
    const double distance = sum_of(values) / k - sum / N;
    between += k * distance * distance;
  }
  const auto n = static_cast<double>(units.size());
  return {(N - squared_counts / N) / (n - 1.0), without_round_off(between, squares) / (n - 1.0),
          without_round_off(within, squares) / (N - n)};
}

/// icc_one_way of pairable units.
IntraclassCorrelation icc_one_way_of(const Units& units, double level) {
  IntraclassCorrelation result;
  result.units = static_cast<int>(units.size());
  if (units.size() < 2) return result;
  const auto [k, BMS, WMS] = one_way(units);
  if (BMS == 0.0 && WMS == 0.0) return result;
  result.value = (BMS - WMS) / (BMS + (k - 1.0) * WMS);
  const std::size_t size = units.front().size();
  if (std::all_of(units.begin(), units.end(), [&](const auto& u) { return u.size() == size; })) {
    result.interval = interval_of_one_way(static_cast<double>(units.size()),
                                          static_cast<double>(size), BMS, WMS, level);
  }
  return result;
}

/// Mean |a - b| over all pairs of m >= 2 values, in O(m log m).
double mean_pair_difference(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto m = static_cast<double>(values.size());
  double sum = 0.0;
  // Sorted, value i is added i times and subtracted m - 1 - i times.
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += (2.0 * static_cast<double>(i) - m + 1.0) * values[i];
  }
  return sum / (0.5 * m * (m - 1.0));
}

std::optional<double> mean_difference_of(const Units& units) {
  if (units.empty()) return std::nullopt;
  double sum = 0.0;
  for (const auto& values : units) sum += mean_pair_difference(values);
  return sum / static_cast<double>(units.size());
}

}  // namespace

std::vector<std::string> BootstrapOptions::problems() const {
  std::vector<std::string> problems;
  if (resamples < 1) {
    problems.push_back("BootstrapOptions::resamples = " + std::to_string(resamples) +
                       " (must be >= 1)");
  }
  if (!(level > 0.0 && level < 1.0)) {
    problems.push_back("BootstrapOptions::level = " + base::format_number(level) +
                       " (must be in (0, 1))");
  }
  return problems;
}

KrippendorffAlpha krippendorff_alpha(const Ratings& ratings, const BootstrapOptions& options) {
  return alpha_of(pairable(values_by_unit(ratings)), options);
}

IntraclassCorrelation icc_two_way(const Ratings& ratings, double level) {
  require_level(level);
  return icc_two_way_of(values_by_unit(ratings), static_cast<std::size_t>(ratings.cols()), level);
}

IntraclassCorrelation icc_one_way(const Ratings& ratings, double level) {
  require_level(level);
  const Units all = values_by_unit(ratings);
  IntraclassCorrelation result = icc_one_way_of(pairable(all), level);
  result.dropped = static_cast<int>(all.size()) - result.units;
  return result;
}

std::optional<double> mean_absolute_difference(const Ratings& ratings) {
  return mean_difference_of(pairable(values_by_unit(ratings)));
}

AgreementReport rater_agreement(const LabelTable& table, const AgreementOptions& options) {
  const Raters raters = chosen_raters(table, options.raters);
  const Judgements judgements = judgements_of(table, raters);
  const std::size_t rater_count = raters.names.size();
  const double level = options.bootstrap.level;
  AgreementReport report;
  report.raters = raters.names;
  report.fragments = static_cast<int>(judgements.size());
  for (const FactorField& factor : kNamedFactors) {
    const Units units = first_values(judgements, factor);
    if (rater_count < 2 || units.empty()) continue;
    report.factors.push_back({factor.name, alpha_of(pairable(units), options.bootstrap),
                              icc_two_way_of(units, rater_count, level)});
  }
  std::vector<std::vector<RepeatAgreement>> by_rater(rater_count);
  for (const FactorField& factor : kNamedFactors) {
    const std::vector<Units> own = own_values(judgements, rater_count, factor);
    for (std::size_t r = 0; r < rater_count; ++r) {
      const Units repeated = pairable(own[r]);
      if (repeated.empty()) continue;
      std::size_t values = 0;
      for (const auto& unit : repeated) values += unit.size();
      by_rater[r].push_back({raters.names[r], factor.name, static_cast<int>(repeated.size()),
                             static_cast<int>(values), *mean_difference_of(repeated),
                             icc_one_way_of(repeated, level)});
    }
  }
  for (const auto& one : by_rater) {
    report.repeats.insert(report.repeats.end(), one.begin(), one.end());
  }
  if (report.factors.empty() && report.repeats.empty()) {
    throw Error(ErrorKind::kData,
                "agreement needs two raters, or repeats of one; compared: " + listed(raters.names) +
                    ", of the table's " + listed(all_raters(table).names) +
                    " (observers that are not people are compared only if named)");
  }
  return report;
}

}  // namespace laban::effort
