#include "laban/base/csv.h"

#include <charconv>
#include <limits>
#include <random>

#include <gmock/gmock.h>

#include "laban/base/error.h"

namespace laban::base {
namespace {

using ::testing::ElementsAre;

std::string problem_of(std::string_view text) {
  try {
    (void)parse_csv(text, "t.csv");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kFormat);
    return error.what();
  }
  return "";
}

TEST(Csv, SplitsRecordsAndCountsTheirLines) {
  const auto rows = parse_csv("a,b\n\n1, 2 \r\n,\r3", "t.csv");
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_THAT(rows[0].fields, ElementsAre("a", "b"));
  EXPECT_THAT(rows[1].fields, ElementsAre("1", " 2 "));
  EXPECT_THAT(rows[2].fields, ElementsAre("", ""));
  EXPECT_THAT(rows[3].fields, ElementsAre("3"));
  EXPECT_EQ(rows[0].line, 1);
  EXPECT_EQ(rows[1].line, 3);
  EXPECT_EQ(rows[2].line, 4);
  EXPECT_EQ(rows[3].line, 5);
}

TEST(Csv, ReadsQuotedFieldsOverLines) {
  const auto rows = parse_csv("\"a,\"\"b\"\"\",\"one\ntwo\r\nthree\rfour\"\nlast\n", "t.csv");
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_THAT(rows[0].fields, ElementsAre("a,\"b\"", "one\ntwo\r\nthree\rfour"));
  EXPECT_EQ(rows[1].line, 5);
}

TEST(Csv, DropsAByteOrderMarkAndReadsAnEmptyTextAsNoRecord) {
  EXPECT_EQ(parse_csv("\xEF\xBB\xBFx\n", "t.csv").at(0).fields.at(0), "x");
  EXPECT_TRUE(parse_csv("", "t.csv").empty());
  EXPECT_TRUE(parse_csv("\n\r\n\r", "t.csv").empty());
  EXPECT_EQ(parse_csv("\"\"\n", "t.csv").size(), 1u);  // one empty field is no blank line
}

TEST(Csv, NamesTheLineOfWhatIsMalformed) {
  EXPECT_EQ(problem_of("a\nb,\"c\nd\n"), "t.csv:2: a quoted field is not closed");
  EXPECT_EQ(problem_of("a\n\n\"b\"c\n"),
            "t.csv:3: text after a closing quote (double quotes inside a field)");
  EXPECT_EQ(problem_of("a b\"c\n"),
            "t.csv:1: a quote inside a field that does not begin with one (quote the whole field)");
  EXPECT_EQ(problem_of(std::string("a\n\0", 3)), "t.csv:2: a NUL byte (is this a text file?)");
  EXPECT_EQ(problem_of(std::string("\"a\n\0\"", 5)), "t.csv:2: a NUL byte (is this a text file?)");
}

TEST(Csv, RefusesMoreRowsOrFieldsThanItSays) {
  std::string rows;
  for (std::size_t i = 0; i < kMaxCsvRows; ++i) rows += "a\n";
  EXPECT_EQ(parse_csv(rows, "t.csv").size(), kMaxCsvRows);
  EXPECT_EQ(problem_of(rows + "a\n"),
            "t.csv:50001: more than 50000 rows, the most that are read; split the table");
  std::string fields = "a\n";
  fields.append(kMaxCsvFields, ',');
  EXPECT_EQ(problem_of(fields),
            "t.csv:2: more than 1000000 fields, the most that are read; split the table");
}

// Every text made of the awkward characters either parses or is refused as Error{kFormat}; what
// parses comes back after writing.
TEST(Csv, EveryAwkwardTextIsReadOrRefusedAndWhatIsReadSurvivesWriting) {
  std::mt19937_64 rng(3);
  const std::string alphabet = "a,\"\n\r \t";
  int accepted = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    std::string text;
    for (auto length = rng() % 12; length > 0; --length) text += alphabet[rng() % alphabet.size()];
    SCOPED_TRACE(::testing::PrintToString(text));
    std::vector<CsvRow> rows;
    try {
      rows = parse_csv(text, "t.csv");
    } catch (const Error& error) {
      ASSERT_EQ(error.kind(), ErrorKind::kFormat);
      continue;
    }
    ++accepted;
    std::string written;
    for (const CsvRow& row : rows) written += format_csv_row(row.fields);
    const auto again = parse_csv(written, "t.csv");
    ASSERT_EQ(again.size(), rows.size());
    for (std::size_t r = 0; r < rows.size(); ++r) ASSERT_EQ(again[r].fields, rows[r].fields);
  }
  EXPECT_GT(accepted, 1000);
}

TEST(Csv, NumbersAreShortAndExact) {
  EXPECT_EQ(format_number(0.1), "0.1");
  EXPECT_EQ(format_number(-2.0), "-2");
  for (const double value : {1.0 / 3.0, std::numeric_limits<double>::min(),
                             -std::numeric_limits<double>::max(), 5e-324}) {
    const std::string text = format_number(value);
    double again = 0.0;
    (void)std::from_chars(text.data(), text.data() + text.size(), again);
    EXPECT_EQ(again, value) << text;
  }
}

}  // namespace
}  // namespace laban::base
