#include "apply_batch.h"

#include <algorithm>
#include <array>
#include <map>
#include <mutex>
#include <new>

#include <fmt/core.h>

#include "laban/base/csv.h"
#include "laban/base/error.h"
#include "laban/base/sha256.h"
#include "laban/base/version.h"
#include "laban/math/parallel.h"

#include "report.h"

namespace laban::cli {
namespace {

namespace fs = std::filesystem;
using base::Error;
using base::ErrorKind;

/// Figures of an output, in the order of the table: means over its snippets, by their frames.
constexpr std::array kFigures = {"snippets",           "asked_flow",     "asked_weight",
                                 "asked_time",         "predicted_flow", "predicted_weight",
                                 "predicted_time",     "measured_flow",  "measured_weight",
                                 "measured_time",      "asked_space",    "predicted_space",
                                 "skate_cm_per_frame", "seconds"};

/// A row of the table of results.
struct Row {
  std::string input;
  std::string output;  ///< name in the folder
  std::string status;  ///< "done", "skipped" (in the table "done") or "failed"
  std::vector<std::string> figures = std::vector<std::string>(kFigures.size());  ///< blank: none
  std::string error;     ///< of a failed clip
  std::string checksum;  ///< of all that the output depends on
};

/// The table: rows by output name.
using Table = std::map<std::string, Row>;

std::vector<std::string> head() {
  std::vector<std::string> names = {"input", "output", "status"};
  names.insert(names.end(), kFigures.begin(), kFigures.end());
  names.insert(names.end(), {"error", "checksum"});
  return names;
}

std::string format_table(const Table& table) {
  std::string text = base::format_csv_row(head());
  for (const auto& [output, row] : table) {
    std::vector<std::string> fields = {row.input, output,
                                       row.status == "failed" ? "failed" : "done"};
    fields.insert(fields.end(), row.figures.begin(), row.figures.end());
    fields.insert(fields.end(), {row.error, row.checksum});
    text += base::format_csv_row(fields);
  }
  return text;
}

/// The table of an earlier run; empty if there is none, or it shall be forgotten.
Table read_table(const std::string& path, const Common& common) {
  Table table;
  if (common.force || !fs::exists(path)) return table;
  const std::vector<base::CsvRow> rows = base::parse_csv(read_bytes(path), path);
  const std::size_t columns = head().size();
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const std::vector<std::string>& fields = rows[n].fields;
    if (fields.size() != columns || (n == 0 && fields != head())) {
      throw Error(ErrorKind::kFormat, fmt::format("{}:{}: no row of a table of 'laban apply'; give "
                                                  "--force to begin anew",
                                                  path, rows[n].line));
    }
    if (n == 0) continue;
    Row row{fields[0], fields[1], fields[2], {}, fields[columns - 2], fields[columns - 1]};
    row.figures.assign(fields.begin() + 3, fields.end() - 2);
    table[row.output] = std::move(row);
  }
  return table;
}

bool is_clip(const fs::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending == ".bvh" || ending == ".glb" || ending == ".gltf" || ending == ".amc";
}

/// The inputs with each folder replaced by the clips in it, in the order of their names.
std::vector<std::string> clips_of(const std::vector<std::string>& inputs) {
  std::vector<std::string> clips;
  for (const std::string& input : inputs) {
    if (input == "-") throw Error(ErrorKind::kUsage, "stdin cannot be one of several clips");
    if (!fs::is_directory(input)) {
      clips.push_back(input);
      continue;
    }
    std::vector<std::string> found;
    std::error_code failed;
    for (const auto& entry : fs::directory_iterator(input, failed)) {
      if (entry.is_regular_file() && is_clip(entry.path())) found.push_back(entry.path().string());
    }
    if (failed) throw Error(ErrorKind::kIo, input + ": cannot be read: " + failed.message());
    if (found.empty())
      throw Error(ErrorKind::kUsage, input + ": no clip in this folder (.bvh, .glb, .gltf, .amc)");
    std::sort(found.begin(), found.end());
    clips.insert(clips.end(), found.begin(), found.end());
  }
  return clips;
}

/// "walk.bvh" for a BVH or AMC, "walk.glb" for a glTF, or as --format says.
std::string output_name(const fs::path& input, const WriteClipOptions& writing) {
  std::string format = writing.format;
  if (format.empty()) {
    const std::string ending = input.extension().string();
    format = ending == ".glb" || ending == ".gltf" ? "glb" : "bvh";
  }
  return input.stem().string() + "." + format;
}

class Batch {
 public:
  Batch(const StylingOptions& styling, const BatchOptions& batch, const Common& common)
      : options_(batch),
        common_(common),
        clips_(clips_of(batch.inputs)),
        rows_(clips_.size()),
        kinds_(clips_.size(), ErrorKind::kInternal) {
    name_outputs();
    make_folder();
    table_ = read_table(path_of(kSummaryName), common);
    styling_.emplace(read_styling(styling));
    for (std::size_t n = 0; n < clips_.size(); ++n) look_at(n);
  }

