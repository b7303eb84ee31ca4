#include "laban/transfer/target_curve.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "laban/base/csv.h"
#include "laban/base/error.h"

namespace laban::transfer {
namespace {

using base::Error;
using base::ErrorKind;

[[noreturn]] void refuse(std::string_view name, int line, const std::string& what) {
  throw Error(ErrorKind::kFormat, std::string(name) + ":" + std::to_string(line) + ": " + what);
}

/// What each column holds: a factor, or the time.
struct Column {
  std::optional<effort::Factor> factor;  ///< nullopt: seconds
  std::string name;
};

std::vector<Column> read_head(const base::CsvRow& head, std::string_view name) {
  std::vector<Column> columns;
  for (const std::string& field : head.fields) {
    const auto factor = effort::factor_named(field);
    if (!factor && field != "seconds") {
      refuse(name, head.line,
             "column '" + field + "' (must be one of seconds, flow, weight, time, space)");
    }
    if (std::any_of(columns.begin(), columns.end(),
                    [&](const Column& column) { return column.name == field; })) {
      refuse(name, head.line, "column '" + field + "' stands there twice");
    }
    columns.push_back({factor, field});
  }
  if (std::all_of(columns.begin(), columns.end(),
                  [](const Column& column) { return column.factor.has_value(); })) {
    refuse(name, head.line, "the head has no column seconds; it is seconds,flow,weight,time");
  }
  return columns;
}

std::optional<double> read_number(const std::string& text) {
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* end = text.data() + text.size();
  double value = 0.0;
  const auto [stop, failed] = std::from_chars(begin, end, value);
  if (failed != std::errc() || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

TargetCurve::Row read_row(const base::CsvRow& row, const std::vector<Column>& columns,
                          std::string_view name, double limit) {
  if (row.fields.size() != columns.size()) {
    refuse(name, row.line,
           std::to_string(row.fields.size()) + " cells (the head has " +
               std::to_string(columns.size()) + ")");
  }
  TargetCurve::Row read;
  for (std::size_t n = 0; n < columns.size(); ++n) {
    const auto& [factor, column] = columns[n];
    const std::string& cell = row.fields[n];
    if (factor && cell.empty()) continue;
    const std::optional<double> value = read_number(cell);
    if (!value) refuse(name, row.line, column + " = '" + cell + "' is no number");
    if (!factor && *value < 0.0) {
      refuse(name, row.line, "seconds = " + cell + " (must be >= 0)");
    }
    if (factor && std::abs(*value) > limit) {
      const std::string most = base::format_number(limit);
      refuse(name, row.line, column + " = " + cell + " (must be in [-" + most + ", " + most + "])");
    }
    if (factor) {
      read.factors[static_cast<std::size_t>(effort::index_of(*factor))] = value;
    } else {
      read.seconds = *value;
    }
  }
  return read;
}

}  // namespace

std::optional<double> TargetCurve::at(effort::Factor factor, double seconds) const {
  const auto f = static_cast<std::size_t>(effort::index_of(factor));
  const auto after = std::partition_point(rows.begin(), rows.end(),
                                          [&](const Row& row) { return row.seconds < seconds; });
  if (after == rows.end()) return rows.back().factors[f];
  if (after == rows.begin() || after->seconds == seconds) return after->factors[f];
  const Row& before = *(after - 1);
  if (!before.factors[f] || !after->factors[f]) return std::nullopt;
  const double share = (seconds - before.seconds) / (after->seconds - before.seconds);
  return (1.0 - share) * *before.factors[f] + share * *after->factors[f];
}

std::array<std::optional<double>, effort::kMaxFactorCount> TargetCurve::mean_over(
    double begin_s, int frames, double frame_rate_hz) const {
  std::array<std::optional<double>, effort::kMaxFactorCount> mean;
  for (const effort::Factor factor : effort::kFactorsWithSpace) {
    double sum = 0.0;
    int count = 0;
    for (int f = 0; f < frames; ++f) {
      const std::optional<double> value = at(factor, begin_s + f / frame_rate_hz);
      if (!value) continue;
      sum += *value;
      ++count;
    }
    if (count > 0 && 2 * count >= frames)
      mean[static_cast<std::size_t>(effort::index_of(factor))] = sum / count;
  }
  return mean;
}

TargetCurve parse_target_curve(std::string_view text, std::string_view name, double limit) {
  const std::vector<base::CsvRow> table = base::parse_csv(text, name);
  if (table.empty()) refuse(name, 1, "it is empty; a curve begins with seconds,flow,weight,time");
  const std::vector<Column> columns = read_head(table.front(), name);
  TargetCurve curve;
  bool asks = false;
  for (std::size_t n = 1; n < table.size(); ++n) {
    const TargetCurve::Row row = read_row(table[n], columns, name, limit);
    if (!curve.rows.empty() && !(row.seconds > curve.rows.back().seconds)) {
      refuse(name, table[n].line,
             "seconds = " + base::format_number(row.seconds) + " does not come after " +
                 base::format_number(curve.rows.back().seconds));
    }
    asks = asks || std::any_of(row.factors.begin(), row.factors.end(),
                               [](const auto& value) { return value.has_value(); });
    curve.rows.push_back(row);
  }
  if (!asks) refuse(name, table.back().line, "nothing is asked of any factor");
  return curve;
}

}  // namespace laban::transfer
