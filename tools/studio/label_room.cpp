#include "label_room.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "laban/effort/agreement.h"
#include "laban/effort/observer.h"
#include "laban/motion/standard_body.h"

#include "suggested_blends.h"

namespace laban::studio {
namespace {

/// Others that are shown between a fragment and its repeat, at least.
constexpr std::size_t kLeastBetween = 5;
constexpr std::size_t kLongestComment = 2000;

/// Held while a table is read, changed and written, so that of several studios none loses what
/// another has written: a lock on its log.
class TableLock {
 public:
  explicit TableLock(const std::string& table) {
    const std::string path = table + ".log";
    file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
    if (file_ >= 0 && ::flock(file_, LOCK_EX) == 0) return;
    const int failed = errno;
    if (file_ >= 0) ::close(file_);
    throw base::Error(base::ErrorKind::kIo,
                      path + ": cannot be opened and locked: " + std::strerror(failed));
  }
  ~TableLock() { ::close(file_); }
  TableLock(const TableLock&) = delete;
  TableLock& operator=(const TableLock&) = delete;

 private:
  int file_ = -1;
};

/// Of each content its fragments, from the one whose measured Effort is nearest to none on.
std::map<std::string, std::vector<int>> neutral_fragments(
    const std::vector<transfer::Fragment>& fragments) {
  std::vector<effort::Descriptors> descriptors;
  std::vector<std::string> contents;
  for (const transfer::Fragment& fragment : fragments) {
    descriptors.push_back(effort::describe(fragment.pose));
    contents.push_back(fragment.content);
  }
  const effort::ObserverReference reference = effort::fit_observer_reference(descriptors, contents);
  std::vector<double> away;
  std::map<std::string, std::vector<int>> neutral;
  for (std::size_t n = 0; n < fragments.size(); ++n) {
    const effort::Effort e = effort::observe(descriptors[n], reference, contents[n]).unclipped;
    away.push_back(std::hypot(e.flow, e.weight, e.time));
    neutral[contents[n]].push_back(static_cast<int>(n));
  }
  for (auto& [content, numbers] : neutral) {
    std::stable_sort(numbers.begin(), numbers.end(), [&](int a, int b) {
      return away[static_cast<std::size_t>(a)] < away[static_cast<std::size_t>(b)];
    });
  }
  return neutral;
}

std::vector<transfer::CorpusBlend> blends_of(const effort::LabelTable& table,
                                             const std::vector<transfer::Fragment>& fragments) {
  const auto index_of = [&](const std::string& name) {
    const auto found = std::find_if(fragments.begin(), fragments.end(),
                                    [&](const auto& fragment) { return fragment.name == name; });
    return static_cast<int>(found - fragments.begin());
  };
  std::vector<transfer::CorpusBlend> blends;
  for (const effort::LabelRow& row : effort::blends(effort::mean_over_observers(table))) {
    blends.push_back(
        {row.fragment, index_of(row.parent_i), index_of(row.parent_j), *row.alpha, {}});
  }
  return blends;
}

/// A half step in [-3, 3], or nothing where the factor was not observed.
std::optional<double> rating_of(const Json& factors, const std::string& factor) {
  if (!factors.contains(factor) || factors[factor].is_null()) return std::nullopt;
  if (!factors[factor].is_number()) throw HttpError(400, "'" + factor + "' is no number");
  const double value = factors[factor];
  if (!(std::abs(value) <= effort::kEffortMax) || 2.0 * value != std::floor(2.0 * value))
    throw HttpError(400, "'" + factor + "' must be a half step from -3 to 3");
  return value;
}

std::optional<double> confidence_of(const Json& request) {
  const Json value = request.value("confidence", Json());
  if (value.is_null()) return std::nullopt;
  if (!value.is_number() || !(value >= 0.0 && value <= 1.0))
    throw HttpError(400, "'confidence' must be in [0, 1]");
  return value.get<double>();
}

std::string comment_of(const Json& request) {
  const Json value = request.value("comment", Json(""));
  if (!value.is_string() || value.get<std::string>().size() > kLongestComment)
    throw HttpError(400, "'comment' must be a text of up to 2000 bytes");
  std::string text = value.get<std::string>();
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32; }, ' ');
  return text;
}