  void run() {
    const auto progress = terminal_progress(common_, "styling");
    std::size_t finished = 0;
    math::parallel_for(static_cast<int>(clips_.size()), common_.threads, [&](int index) {
      const auto n = static_cast<std::size_t>(index);
      if (rows_[n].status.empty()) style(n);
      const std::lock_guard lock(mutex_);
      table_[rows_[n].output] = rows_[n];
      if (rows_[n].status != "skipped") write_table();
      ++finished;
      (void)progress->update(static_cast<double>(finished) / static_cast<double>(clips_.size()));
    });
    write_table();
  }

  void print() const {
    if (common_.json) return fmt::print("{}\n", json().dump(2));
    for (const Row& row : rows_) {
      fmt::print("{:<8} {} -> {}{}\n", row.status, row.input, path_of(row.output),
                 row.error.empty() ? "" : ": " + row.error);
    }
    fmt::print("{} done, {} already there, {} failed; see {}\n", count("done"), count("skipped"),
               count("failed"), path_of(kSummaryName));
  }

  void throw_failure() const {
    const auto failed = std::find_if(rows_.begin(), rows_.end(),
                                     [](const Row& row) { return row.status == "failed"; });
    if (failed == rows_.end()) return;
    throw Error(kinds_[static_cast<std::size_t>(failed - rows_.begin())],
                fmt::format("{} of {} clips failed, the first: {}", count("failed"), rows_.size(),
                            failed->error));
  }

 private:
  [[nodiscard]] std::string path_of(const std::string& name) const {
    return (fs::path(options_.folder) / name).string();
  }
  [[nodiscard]] std::ptrdiff_t count(std::string_view status) const {
    return std::count_if(rows_.begin(), rows_.end(),
                         [&](const Row& row) { return row.status == status; });
  }

  void name_outputs() {
    std::map<std::string, std::string> inputs;
    for (std::size_t n = 0; n < clips_.size(); ++n) {
      Row& row = rows_[n];
      row.input = clips_[n];
      row.output = output_name(clips_[n], options_.writing);
      (void)check_clip_output(path_of(row.output), options_.writing);
      const auto [known, is_new] = inputs.emplace(row.output, row.input);
      if (is_new) continue;
      throw Error(ErrorKind::kUsage, fmt::format("{} and {} would both become {}", known->second,
                                                 row.input, path_of(row.output)));
    }
  }

  void make_folder() const {
    std::error_code failed;
    fs::create_directories(options_.folder, failed);
    if (failed) {
      throw Error(ErrorKind::kIo, options_.folder + ": cannot be made: " + failed.message());
    }
  }

  /// Of everything that an output depends on.
  [[nodiscard]] std::string checksum(const std::string& input) const {
    std::vector<InputRecord> inputs = styling_->inputs;
    inputs.push_back({"", base::sha256_hex(read_bytes(input))});
    const WriteClipOptions& writing = options_.writing;
    const ReadClipOptions& reading = styling_->options.reading;
    const Json written = {writing.up_axis, writing.no_mesh, writing.is_compact(),
                          writing.compact_tolerance_deg.value_or(0.0)};
    const Json read = {reading.unit_m.value_or(0.0),
                       reading.frame_rate_hz.value_or(0.0),
                       reading.map,
                       reading.up_axis,
                       reading.skeleton,
                       reading.animation};
    Json all = {base::version(), options_json(*styling_), written, read};
    for (const InputRecord& record : inputs) all.push_back(record.sha256);
    return base::sha256_hex(all.dump());
  }

  /// Is there anything to do, and may it be done?
  void look_at(std::size_t n) {
    Row& row = rows_[n];
    try {
      row.checksum = checksum(row.input);
    } catch (const Error& error) {
      return fail(n, error.kind(), error.what());
    }
    if (common_.force || !fs::exists(path_of(row.output))) return;
    const auto known = table_.find(row.output);
    if (known != table_.end() && known->second.checksum == row.checksum &&
        known->second.status == "done") {
      row.figures = known->second.figures;
      row.status = "skipped";
      return;
    }
    throw Error(ErrorKind::kIo, path_of(row.output) +
                                    ": exists already, and not from this input with these options; "
                                    "give --force to overwrite it");
  }

