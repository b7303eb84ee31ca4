#include "laban/effort/label_table.h"

#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <system_error>
#include <tuple>

#include "laban/base/csv.h"
#include "laban/base/error.h"
#include "laban/effort/effort.h"

namespace laban::effort {
namespace {

using base::Error;
using base::ErrorKind;

constexpr std::array<std::string_view, 18> kColumns = {
    "fragment",   "clip",     "begin_frame", "end_frame", "content",  "performer",
    "flow",       "weight",   "time",        "space",     "observer", "source",
    "confidence", "parent_i", "parent_j",    "alpha",     "comment",  "repeat"};
constexpr std::array<std::string_view, 8> kRequiredColumns = {
    "fragment", "clip", "content", "performer", "flow", "weight", "time", "source"};
constexpr std::array<LabelSource, 4> kSources = {LabelSource::kExpert, LabelSource::kPerformer,
                                                 LabelSource::kMeasured, LabelSource::kSynthetic};
constexpr std::string_view kSourceRule = "must be expert, performer, measured or synthetic";
constexpr double kAlphaMin = -0.25;  // [Torresani06]: blends extrapolate by a quarter
constexpr double kAlphaMax = 1.25;
constexpr std::size_t kMaxProblems = 100;

/// Problems with the row they belong to, so that they can be told in the order of the text.
class Problems {
 public:
  explicit Problems(std::string_view name) : name_(name) {}

  void add(const LabelRow& row, std::size_t index, const std::string& problem) {
    const std::string place =
        row.line > 0 ? ":" + std::to_string(row.line) : ": row " + std::to_string(index + 1);
    by_row_[index].push_back(name_ + place + ": " + problem);
  }

  [[nodiscard]] bool has_row(std::size_t index) const { return by_row_.contains(index); }

  [[nodiscard]] std::vector<std::string> in_order() const {
    std::vector<std::string> all;
    for (const auto& entry : by_row_)
      all.insert(all.end(), entry.second.begin(), entry.second.end());
    return all;
  }