/// True if any factor was observed.
bool is_observed(const effort::LabelRow& row) {
  return row.flow || row.weight || row.time || row.space;
}

/// Where a judgement goes: into the blank row of its fragment, else behind the fragment's last.
effort::LabelRow& row_for(effort::LabelTable& table, const RatingTask& task) {
  auto& rows = table.rows;
  const auto same = [&](const effort::LabelRow& row) { return row.fragment == task.fragment; };
  const auto last = std::find_if(rows.rbegin(), rows.rend(), same);
  if (last == rows.rend())
    throw HttpError(409, "the table no longer has this fragment; start the studio again");
  const auto blank = std::find_if(rows.begin(), rows.end(), [&](const effort::LabelRow& row) {
    return same(row) && row.observer.empty() && !is_observed(row) && !row.confidence;
  });
  if (task.repeat == 0 && blank != rows.end()) return *blank;
  effort::LabelRow copy = *last;
  copy.space.reset();
  return *rows.insert(last.base(), std::move(copy));
}

}  // namespace

std::vector<RatingTask> rating_order(const std::vector<std::string>& fragments, std::uint64_t seed,
                                     double repeats) {
  base::Rng rng(seed);
  std::vector<RatingTask> order;
  for (const int n : rng.permutation(static_cast<int>(fragments.size())))
    order.push_back({fragments[static_cast<std::size_t>(n)], 0});
  // Those that come again are of the first half, and come again somewhere in the second.
  const std::size_t all = order.size();
  const auto wanted = static_cast<std::size_t>(std::lround(repeats * static_cast<double>(all)));
  const std::size_t half = all / 2;
  const std::vector<int> first = rng.permutation(static_cast<int>(half));
  for (const int candidate : first) {
    const auto shown = static_cast<std::size_t>(candidate);
    const std::size_t from = std::max(half, shown + 1 + kLeastBetween);
    if (order.size() == all + wanted) break;
    if (from > order.size()) continue;
    const auto at =
        from + static_cast<std::size_t>(rng.index(static_cast<int>(order.size() - from) + 1));
    order.insert(order.begin() + static_cast<std::ptrdiff_t>(at), {order[shown].fragment, 1});
  }
  return order;
}

LabelRoom::LabelRoom(const LabellingOptions& options, const cli::Common& common)
    : options_(options) {
  for (cli::CutFragment& cut : cli::read_table_fragments(options.table, common))
    fragments_.push_back(std::move(cut.fragment));
  blends_ = blends_of(table(), fragments_);
  neutral_ = neutral_fragments(fragments_);
  std::vector<std::string> names;
  for (const transfer::Fragment& fragment : fragments_) names.push_back(fragment.name);
  if (options.suggested) {
    waiting_ = blends_.size();
  } else {
    for (const transfer::CorpusBlend& blend : blends_) names.push_back(blend.name);
  }
  tasks_ = rating_order(names, options.seed, options.repeats);
}

Routes LabelRoom::routes() {
  const auto place_of = [](const Request& request) {
    const std::string text = query_value(request, "place");
    int place = -1;
    std::from_chars(text.data(), text.data() + text.size(), place);
    return place;
  };
  return {
      {"GET /api/label/next", [this](const Request&) { return json_response(next()); }},
      {"GET /api/label/motion",
       [this, place_of](const Request& request) {
         return motion(place_of(request), query_value(request, "which") == "neutral");
       }},
      {"GET /api/label/answer",
       [this, place_of](const Request& request) {
         return json_response(answered_at(place_of(request)));
       }},
      {"POST /api/label/answer",
       json_route([this](const Json& request) { return answer(request); })},
      {"GET /api/label/agreement", [this](const Request&) { return json_response(agreement()); }}};
}

effort::LabelTable LabelRoom::table() const {
  return effort::parse_label_table(base::read_file(options_.table), options_.table);
}

const effort::LabelRow* LabelRoom::answer_to(const RatingTask& task,
                                             const effort::LabelTable& table) const {
  const auto found =
      std::find_if(table.rows.begin(), table.rows.end(), [&](const effort::LabelRow& row) {
        return row.fragment == task.fragment && row.observer == options_.observer &&
               row.repeat == task.repeat && (is_observed(row) || row.confidence);
      });
  return found == table.rows.end() ? nullptr : &*found;
}

