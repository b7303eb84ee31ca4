#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "laban/effort/label_table.h"
#include "laban/transfer/style_corpus.h"

#include "files.h"
#include "http.h"
#include "motion_message.h"

namespace laban::studio {

struct LabellingOptions {
  std::string table;     ///< label table to fill in; empty: no labelling
  std::string observer;  ///< who rates; not empty
  std::uint64_t seed = 1;
  /// Share of the fragments that are shown a second time, unannounced, in [0, 1].
  double repeats = 0.1;
  /// Blends come after all fragments, in the order in which `laban suggest` would have them rated.
  bool suggested = false;
  bool space = false;  ///< whether Space is rated too
};

/// A fragment or blend to be rated, for the first time (repeat 0) or once more.
struct RatingTask {
  std::string fragment;
  int repeat = 0;

  [[nodiscard]] bool operator==(const RatingTask&) const = default;
};

/// All fragments in random order, and some of them a second time in its later half, five others at
/// least between. The same names and seed, the same order.
[[nodiscard]] std::vector<RatingTask> rating_order(const std::vector<std::string>& fragments,
                                                   std::uint64_t seed, double repeats);

/// The labelling room: what a rater sees next, blind to names, performers and others' ratings,
/// beside the most neutral fragment of the same content, both on the standard body. Every answer is
/// in the table on the disk before the next is asked for; what is there already is not asked again.
class LabelRoom {
 public:
  /// @throws as cli::read_table_fragments.
  LabelRoom(const LabellingOptions& options, const cli::Common& common);

  [[nodiscard]] Routes routes();

  /// The first task that is not answered: {"place", "done", "all", "factors", ..}, or place null.
  [[nodiscard]] Json next();
  /// What is to be rated at a place of the order, or the neutral beside it: another fragment, where
  /// there is one of that content.
  /// @throws HttpError{404} if there is no such place.
  [[nodiscard]] Response motion(int place, bool neutral) const;
  /// Takes {"place", "factors": {"flow": half steps or null, ..}, "confidence", "comment",
  /// "replays", "seconds"}: into the table, and with replays and seconds into TABLE.log, a line of
  /// JSON each. With "mend": true it takes the place of this observer's answer there, which the
  /// log's line then keeps as "before".
  /// @throws HttpError{400} naming the key; HttpError{409} if there is an answer and it is not to
  ///         be mended, or none that could be; Error{kIo} if it cannot be written.
  Json answer(const Json& request);
  /// This observer's answer at a place: {"factors", "confidence", "comment"}.
  /// @throws HttpError{404} if there is none.
  [[nodiscard]] Json answered_at(int place) const;
  /// How far raters agree so far (effort::rater_agreement), factor by factor.
  [[nodiscard]] Json agreement() const;

 private:
  [[nodiscard]] effort::LabelTable table() const;
  /// The row of this observer's answer; nullptr: there is none.
  [[nodiscard]] const effort::LabelRow* answer_to(const RatingTask& task,
                                                  const effort::LabelTable& table) const;
  /// The answer of a row as a page tells it.
  [[nodiscard]] Json told(const effort::LabelRow& row) const;
  [[nodiscard]] const RatingTask& task_at(int place) const;
  /// Once every fragment is rated: the blends, those this observer rated before the others.
  void queue_blends(const effort::LabelTable& table);
  /// Fragments and blends as this observer rated them.
  [[nodiscard]] transfer::StyleCorpus rated_corpus(const effort::LabelTable& table) const;
  /// Puts what a request answers into a row. @throws HttpError{400} naming the key.
  void rate(effort::LabelRow& row, const RatingTask& task, const Json& request) const;
  void log(const Json& line) const;

  LabellingOptions options_;
  std::vector<transfer::Fragment> fragments_;
  std::vector<transfer::CorpusBlend> blends_;
  /// Of each content its fragments, the most neutral first.
  std::map<std::string, std::vector<int>> neutral_;
  std::vector<RatingTask> tasks_;
  std::size_t waiting_ = 0;  ///< blends that are queued once the fragments are rated
};

}  // namespace laban::studio