 private:
  std::string name_;
  std::map<std::size_t, std::vector<std::string>> by_row_;
};

/// A value as a message shows it: on one line and not without end.
std::string shown(std::string_view value) {
  constexpr std::size_t kLongest = 60;
  std::string text(value.substr(0, kLongest));
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  }
  return value.size() > kLongest ? text + "..." : text;
}

std::string quoted(std::string_view value) {
  return "'" + shown(value) + "'";
}

/// Adds an item to a list in text.
void append_item(std::string& list, std::string_view separator, std::string_view item) {
  if (!list.empty()) list.append(separator);
  list.append(item);
}

[[noreturn]] void refuse(const std::vector<std::string>& problems) {
  std::string text;
  for (std::size_t n = 0; n < std::min(problems.size(), kMaxProblems); ++n) {
    append_item(text, "\n", problems[n]);
  }
  if (problems.size() > kMaxProblems) {
    text += "\n.. and " + std::to_string(problems.size() - kMaxProblems) + " more";
  }
  throw Error(ErrorKind::kFormat, text);
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

/// The whole of `text` as a number; nullopt if it is none.
template <typename Number>
std::optional<Number> number_in(std::string_view text) {
  // from_chars knows no plus sign, but raters write one.
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  Number value{};
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Takes the cells of one record by column name and notes what cannot be read.
class RowReader {
 public:
  RowReader(const base::CsvRow& record, const std::map<std::string, std::size_t>& columns,
            std::size_t index, Problems& problems)
      : record_(record), columns_(columns), index_(index), problems_(problems) {
    row_.line = record.line;
  }

  [[nodiscard]] LabelRow read() {
    row_.fragment = text("fragment");
    row_.clip = text("clip");
    row_.begin_frame = integer("begin_frame");
    row_.end_frame = integer("end_frame");
    row_.content = text("content");
    row_.performer = text("performer");
    row_.flow = real("flow");
    row_.weight = real("weight");
    row_.time = real("time");
    row_.space = real("space");
    row_.observer = text("observer");
    row_.confidence = real("confidence");
    row_.parent_i = text("parent_i");
    row_.parent_j = text("parent_j");
    row_.alpha = real("alpha");
    row_.comment = text("comment");
    row_.repeat = integer("repeat").value_or(0);
    row_.source = source();
    return std::move(row_);
  }

 private:
  void problem(const std::string& what) { problems_.add(row_, index_, what); }

  [[nodiscard]] std::string text(const char* column) const {
    const auto at = columns_.find(column);
    return at == columns_.end() ? std::string() : record_.fields[at->second];
  }

  std::optional<double> real(const char* column) {
    const std::string cell = text(column);
    const std::string_view value = trimmed(cell);
    if (value.empty()) return std::nullopt;
    const auto number = number_in<double>(value);
    if (number && std::isfinite(*number)) return number;
    problem(std::string(column) + " = " + quoted(value) +
            (value.find(',') == std::string_view::npos
                 ? " (must be a number)"
                 : " (must be a number with a decimal point, not a comma)"));
    return std::nullopt;
  }

  std::optional<int> integer(const char* column) {
    const std::string cell = text(column);
    const std::string_view value = trimmed(cell);
    if (value.empty()) return std::nullopt;
    const auto number = number_in<int>(value);
    if (!number) problem(std::string(column) + " = " + quoted(value) + " (must be a whole number)");
    return number;
  }

  LabelSource source() {
    const std::string cell = text("source");
    const std::string_view value = trimmed(cell);
    for (const LabelSource candidate : kSources) {
      if (to_string(candidate) == value) return candidate;
    }
    const bool rated = row_.flow || row_.weight || row_.time || row_.space;
    if (!value.empty() || rated) {
      problem((value.empty() ? "source is blank" : "source = " + quoted(value)) + " (" +
              std::string(kSourceRule) + ")");
    }
    return LabelSource::kExpert;
  }

  const base::CsvRow& record_;
  const std::map<std::string, std::size_t>& columns_;
  std::size_t index_;
  Problems& problems_;
  LabelRow row_;
};

std::string all_columns() {
  std::string text;
  for (const std::string_view column : kColumns) append_item(text, ",", column);
  return text;
}

/// Where each column stands. @throws Error{kFormat} for a header that cannot be worked with.
std::map<std::string, std::size_t> columns_of(const base::CsvRow& header, std::string_view name) {
  std::map<std::string, std::size_t> columns;
  std::vector<std::string> found;
  const std::string place = std::string(name) + ":" + std::to_string(header.line) + ": ";
  for (std::size_t n = 0; n < header.fields.size(); ++n) {
    const std::string column(trimmed(header.fields[n]));
    if (std::find(kColumns.begin(), kColumns.end(), column) == kColumns.end()) {
      found.push_back(place + "unknown column " + quoted(column) + " (columns are " +
                      all_columns() + ")");
    } else if (!columns.emplace(column, n).second) {
      found.push_back(place + "column " + quoted(column) + " stands twice");
    }
  }
  for (const std::string_view column : kRequiredColumns) {
    if (!columns.contains(std::string(column))) {
      found.push_back(place + "column " + quoted(column) + " is missing");
    }
  }
  if (!found.empty()) refuse(found);
  return columns;
}

/// Numbers out of range, each by itself.
void check_ranges(const LabelRow& row, std::size_t index, Problems& problems) {
  const auto in_range = [&](const char* what, const std::optional<double>& value, double low,
                            double high) {
    if (!value || (*value >= low && *value <= high)) return;
    problems.add(row, index,
                 std::string(what) + " = " + base::format_number(*value) + " (must be in [" +
                     base::format_number(low) + ", " + base::format_number(high) + "])");
  };
  in_range("flow", row.flow, kEffortMin, kEffortMax);
  in_range("weight", row.weight, kEffortMin, kEffortMax);
  in_range("time", row.time, kEffortMin, kEffortMax);
  in_range("space", row.space, kEffortMin, kEffortMax);
  in_range("confidence", row.confidence, 0.0, 1.0);
  in_range("alpha", row.alpha, kAlphaMin, kAlphaMax);
  if (row.repeat < 0) {
    problems.add(row, index, "repeat = " + std::to_string(row.repeat) + " (must be >= 0)");
  }
}

/// Fields of a row that do not make a seed or a blend together.
void check_structure(const LabelRow& row, std::size_t index, Problems& problems) {
  const auto problem = [&](const std::string& what) { problems.add(row, index, what); };
  if (row.fragment.empty()) problem("fragment is blank (every row needs a name)");
  if (row.begin_frame.has_value() != row.end_frame.has_value()) {
    problem("only one of begin_frame and end_frame is given (must be both or neither)");
  } else if (row.begin_frame && (*row.begin_frame < 0 || *row.begin_frame >= *row.end_frame)) {
    problem("frames [" + std::to_string(*row.begin_frame) + ", " + std::to_string(*row.end_frame) +
            ") (must be 0 <= begin_frame < end_frame)");
  }
  if (!row.is_blend()) {
    if (row.clip.empty()) problem("clip is blank (only a blend, with parents and alpha, has none)");
  } else if (!row.alpha || row.parent_i.empty() || row.parent_j.empty()) {
    problem("a blend needs parent_i, parent_j and alpha (a seed has none of them)");
  } else if (row.parent_i == row.parent_j) {
    problem("both parents are " + quoted(row.parent_i) + " (must be two fragments)");
  }
}

std::string row_name(const LabelRow& row, std::size_t index) {
  return row.line > 0 ? "line " + std::to_string(row.line) : "row " + std::to_string(index + 1);
}

/// The column in which two rows of one fragment describe different things, if any.
std::optional<std::string_view> disagreement(const LabelRow& a, const LabelRow& b) {
  if (a.clip != b.clip) return "clip";
  if (a.begin_frame != b.begin_frame) return "begin_frame";
  if (a.end_frame != b.end_frame) return "end_frame";
  if (a.content != b.content) return "content";
  if (a.performer != b.performer) return "performer";
  if (a.parent_i != b.parent_i) return "parent_i";
  if (a.parent_j != b.parent_j) return "parent_j";
  if (a.alpha != b.alpha) return "alpha";
  return std::nullopt;
}

using FirstRows = std::map<std::string, std::size_t>;

/// Rows of one fragment: one meaning, and one word an observer. Only rows in `sound` are compared:
/// what else is wrong with another may follow from what is known.
void check_repeated_fragments(const LabelTable& table, const FirstRows& first_of,
                              const std::vector<bool>& sound, Problems& problems) {
  std::map<std::array<std::string, 4>, std::size_t> judged;
  for (std::size_t n = 0; n < table.rows.size(); ++n) {
    const LabelRow& row = table.rows[n];
    const std::size_t first = first_of.at(row.fragment);
    if (!sound[n] || !sound[first]) continue;
    if (const auto differs = disagreement(row, table.rows[first])) {
      problems.add(row, n,
                   "fragment " + quoted(row.fragment) + " has another " + std::string(*differs) +
                       " than in " + row_name(table.rows[first], first) +
                       " (a name stands for one fragment)");
      continue;
    }
    if (row.repeat == 0 && row.is_repeat()) continue;  // by its comment: they have no numbers
    const auto [at, is_new] =
        judged.emplace(std::array{row.fragment, row.observer, std::string(to_string(row.source)),
                                  std::to_string(row.repeat)},
                       n);
    if (is_new) continue;
    problems.add(row, n,
                 "fragment " + quoted(row.fragment) + " stands already in " +
                     row_name(table.rows[at->second], at->second) +
                     (row.observer.empty() ? std::string(" without an observer")
                                           : " by observer " + quoted(row.observer)) +
                     " (several rows of one need different observers, or repeat 1, 2, ..)");
  }
}

void check_parents(const LabelTable& table, const FirstRows& first_of, Problems& problems) {
  for (std::size_t n = 0; n < table.rows.size(); ++n) {
    const auto check = [&](const char* column, const std::string& parent) {
      if (parent.empty()) return;
      const auto at = first_of.find(parent);
      const char* rule = at == first_of.end()                ? "must be a fragment of this table"
                         : table.rows[at->second].is_blend() ? "must be a seed, not a blend"
                                                             : nullptr;
      if (rule == nullptr) return;
      problems.add(table.rows[n], n,
                   std::string(column) + " = " + quoted(parent) + " (" + rule + ")");
    };
    check("parent_i", table.rows[n].parent_i);
    check("parent_j", table.rows[n].parent_j);
  }
}

void check_table(const LabelTable& table, Problems& problems) {
  FirstRows first_of;
  for (std::size_t n = 0; n < table.rows.size(); ++n) {
    const LabelRow& row = table.rows[n];
    first_of.emplace(row.fragment, n);
    const bool readable = !problems.has_row(n);
    check_ranges(row, n, problems);
    if (readable) check_structure(row, n, problems);
  }
  std::vector<bool> sound(table.rows.size());
  for (std::size_t n = 0; n < sound.size(); ++n) sound[n] = !problems.has_row(n);
  check_repeated_fragments(table, first_of, sound, problems);
  check_parents(table, first_of, problems);
}

std::string cell(const std::optional<double>& value) {
  return value ? base::format_number(*value) : std::string();
}

std::string cell(const std::optional<int>& value) {
  return value ? std::to_string(*value) : std::string();
}

/// Row numbers of each key, keys in order of first appearance.
template <typename KeyOf>
std::vector<std::vector<std::size_t>> grouped_rows(const LabelTable& table, const KeyOf& key_of) {
  std::map<decltype(key_of(table.rows.front())), std::size_t> place;
  std::vector<std::vector<std::size_t>> groups;
  for (std::size_t n = 0; n < table.rows.size(); ++n) {
    const auto [at, is_new] = place.emplace(key_of(table.rows[n]), groups.size());
    if (is_new) groups.emplace_back();
    groups[at->second].push_back(n);
  }
  return groups;
}

std::vector<std::vector<std::size_t>> rows_by_fragment(const LabelTable& table) {
  return grouped_rows(table, [](const LabelRow& row) { return row.fragment; });
}

std::vector<std::vector<std::size_t>> rows_by_judge(const LabelTable& table) {
  return grouped_rows(table, [](const LabelRow& row) {
    return std::tuple(row.fragment, row.observer, row.source);
  });
}

using OptionalField = std::optional<double> LabelRow::*;
constexpr std::array<OptionalField, 4> kFactorFields = {&LabelRow::flow, &LabelRow::weight,
                                                        &LabelRow::time, &LabelRow::space};

bool has_factor(const LabelRow& row) {
  return row.flow || row.weight || row.time || row.space;
}

double confidence_of(const LabelRow& row) {
  return row.confidence.value_or(1.0);
}

/// Mean of a factor over rows that count, weighted by confidence; nullopt if none gives it.
std::optional<double> weighted_mean(const LabelTable& table, const std::vector<std::size_t>& rows,
                                    OptionalField field) {
  double weights = 0.0, weighted = 0.0;
  std::optional<double> only;
  int count = 0;
  for (const std::size_t n : rows) {
    const std::optional<double>& value = table.rows[n].*field;
    const double confidence = confidence_of(table.rows[n]);
    if (!value || confidence == 0.0) continue;
    weights += confidence;
    weighted += confidence * *value;
    only = value;
    ++count;
  }
  // A single value stays what it is, to the last bit.
  return count > 1 ? std::optional(weighted / weights) : only;
}

/// Mean confidence of the rows that say something and count; blank if they all are. Where none
/// counts 0, if a row's own confidence is the reason.
std::optional<double> mean_confidence(const LabelTable& table,
                                      const std::vector<std::size_t>& rows) {
  double sum = 0.0;
  int count = 0;
  bool any_given = false, any_zero = false;
  for (const std::size_t n : rows) {
    const LabelRow& row = table.rows[n];
    const double confidence = confidence_of(row);
    any_zero = any_zero || confidence == 0.0;
    if (!has_factor(row) || confidence == 0.0) continue;
    any_given = any_given || row.confidence;
    sum += confidence;
    ++count;
  }
  if (count == 0) return any_zero ? std::optional(0.0) : std::nullopt;
  return any_given ? std::optional(sum / count) : std::nullopt;
}

LabelRow merged(const LabelTable& table, const std::vector<std::size_t>& rows) {
  LabelRow result = table.rows[rows.front()];
  for (const OptionalField field : kFactorFields) {
    result.*field = weighted_mean(table, rows, field);
  }
  result.confidence = mean_confidence(table, rows);
  std::vector<std::string> names;
  for (const std::size_t n : rows) {
    const std::string& name = table.rows[n].observer;
    const bool known = std::find(names.begin(), names.end(), name) != names.end();
    if (!name.empty() && !known) names.push_back(name);
  }
  result.observer.clear();
  for (const std::string& name : names) append_item(result.observer, "+", name);
  result.repeat = 0;
  return result;
}

LabelTable merged(const LabelTable& table, const std::vector<std::vector<std::size_t>>& groups) {
  LabelTable result;
  result.rows.reserve(groups.size());
  for (const auto& rows : groups) result.rows.push_back(merged(table, rows));
  return result;
}

/// Share of flow, weight and time that a row gives.
double share_given(const LabelRow& row) {
  return (int{row.flow.has_value()} + int{row.weight.has_value()} + int{row.time.has_value()}) /
         3.0;
}

}  // namespace

std::string_view to_string(LabelSource source) {
  switch (source) {
    case LabelSource::kExpert:
      return "expert";
    case LabelSource::kPerformer:
      return "performer";
    case LabelSource::kMeasured:
      return "measured";
    case LabelSource::kSynthetic:
      return "synthetic";
  }
  LABAN_CHECK(false);
  return {};
}

LabelTable parse_label_table(std::string_view text, std::string_view name) {
  const std::vector<base::CsvRow> records = base::parse_csv(text, name);
  if (records.empty()) {
    throw Error(ErrorKind::kFormat,
                std::string(name) + ": no header line (must be " + all_columns() + ")");
  }
  const auto columns = columns_of(records.front(), name);
  const std::size_t width = records.front().fields.size();
  Problems problems(name);
  LabelTable table;
  table.rows.reserve(records.size() - 1);
  for (std::size_t n = 1; n < records.size(); ++n) {
    const base::CsvRow& record = records[n];
    if (record.fields.size() == width) {
      table.rows.push_back(RowReader(record, columns, n - 1, problems).read());
      continue;
    }
    // The row keeps its place, and its name in case others have it for a parent.
    LabelRow row;
    row.line = record.line;
    const std::size_t name_at = columns.at("fragment");
    if (name_at < record.fields.size()) row.fragment = record.fields[name_at];
    problems.add(row, n - 1,
                 "expected " + std::to_string(width) + " fields, found " +
                     std::to_string(record.fields.size()));
    table.rows.push_back(std::move(row));
  }
  check_table(table, problems);
  const std::vector<std::string> found = problems.in_order();
  if (!found.empty()) refuse(found);
  return table;
}

std::vector<std::string> problems(const LabelTable& table, std::string_view name) {
  Problems found(name);
  check_table(table, found);
  return found.in_order();
}

std::string format_label_table(const LabelTable& table) {
  // Most tables have no repeats, and stay as they were before there was a column for them.
  const bool repeats = std::any_of(table.rows.begin(), table.rows.end(),
                                   [](const LabelRow& row) { return row.repeat != 0; });
  const auto line = [repeats](std::vector<std::string> fields) {
    if (!repeats) fields.pop_back();
    return base::format_csv_row(fields);
  };
  std::string text = line({kColumns.begin(), kColumns.end()});
  for (const LabelRow& row : table.rows) {
    text += line({row.fragment, row.clip, cell(row.begin_frame), cell(row.end_frame), row.content,
                  row.performer, cell(row.flow), cell(row.weight), cell(row.time), cell(row.space),
                  row.observer, std::string(to_string(row.source)), cell(row.confidence),
                  row.parent_i, row.parent_j, cell(row.alpha), row.comment,
                  row.repeat == 0 ? std::string() : std::to_string(row.repeat)});
  }
  return text;
}

std::vector<std::string> observers(const LabelTable& table) {
  std::vector<std::string> names;
  std::set<std::string> known;
  for (const LabelRow& row : table.rows) {
    if (has_factor(row) && known.insert(row.observer).second) names.push_back(row.observer);
  }
  return names;
}

LabelTable only_observer(const LabelTable& table, const std::string& observer) {
  const std::vector<std::string> names = observers(table);
  if (std::find(names.begin(), names.end(), observer) == names.end()) {
    std::string there;
    for (const std::string& name : names) append_item(there, ", ", quoted(name));
    throw Error(ErrorKind::kUsage, "no row has labels by observer " + quoted(observer) +
                                       " (observers are " + (there.empty() ? "none" : there) + ")");
  }
  LabelTable result;
  for (const auto& rows : rows_by_fragment(table)) {
    const std::size_t before = result.rows.size();
    for (const std::size_t n : rows) {
      if (table.rows[n].observer == observer) result.rows.push_back(table.rows[n]);
    }
    if (result.rows.size() > before) continue;
    LabelRow blank = table.rows[rows.front()];
    for (const OptionalField field : kFactorFields) blank.*field = std::nullopt;
    blank.observer = observer;
    blank.confidence = std::nullopt;
    blank.repeat = 0;
    result.rows.push_back(std::move(blank));
  }
  return result;
}

LabelTable mean_over_repeats(const LabelTable& table) {
  return merged(table, rows_by_judge(table));
}

LabelTable mean_over_observers(const LabelTable& table) {
  const LabelTable judgements = mean_over_repeats(table);
  return merged(judgements, rows_by_fragment(judgements));
}

std::vector<double> mean_weights(const LabelTable& table) {
  const LabelTable judgements = mean_over_repeats(table);
  std::vector<double> weights;
  for (const auto& rows : rows_by_fragment(judgements)) {
    double sum = 0.0;
    for (const std::size_t n : rows) {
      sum += confidence_of(judgements.rows[n]) * share_given(judgements.rows[n]);
    }
    weights.push_back(sum);
  }
  return weights;
}

std::vector<std::string> blank_rows(const LabelTable& table) {
  std::vector<std::string> lines;
  for (const LabelRow& row : mean_over_observers(table).rows) {
    if (row.is_rated()) continue;
    std::string blanks;
    const auto note = [&blanks](const std::optional<double>& value, const char* factor) {
      if (!value) append_item(blanks, ", ", factor);
    };
    note(row.flow, "flow");
    note(row.weight, "weight");
    note(row.time, "time");
    const std::string place = row.line > 0 ? " (line " + std::to_string(row.line) + ")" : "";
    lines.push_back("fragment " + quoted(row.fragment) + place + ": " + blanks + " blank" +
                    (row.confidence == 0.0 ? " (confidence 0)" : ""));
  }
  return lines;
}

std::vector<LabelRow> seeds(const LabelTable& table) {
  std::vector<LabelRow> rows;
  for (const LabelRow& row : table.rows) {
    if (!row.is_blend()) rows.push_back(row);
  }
  return rows;
}

std::vector<LabelRow> blends(const LabelTable& table) {
  std::vector<LabelRow> rows;
  for (const LabelRow& row : table.rows) {
    if (row.is_blend()) rows.push_back(row);
  }
  return rows;
}

}  // namespace laban::effort
