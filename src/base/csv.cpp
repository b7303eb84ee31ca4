#include "laban/base/csv.h"

#include <array>
#include <charconv>

#include "laban/base/error.h"

namespace laban::base {
namespace {

/// Walks through the text once, a record at a time.
class Reader {
 public:
  Reader(std::string_view text, std::string_view name) : text_(text), name_(name) {
    if (text_.substr(0, 3) == "\xEF\xBB\xBF") at_ = 3;
  }

  [[nodiscard]] bool done() const { return at_ >= text_.size(); }

  /// The next record; a blank line gives one empty, unquoted field and sets `blank`.
  CsvRow record(bool& blank) {
    CsvRow row;
    row.line = line_;
    const std::size_t begin = at_;
    while (true) {
      row.fields.push_back(field());
      if (++field_count_ > kMaxCsvFields) {
        fail(line_, "more than " + std::to_string(kMaxCsvFields) +
                        " fields, the most that are read; split the table");
      }
      if (done() || text_[at_] != ',') break;
      ++at_;
    }
    blank = at_ == begin;
    end_line();
    return row;
  }

 private:
  [[noreturn]] void fail(int line, const std::string& problem) const {
    throw Error(ErrorKind::kFormat,
                std::string(name_) + ":" + std::to_string(line) + ": " + problem);
  }

  [[nodiscard]] bool at_end_of_field() const {
    return done() || text_[at_] == ',' || text_[at_] == '\n' || text_[at_] == '\r';
  }

  std::string field() { return !done() && text_[at_] == '"' ? quoted_field() : plain_field(); }

  std::string plain_field() {
    const std::size_t begin = at_;
    while (!at_end_of_field()) {
      if (text_[at_] == '"') {
        fail(line_, "a quote inside a field that does not begin with one (quote the whole field)");
      }
      if (text_[at_] == '\0') fail(line_, "a NUL byte (is this a text file?)");
      ++at_;
    }
    return std::string(text_.substr(begin, at_ - begin));
  }

  std::string quoted_field() {
    const int opened_on = line_;
    std::string value;
    for (++at_;; ++at_) {
      if (done()) fail(opened_on, "a quoted field is not closed");
      const char c = text_[at_];
      if (c == '\0') fail(line_, "a NUL byte (is this a text file?)");
      if (c == '"') {
        const bool doubled = at_ + 1 < text_.size() && text_[at_ + 1] == '"';
        if (!doubled) break;
        ++at_;
      }
      // A line ends at LF, or at a CR that no LF follows.
      if (c == '\n' || (c == '\r' && text_.substr(at_ + 1, 1) != "\n")) ++line_;
      value += c;
    }
    ++at_;
    if (!at_end_of_field())
      fail(line_, "text after a closing quote (double quotes inside a field)");
    return value;
  }

  void end_line() {
    if (done()) return;
    at_ += text_.substr(at_, 2) == "\r\n" ? 2 : 1;
    ++line_;
  }

  std::string_view text_;
  std::string_view name_;
  std::size_t at_ = 0;
  int line_ = 1;
  std::size_t field_count_ = 0;
};

}  // namespace

std::vector<CsvRow> parse_csv(std::string_view text, std::string_view name) {
  std::vector<CsvRow> rows;
  for (Reader reader(text, name); !reader.done();) {
    bool blank = false;
    CsvRow row = reader.record(blank);
    if (blank) continue;
    if (rows.size() == kMaxCsvRows) {
      throw Error(ErrorKind::kFormat, std::string(name) + ":" + std::to_string(row.line) +
                                          ": more than " + std::to_string(kMaxCsvRows) +
                                          " rows, the most that are read; split the table");
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string format_csv_row(const std::vector<std::string>& fields) {
  std::string text;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (i > 0) text += ',';
    const std::string& field = fields[i];
    const bool lone_empty = fields.size() == 1 && field.empty();
    if (!lone_empty && field.find_first_of(",\"\r\n") == std::string::npos) {
      text += field;
      continue;
    }
    text += '"';
    for (const char c : field) text.append(c == '"' ? 2 : 1, c);
    text += '"';
  }
  return text + '\n';
}

std::string format_number(double value) {
  std::array<char, 32> buffer{};  // the longest double has 24 characters
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

}  // namespace laban::base