  void fail(std::size_t n, ErrorKind kind, const std::string& what) {
    Row& row = rows_[n];
    row.status = "failed";
    row.error = what.starts_with(row.input) ? what : row.input + ": " + what;
    kinds_[n] = kind;
  }

  void style(std::size_t n) {
    Row& row = rows_[n];
    try {
      const StyledFile file = style_file(*styling_, row.input, common_);
      for (const std::string& caution : cautions(*styling_, file.applied, row.input))
        warn(common_, caution);
      WriteClipOptions writing = options_.writing;
      writing.format.clear();  // the name ends with it
      write_styled(file, path_of(row.output), writing, common_);
      row.figures = figures_of(file);
      row.status = "done";
    } catch (const Error& error) {
      fail(n, error.kind(), error.what());
    } catch (const std::bad_alloc&) {
      fail(n, ErrorKind::kNumeric, "out of memory");
    }
  }

  [[nodiscard]] std::vector<std::string> figures_of(const StyledFile& file) const {
    std::array<double, 11> sums = {};
    std::array<double, 11> frames = {};
    const auto add = [&](std::size_t cell, double value, double weight) {
      sums[cell] += weight * value;
      frames[cell] += weight;
    };
    for (const transfer::AppliedSnippet& snippet : file.applied.snippets) {
      const double weight = snippet.end - snippet.begin;
      for (const effort::Factor factor : effort::kFactors) {
        const auto f = static_cast<std::size_t>(effort::index_of(factor));
        if (!snippet.kept && snippet.asked.factors[f]) add(f, *snippet.asked.factors[f], weight);
        if (!snippet.kept) add(3 + f, snippet.choice.predicted[factor], weight);
        add(6 + f, snippet.measured.effort[factor], weight);
      }
      constexpr auto kSpace = static_cast<std::size_t>(effort::Factor::kSpace);
      if (snippet.kept || kSpace >= styling_->model.factors().size()) continue;
      if (snippet.asked.factors[kSpace]) add(9, *snippet.asked.factors[kSpace], weight);
      add(10, snippet.choice.predicted.space, weight);
    }
    std::vector<std::string> figures = {std::to_string(file.applied.snippets.size())};
    for (std::size_t cell = 0; cell < sums.size(); ++cell) {
      figures.push_back(frames[cell] > 0.0 ? base::format_number(sums[cell] / frames[cell]) : "");
    }
    figures.push_back(base::format_number(file.quality.output.foot_skate_cm));
    figures.push_back(base::format_number(file.styled.clip.duration_s()));
    return figures;
  }

  void write_table() const {
    Common writing = common_;
    writing.force = true;  // it is our own
    write_bytes(path_of(kSummaryName), format_table(table_), writing);
  }

  [[nodiscard]] Json json() const {
    Json json = {{"schema", "laban.apply-batch/1"}, {"clips", Json::array()}};
    std::vector<InputRecord> inputs = styling_->inputs;
    for (const Row& row : rows_) {
      Json clip = {{"input", row.input},
                   {"output", path_of(row.output)},
                   {"status", row.status},
                   {"error", row.error.empty() ? Json() : Json(row.error)}};
      for (std::size_t f = 0; f < kFigures.size(); ++f)
        clip[kFigures[f]] = row.figures[f].empty() ? Json() : Json::parse(row.figures[f]);
      json["clips"].push_back(std::move(clip));
    }
    json["summary"] = path_of(kSummaryName);
    json["run"] = run_record("apply", options_json(*styling_), inputs);
    return json;
  }

  const BatchOptions& options_;
  const Common& common_;
  std::vector<std::string> clips_;
  std::vector<Row> rows_;         // one a clip
  std::vector<ErrorKind> kinds_;  // of failed clips
  std::optional<Styling> styling_;
  std::mutex mutex_;
  Table table_;  // what the folder holds; under mutex_ while clips are styled
};

}  // namespace

void apply_batch(const StylingOptions& styling, const BatchOptions& batch, const Common& common) {
  Batch work(styling, batch, common);
  work.run();
  work.print();
  work.throw_failure();
}

}  // namespace laban::cli
