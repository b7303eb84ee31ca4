#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace laban::base {

/// Most records, and most fields in all of them, that a CSV text may have. Far above any table of
/// labels; a field takes 32 bytes of memory but only one of the text.
inline constexpr std::size_t kMaxCsvRows = 50'000;
inline constexpr std::size_t kMaxCsvFields = 1'000'000;

/// One record of a CSV text.
struct CsvRow {
  int line = 1;  ///< where it begins in the text, counted from 1
  std::vector<std::string> fields;
};

/// Splits CSV text into records after RFC 4180: comma-separated, fields with commas, quotes or line
/// breaks in double quotes, a quote doubled inside them.
///
/// Beyond the RFC, as real files need: LF, CRLF or lone CR end a record, a UTF-8 byte order mark is
/// dropped, blank lines are skipped, the last line need not end. Spaces are kept.
/// @param name  of the file, for messages.
/// @throws Error{kFormat} "name:line: ..." for an unclosed quote, text after a closing quote, a
///         quote inside an unquoted field, a NUL byte, more than kMaxCsvRows or kMaxCsvFields.
[[nodiscard]] std::vector<CsvRow> parse_csv(std::string_view text, std::string_view name);

/// One record with LF at its end; fields that need quotes get them. A record of one empty field is
/// written as "" in quotes, so that it is not read as a blank line.
[[nodiscard]] std::string format_csv_row(const std::vector<std::string>& fields);

/// The shortest decimal text that reads back as exactly this number (std::to_chars).
[[nodiscard]] std::string format_number(double value);

}  // namespace laban::base