Json LabelRoom::told(const effort::LabelRow& row) const {
  const auto number = [](const std::optional<double>& value) {
    return value ? Json(*value) : Json();
  };
  Json json = {
      {"factors",
       {{"flow", number(row.flow)}, {"weight", number(row.weight)}, {"time", number(row.time)}}},
      {"confidence", is_observed(row) ? number(row.confidence) : Json()},
      {"comment", row.comment}};
  if (options_.space) json["factors"]["space"] = number(row.space);
  return json;
}

Json LabelRoom::answered_at(int place) const {
  const effort::LabelTable now = table();
  const effort::LabelRow* row = answer_to(task_at(place), now);
  if (row == nullptr) throw HttpError(404, "nothing was answered at this place");
  return told(*row);
}

const RatingTask& LabelRoom::task_at(int place) const {
  if (place < 0 || place >= static_cast<int>(tasks_.size()))
    throw HttpError(404, "there is nothing to rate at this place");
  return tasks_[static_cast<std::size_t>(place)];
}

transfer::StyleCorpus LabelRoom::rated_corpus(const effort::LabelTable& table) const {
  effort::LabelTable own;
  std::copy_if(table.rows.begin(), table.rows.end(), std::back_inserter(own.rows),
               [&](const auto& row) { return row.observer == options_.observer; });
  std::map<std::string, effort::Effort> rated;
  for (const effort::LabelRow& row : effort::mean_over_observers(own).rows) {
    if (row.flow && row.weight && row.time)
      rated[row.fragment] = {*row.flow, *row.weight, *row.time};
  }
  const auto rating = [&](const std::string& name) -> std::optional<effort::Effort> {
    const auto found = rated.find(name);
    return found == rated.end() ? std::nullopt : std::optional(found->second);
  };
  transfer::StyleCorpus corpus{fragments_, blends_};
  for (transfer::Fragment& fragment : corpus.fragments) fragment.effort = rating(fragment.name);
  for (transfer::CorpusBlend& blend : corpus.blends) blend.effort = rating(blend.name);
  return corpus;
}

void LabelRoom::queue_blends(const effort::LabelTable& table) {
  waiting_ = 0;
  const transfer::StyleCorpus corpus = rated_corpus(table);
  std::vector<transfer::CorpusBlend> pool;
  std::vector<RatingTask> others;
  for (const transfer::CorpusBlend& blend : corpus.blends) {
    const RatingTask task{blend.name, 0};
    if (answer_to(task, table) != nullptr) {
      tasks_.push_back(task);
    } else if (cli::has_labelled_parents(corpus, blend)) {
      pool.push_back(blend);
    } else {
      others.push_back(task);
    }
  }
  if (!pool.empty()) {
    for (const cli::SuggestedBlend& next :
         cli::suggested_blends(corpus, pool, static_cast<int>(pool.size())))
      tasks_.push_back({next.blend.name, 0});
  }
  tasks_.insert(tasks_.end(), others.begin(), others.end());
}

Json LabelRoom::next() {
  const effort::LabelTable now = table();
  const auto is_answered = [&](const RatingTask& task) { return answer_to(task, now) != nullptr; };
  if (waiting_ > 0 && std::all_of(tasks_.begin(), tasks_.end(), is_answered)) queue_blends(now);
  Json factors{"flow", "weight", "time"};
  if (options_.space) factors.push_back("space");
  Json json = {{"observer", options_.observer},
               {"factors", factors},
               {"place", Json()},
               {"done", 0},
               {"all", tasks_.size() + waiting_}};
  int done = 0;
  for (std::size_t n = 0; n < tasks_.size(); ++n) {
    if (is_answered(tasks_[n])) {
      ++done;
    } else if (json["place"].is_null()) {
      json["place"] = n;
    }
  }
  json["done"] = done;
  return json;
}

