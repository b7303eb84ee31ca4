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
  /// How sure the observer is, in [0, 1]; blank counts as 1. A row of confidence 0 ("not sure at
  /// all") does not count: as far as anything is learnt or computed, its factors are blank.
  std::optional<double> confidence;
  /// Which of several judgements of this fragment by this observer: 0, 1, ..
  int repeat = 0;
  /// A blend's parents, names of seeds of this table, and its weight of parent_j in [-0.25, 1.25].
  std::string parent_i;
  std::string parent_j;
  std::optional<double> alpha;
  std::string comment;
  int line = 0;  ///< where the row stood in the text it was read from; 0 if it was not read

  [[nodiscard]] bool is_blend() const {
    return alpha.has_value() || !parent_i.empty() || !parent_j.empty();
  }
  /// True if it is not the first judgement of its fragment by its observer. Tables from before
  /// there was a column for that say so in the comment.
  [[nodiscard]] bool is_repeat() const { return repeat > 0 || comment.starts_with("repeat"); }
  /// True if flow, weight and time are all given.
  [[nodiscard]] bool is_rated() const { return flow && weight && time; }
};

/// A table of labels: tidy, one row an observation (DESIGN 3).
///
/// Rules that parse_label_table holds a table to: seeds have a clip and no parents; blends have two
/// different parents among the seeds and an alpha; rows of one fragment (several observers) agree
/// in everything but factors, observer, source, confidence, repeat and comment, and differ in
/// observer, source or repeat (older tables: or have a comment that begins with "repeat"); factors
/// lie in [-3, 3], confidence in [0, 1], alpha in [-0.25, 1.25], repeat >= 0, begin < end.
struct LabelTable {
  std::vector<LabelRow> rows;
};

/// Reads a table, checking every row, and reports everything wrong with it at once.
///
/// Columns may come in any order; `fragment, clip, content, performer, flow, weight, time, source`
/// must be there, the others may be absent (blank). Unknown columns are refused: a misspelled
/// header would silently lose its values. Numbers may carry a plus sign and spaces around them. A
/// row without any factor may leave its source blank (read as expert: a rater is to fill it in).
/// @param name  of the file, for messages.
/// @throws Error{kFormat} with one line a problem in the order of the text, e.g.
///         "labels.csv:17: flow = 3.4 (must be in [-3, 3])"; after 100 the rest is counted.
[[nodiscard]] LabelTable parse_label_table(std::string_view text, std::string_view name);

/// The table as CSV with all columns of DESIGN 3, in that order, and a last one, repeat, if a row
/// has one. What parse_label_table makes of it is the same table, every number to the last bit.
[[nodiscard]] std::string format_label_table(const LabelTable& table);

/// What breaks the rules in a table that was put together in memory, as parse_label_table would
/// say it; rows that were not read are named by their number from 1. Empty when the table is sound.
[[nodiscard]] std::vector<std::string> problems(const LabelTable& table, std::string_view name);

/// Names of the observers whose rows give a factor, in order of first appearance; one without a
/// name is "".
[[nodiscard]] std::vector<std::string> observers(const LabelTable& table);

/// What one observer says: that observer's rows. A fragment that the observer has no row of keeps
/// its first one with all factors blank, so that blends still have their parents.
/// @throws Error{kUsage} naming the observers there are, if this one gives no factor anywhere.
[[nodiscard]] LabelTable only_observer(const LabelTable& table, const std::string& observer);

/// One row a fragment, observer and source, in order of first appearance: repeated judgements
/// become their mean, factor by factor, weighted by confidence. Rows of confidence 0 do not count:
/// where there are no others, factors are blank and the confidence is 0. Confidence is the mean of
/// those that count (blank if all of them are), all else is the first row's.
[[nodiscard]] LabelTable mean_over_repeats(const LabelTable& table);

/// One row a fragment, in order of first appearance: each factor is the mean over the observers who
/// give it (of each the mean over repeats), weighted by confidence, blank where none does.
/// Confidence is as in mean_over_repeats, observers are joined by "+", all else is the first row's.
[[nodiscard]] LabelTable mean_over_observers(const LabelTable& table);

/// How much each row of mean_over_observers(table) is worth as a sample: the sum of its observers'
/// confidences, those who leave factors blank counted by the share of flow, weight and time they
/// give. A squared loss weighted so is, up to a constant, the loss of every single observation
/// weighted by its confidence.
[[nodiscard]] std::vector<double> mean_weights(const LabelTable& table);

/// Fragments and blends to which no observer has given all of flow, weight and time, one line each:
/// "fragment 'walk_03' (line 12): flow, time blank"; "(confidence 0)" after it tells that factors
/// are there, but nobody is sure of them. Training needs this to be empty.
[[nodiscard]] std::vector<std::string> blank_rows(const LabelTable& table);

/// Rows that are fragments of captures, in order.
[[nodiscard]] std::vector<LabelRow> seeds(const LabelTable& table);

/// Rows that are blends of two seeds, in order.
[[nodiscard]] std::vector<LabelRow> blends(const LabelTable& table);

}  // namespace laban::effort
