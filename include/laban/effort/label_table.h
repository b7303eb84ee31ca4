#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace laban::effort {

/// Where a label comes from (DESIGN 3).
enum class LabelSource {
  kExpert,     ///< a trained observer
  kPerformer,  ///< the performer's own statement or instruction
  kMeasured,   ///< the kinematic observer (effort/observer.h)
  kSynthetic,  ///< set by the program that made the motion
};

/// "expert", "performer", "measured" or "synthetic".
[[nodiscard]] std::string_view to_string(LabelSource source);

/// One observation: what one observer says of one fragment or blend.
struct LabelRow {
  std::string fragment;  ///< unique name of the fragment or blend; never empty
  std::string clip;      ///< path relative to the table; may be empty for blends
  /// Frames [begin, end) at the clip's own rate; both or none. None: the whole clip.
  std::optional<int> begin_frame;
  std::optional<int> end_frame;
  std::string content;  ///< content group, e.g. "walk"; may be empty
  std::string performer;
  /// Effort factors in [-3, 3], + the condensing pole; blank where nobody has said yet.
  std::optional<double> flow;
  std::optional<double> weight;
  std::optional<double> time;
  std::optional<double> space;
  std::string observer;  ///< who says so
  LabelSource source = LabelSource::kExpert;
  std::optional<double> confidence;  ///< in [0, 1]; blank counts as 1
  /// A blend's parents, names of seeds of this table, and its weight of parent_j in [-0.25, 1.25].
  std::string parent_i;
  std::string parent_j;
  std::optional<double> alpha;
  std::string comment;
  int line = 0;  ///< where the row stood in the text it was read from; 0 if it was not read

  [[nodiscard]] bool is_blend() const { return alpha.has_value(); }
  /// True if flow, weight and time are all given.
  [[nodiscard]] bool is_rated() const { return flow && weight && time; }
};

/// A table of labels: tidy, one row an observation (DESIGN 3).
///
/// Rules that parse_label_table holds a table to: seeds have a clip and no parents; blends have two
/// different parents among the seeds and an alpha; rows of one fragment (several observers) agree
/// in everything but factors, observer, source, confidence and comment, and differ in observer or
/// source; factors lie in [-3, 3], confidence in [0, 1], alpha in [-0.25, 1.25], begin < end.
struct LabelTable {
  std::vector<LabelRow> rows;
};

/// Reads a table, checking every row, and reports everything wrong with it at once.
///
/// Columns may come in any order; `fragment, clip, content, performer, flow, weight, time` must be
/// there, the others may be absent (blank). Unknown columns are refused: a misspelled header would
/// silently lose its values.
/// @param name  of the file, for messages.
/// @throws Error{kFormat} with one line a problem, e.g.
///         "labels.csv:17: flow = 3.4 (must be in [-3, 3])"; after 100 the rest is counted.
[[nodiscard]] LabelTable parse_label_table(std::string_view text, std::string_view name);

/// The table as CSV with all columns of DESIGN 3; parse_label_table(format_label_table(t)) == t up
/// to line numbers, numbers exactly.
[[nodiscard]] std::string format_label_table(const LabelTable& table);

/// What is wrong with a table that was put together in memory, like parse_label_table's lines.
[[nodiscard]] std::vector<std::string> problems(const LabelTable& table, std::string_view name);

/// Rows with all three factors are used by training; these are not: "fragment 'walk_03', line 12:
/// flow, time are blank", one a row.
[[nodiscard]] std::vector<std::string> blank_rows(const LabelTable& table);

/// One row a fragment, in order of first appearance: factors are the confidence-weighted mean over
/// the observers who gave them (blank where none did, and `space` too), confidence their mean;
/// observer names are joined by "+", the source is the first row's. Rows of confidence 0 count only
/// where no other says anything.
[[nodiscard]] LabelTable mean_over_observers(const LabelTable& table);

/// Rows that are fragments of captures, in order.
[[nodiscard]] std::vector<LabelRow> seeds(const LabelTable& table);

/// Rows that are blends of two seeds, in order.
[[nodiscard]] std::vector<LabelRow> blends(const LabelTable& table);

}  // namespace laban::effort