Response LabelRoom::motion(int place, bool neutral) const {
  const RatingTask& task = task_at(place);
  const auto seed = std::find_if(fragments_.begin(), fragments_.end(),
                                 [&](const auto& one) { return one.name == task.fragment; });
  const auto blend = std::find_if(blends_.begin(), blends_.end(),
                                  [&](const auto& one) { return one.name == task.fragment; });
  const transfer::Fragment& of =
      seed != fragments_.end() ? *seed : fragments_[static_cast<std::size_t>(blend->fragment_i)];
  const std::vector<int>& others = neutral_.at(of.content);
  const bool itself = seed != fragments_.end() && others.size() > 1 &&
                      fragments_[static_cast<std::size_t>(others[0])].name == task.fragment;
  const transfer::Fragment& beside = fragments_[static_cast<std::size_t>(others[itself ? 1 : 0])];
  const motion::PoseMatrix pose = neutral ? beside.pose
                                  : seed != fragments_.end()
                                      ? seed->pose
                                      : transfer::make_blend(fragments_, *blend).pose;
  const motion::Clip clip = motion::to_standard_clip(pose);
  return {200, "application/x-laban-motion", motion_bytes({clip, motion::find_humanoid(clip)})};
}

Json LabelRoom::answer(const Json& request) {
  const Json place = request.value("place", Json());
  if (!place.is_number_integer()) throw HttpError(400, "'place' is no whole number");
  const RatingTask& task = task_at(place);
  const TableLock lock(options_.table);
  effort::LabelTable now = table();
  const effort::LabelRow* before = answer_to(task, now);
  const bool mend = request.value("mend", Json(false)) == Json(true);
  if (mend && before == nullptr) throw HttpError(409, "there is no answer to mend");
  if (!mend && before != nullptr) throw HttpError(409, "this was answered before");
  Json line = {{"fragment", task.fragment},
               {"repeat", task.repeat},
               {"observer", options_.observer},
               {"seed", options_.seed},
               {"place", place},
               {"replays", request.value("replays", Json())},
               {"seconds", request.value("seconds", Json())}};
  if (mend) line["before"] = told(*before);
  rate(mend ? now.rows[static_cast<std::size_t>(before - now.rows.data())] : row_for(now, task),
       task, request);
  // What is replaced is in the log before it leaves the table.
  if (mend) log(line);
  base::write_file(options_.table, effort::format_label_table(now), {.overwrite = true});
  if (!mend) log(line);
  return next();
}

void LabelRoom::rate(effort::LabelRow& row, const RatingTask& task, const Json& request) const {
  const Json factors = request.value("factors", Json::object());
  row.flow = rating_of(factors, "flow");
  row.weight = rating_of(factors, "weight");
  row.time = rating_of(factors, "time");
  if (options_.space) row.space = rating_of(factors, "space");
  row.confidence = confidence_of(request);
  // Nothing observed is an answer too: one that counts nowhere.
  if (!is_observed(row)) row.confidence = 0.0;
  row.comment = comment_of(request);
  row.observer = options_.observer;
  row.source = effort::LabelSource::kExpert;
  row.repeat = task.repeat;
}

void LabelRoom::log(const Json& line) const {
  const std::string path = options_.table + ".log";
  const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const bool written =
      file >= 0 && ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
      ::fsync(file) == 0;
  const int failed = errno;
  if (file >= 0) ::close(file);
  if (!written) {
    throw base::Error(base::ErrorKind::kIo, path + ": cannot be written: " + std::strerror(failed) +
                                                "; the table holds what was answered");
  }
}

Json LabelRoom::agreement() const {
  const effort::AgreementReport report = effort::rater_agreement(table());
  Json json = {{"raters", report.raters},
               {"fragments", report.fragments},
               {"factors", Json::array()},
               {"repeats", Json::array()}};
  for (const effort::FactorAgreement& factor : report.factors) {
    const auto& alpha = factor.alpha;
    json["factors"].push_back(
        {{"factor", factor.factor},
         {"alpha", alpha.alpha ? Json(*alpha.alpha) : Json()},
         {"interval", alpha.interval ? Json{alpha.interval->low, alpha.interval->high} : Json()},
         {"icc", factor.icc.value ? Json(*factor.icc.value) : Json()}});
  }
  for (const effort::RepeatAgreement& repeat : report.repeats) {
    json["repeats"].push_back({{"rater", repeat.rater},
                               {"factor", repeat.factor},
                               {"units", repeat.units},
                               {"mean_absolute_difference", repeat.mean_absolute_difference}});
  }
  return json;
}

}  // namespace laban::studio
