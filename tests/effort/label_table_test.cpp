#include "laban/effort/label_table.h"

#include <fstream>
#include <random>
#include <sstream>

#include <gmock/gmock.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

namespace laban::effort {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr const char* kHeader =
    "fragment,clip,begin_frame,end_frame,content,performer,flow,weight,time,space,observer,source,"
    "confidence,parent_i,parent_j,alpha,comment\n";

std::string problem_of(const std::string& text) {
  try {
    (void)parse_label_table(text, "t.csv");
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kFormat);
    return error.what();
  }
  return "";
}

const std::string kGood =
    std::string(kHeader) +
    "a,a.bvh,0,40,walk,ann,1,-0.5,2,,bob,expert,0.5,,,,\"said, \"\"yes\"\"\"\n"
    "b,b.bvh,,,walk,cat,-3,3,0,1.5,bob,expert,,,,,\n"
    "ab,,,,walk,,0.1,+0.2, 0.3 ,,,measured,,a,b,-0.25,\n";

TEST(LabelTable, ReadsSeedsBlendsAndBlanks) {
  const LabelTable table = parse_label_table(kGood, "t.csv");
  ASSERT_EQ(table.rows.size(), 3u);
  const LabelRow& a = table.rows[0];
  EXPECT_EQ(a.fragment, "a");
  EXPECT_EQ(a.clip, "a.bvh");
  EXPECT_EQ(a.begin_frame, 0);
  EXPECT_EQ(a.end_frame, 40);
  EXPECT_EQ(a.content, "walk");
  EXPECT_EQ(a.performer, "ann");
  EXPECT_EQ(a.flow, 1.0);
  EXPECT_EQ(a.weight, -0.5);
  EXPECT_EQ(a.time, 2.0);
  EXPECT_EQ(a.space, std::nullopt);
  EXPECT_EQ(a.observer, "bob");
  EXPECT_EQ(a.source, LabelSource::kExpert);
  EXPECT_EQ(a.confidence, 0.5);
  EXPECT_EQ(a.comment, "said, \"yes\"");
  EXPECT_EQ(a.line, 2);
  EXPECT_FALSE(a.is_blend());
  EXPECT_EQ(table.rows[1].begin_frame, std::nullopt);
  EXPECT_EQ(table.rows[1].space, 1.5);
  const LabelRow& ab = table.rows[2];
  EXPECT_TRUE(ab.is_blend());
  EXPECT_EQ(ab.source, LabelSource::kMeasured);
  EXPECT_EQ(ab.parent_i, "a");
  EXPECT_EQ(ab.parent_j, "b");
  EXPECT_EQ(ab.alpha, -0.25);
  EXPECT_EQ(ab.weight, 0.2);
  EXPECT_EQ(ab.time, 0.3);
  EXPECT_EQ(seeds(table).size(), 2u);
  EXPECT_EQ(blends(table).size(), 1u);
  EXPECT_THAT(problems(table, "t.csv"), IsEmpty());
}

TEST(LabelTable, ColumnsMayComeInAnyOrderAndOptionalOnesMayBeAbsent) {
  const LabelTable table = parse_label_table(
      "source,time,weight,flow,performer,content,clip,fragment\nexpert,1,2,3,p,c,x.bvh,x\n", "t");
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.rows[0].fragment, "x");
  EXPECT_EQ(table.rows[0].time, 1.0);
  EXPECT_EQ(table.rows[0].flow, 3.0);
  EXPECT_EQ(table.rows[0].alpha, std::nullopt);
}

TEST(LabelTable, WritesTheColumnsOfTheDesignAndComesBackExactly) {
  EXPECT_EQ(format_label_table({}), kHeader);
  LabelTable table = parse_label_table(kGood, "t.csv");
  base::Rng rng(4);
  for (LabelRow& row : table.rows) {
    row.flow = rng.uniform(-3.0, 3.0);
    row.weight = rng.uniform(-1e-300, 1e-300);
    row.time = -0.0;
    row.confidence = rng.uniform();
    row.comment = "a\nb,\"c\" \xC3\xA9 ";
  }
  table.rows[2].alpha = 1.0 / 3.0;
  const LabelTable again = parse_label_table(format_label_table(table), "again");
  ASSERT_EQ(again.rows.size(), 3u);
  for (std::size_t n = 0; n < 3; ++n) {
    EXPECT_EQ(again.rows[n].flow, table.rows[n].flow);
    EXPECT_EQ(again.rows[n].weight, table.rows[n].weight);
    EXPECT_EQ(again.rows[n].confidence, table.rows[n].confidence);
    EXPECT_EQ(again.rows[n].alpha, table.rows[n].alpha);
    EXPECT_EQ(again.rows[n].comment, table.rows[n].comment);
    EXPECT_EQ(again.rows[n].begin_frame, table.rows[n].begin_frame);
    EXPECT_EQ(again.rows[n].source, table.rows[n].source);
  }
  EXPECT_EQ(format_label_table(again), format_label_table(table));
}

TEST(LabelTable, ReportsEveryBadRowAtOnceInOrder) {
  const std::string text = std::string(kHeader) +
                           "a,a.bvh,,,walk,,3.4,x,0,,,expert,,,,,\n"       // 2: two problems
                           "b,b.bvh,9,9,walk,,0,0,0,,,expert,,,,,\n"       // 3
                           "c,c.bvh,,,walk,,0,0,0,,,guessed,2,,,,\n"       // 4: two
                           "d,,,,walk,,0,0,0,,,expert,,,,,\n"              // 5
                           "e,,,,walk,,0,0,0,,,expert,,a,nobody,1.3,\n"    // 6: two
                           "f,,,,walk,,0,0,0,,,expert,,a,a,0.5,\n"         // 7
                           "g,,,,walk,,0,0,0,,,expert,,a,,0.5,\n"          // 8
                           "h,,,,walk,,0,0,0,,,expert,,a,e,0.5,\n"         // 9
                           ",i.bvh,,,walk,,,,,,,,,,,,\n"                   // 10
                           "j,j.bvh,,,walk,,0,0\n"                         // 11
                           "k,k.bvh,-1,5.5,walk,,\"1,5\",0,nan,,,,,,,,\n"  // 12: four
                           "l,l.bvh,3,,walk,,0,0,0,,,expert,,,,,\n"        // 13
                           "j2,,,,walk,,0,0,0,,,expert,,j,b,0.5,\n";       // fine: j has a name
  const std::string expected =
      "t.csv:2: weight = 'x' (must be a number)\n"
      "t.csv:2: flow = 3.4 (must be in [-3, 3])\n"
      "t.csv:3: frames [9, 9) (must be 0 <= begin_frame < end_frame)\n"
      "t.csv:4: source = 'guessed' (must be expert, performer, measured or synthetic)\n"
      "t.csv:4: confidence = 2 (must be in [0, 1])\n"
      "t.csv:5: clip is blank (only a blend, with parents and alpha, has none)\n"
      "t.csv:6: alpha = 1.3 (must be in [-0.25, 1.25])\n"
      "t.csv:6: parent_j = 'nobody' (must be a fragment of this table)\n"
      "t.csv:7: both parents are 'a' (must be two fragments)\n"
      "t.csv:8: a blend needs parent_i, parent_j and alpha (a seed has none of them)\n"
      "t.csv:9: parent_j = 'e' (must be a seed, not a blend)\n"
      "t.csv:10: fragment is blank (every row needs a name)\n"
      "t.csv:11: expected 17 fields, found 8\n"
      "t.csv:12: end_frame = '5.5' (must be a whole number)\n"
      "t.csv:12: flow = '1,5' (must be a number with a decimal point, not a comma)\n"
      "t.csv:12: time = 'nan' (must be a number)\n"
      "t.csv:12: source is blank (must be expert, performer, measured or synthetic)\n"
      "t.csv:13: only one of begin_frame and end_frame is given (must be both or neither)";
  EXPECT_EQ(problem_of(text), expected);
}

TEST(LabelTable, RefusesAHeaderThatWouldLoseValues) {
  EXPECT_THAT(problem_of(""), StartsWith("t.csv: no header line (must be fragment,clip,"));
  const std::string problem = problem_of("fragment,clip,clip,contents,performer,flow,weight\n");
  EXPECT_THAT(problem, HasSubstr("t.csv:1: column 'clip' stands twice\n"));
  EXPECT_THAT(problem, HasSubstr("t.csv:1: unknown column 'contents' (columns are fragment,"));
  EXPECT_THAT(problem, HasSubstr("\nt.csv:1: column 'content' is missing\n"));
  EXPECT_THAT(problem, HasSubstr("\nt.csv:1: column 'time' is missing\n"));
  EXPECT_THAT(problem, EndsWith("\nt.csv:1: column 'source' is missing"));
}

TEST(LabelTable, SeveralObserversMayLabelOneFragmentButOnceEach) {
  const std::string rows = std::string(kHeader) +
                           "a,a.bvh,,,walk,p,1,1,1,,ann,expert,,,,,\n"
                           "a,a.bvh,,,walk,p,2,2,2,,bob,expert,,,,,\n"
                           "a,a.bvh,,,walk,p,2,2,2,,bob,performer,,,,,\n"
                           "a,a.bvh,,,walk,p,0,2,2,,bob,expert,,,,,repeat 1\n";  // older tables
  EXPECT_EQ(problem_of(rows), "");
  EXPECT_EQ(problem_of(rows + "a,a.bvh,,,walk,p,2,2,2,,bob,expert,,,,,\n"
                              "a,a.bvh,,,run,p,2,2,2,,cat,expert,,,,,\n"),
            "t.csv:6: fragment 'a' stands already in line 3 by observer 'bob' (several rows of one "
            "need different observers, or repeat 1, 2, ..)\n"
            "t.csv:7: fragment 'a' has another content than in line 2 (a name stands for one "
            "fragment)");
}

TEST(LabelTable, MeanOverObserversWeighsByConfidence) {
  const LabelTable table = parse_label_table(std::string(kHeader) +
                                                 "a,a.bvh,,,walk,p,1,1,,,ann,expert,0.25,,,,\n"
                                                 "b,b.bvh,,,walk,p,0.1,,,,ann,expert,0,,,,\n"
                                                 "a,a.bvh,,,walk,p,3,,-2,,bob,expert,0.75,,,,\n"
                                                 "a,a.bvh,,,walk,p,,,,,cat,expert,,,,,\n"
                                                 "b,b.bvh,,,walk,p,0.3,,,,bob,expert,0,,,,\n",
                                             "t.csv");
  const LabelTable mean = mean_over_observers(table);
  ASSERT_EQ(mean.rows.size(), 2u);
  EXPECT_EQ(mean.rows[0].fragment, "a");
  EXPECT_NEAR(*mean.rows[0].flow, 0.25 * 1 + 0.75 * 3, 1e-15);
  EXPECT_EQ(mean.rows[0].weight, 1.0);
  EXPECT_EQ(mean.rows[0].time, -2.0);
  EXPECT_EQ(mean.rows[0].space, std::nullopt);
  EXPECT_EQ(mean.rows[0].confidence, 0.5);
  EXPECT_EQ(mean.rows[0].observer, "ann+bob+cat");
  EXPECT_EQ(mean.rows[1].flow, std::nullopt);  // nobody is sure at all
  EXPECT_EQ(mean.rows[1].confidence, 0.0);
  const auto no_confidence = "fragment 'b' (line 3): flow, weight, time blank (confidence 0)";
  EXPECT_THAT(blank_rows(table), ElementsAre(no_confidence));
  EXPECT_THAT(blank_rows(mean), ElementsAre(no_confidence));
  // ann 0.25 for two of three factors, bob 0.75 for two, cat none.
  EXPECT_THAT(mean_weights(table), ElementsAre(DoubleNear(2.0 / 3.0, 1e-15), 0.0));
}

TEST(LabelTable, ARepeatHasItsOwnRowAndCountsAsTheSameRater) {
  const std::string header = std::string(kHeader, std::string(kHeader).size() - 1) + ",repeat\n";
  const std::string rows = header +
                           "a,a.bvh,,,walk,p,1,1,1,,ann,expert,,,,,,0\n"
                           "a,a.bvh,,,walk,p,3,1,,,ann,expert,,,,,,1\n"
                           "a,a.bvh,,,walk,p,0,0,0,,ann,expert,0,,,,,2\n"
                           "a,a.bvh,,,walk,p,0,0,0,,bob,expert,0.5,,,,,\n";
  const LabelTable table = parse_label_table(rows, "t.csv");
  EXPECT_EQ(table.rows[1].repeat, 1);
  EXPECT_EQ(table.rows[3].repeat, 0);
  const std::string text = format_label_table(table);
  EXPECT_EQ(format_label_table(parse_label_table(text, "t.csv")), text);
  EXPECT_THAT(text, HasSubstr(",comment,repeat\n"));

  const LabelTable judgements = mean_over_repeats(table);
  ASSERT_EQ(judgements.rows.size(), 2u);
  EXPECT_EQ(judgements.rows[0].flow, 2.0);
  EXPECT_EQ(judgements.rows[0].time, 1.0);
  EXPECT_EQ(judgements.rows[0].confidence, std::nullopt);
  EXPECT_EQ(judgements.rows[0].repeat, 0);
  EXPECT_EQ(judgements.rows[1].confidence, 0.5);
  // Ann's three rows weigh as one rater: (1 * 2 + 0.5 * 0) / 1.5.
  EXPECT_NEAR(*mean_over_observers(table).rows[0].flow, 2.0 / 1.5, 1e-15);
  EXPECT_THAT(mean_weights(table), ElementsAre(1.5));

  EXPECT_THAT(problem_of(rows + "a,a.bvh,,,walk,p,0,0,0,,ann,expert,,,,,,1\n"),
              HasSubstr("t.csv:6: fragment 'a' stands already in line 3 by observer 'ann'"));
  EXPECT_THAT(problem_of(rows + "b,b.bvh,,,walk,p,0,0,0,,ann,expert,,,,,,-1\n"),
              HasSubstr("t.csv:6: repeat = -1 (must be >= 0)"));
}

TEST(LabelTable, OneObserverCanBeTakenOut) {
  const LabelTable table = parse_label_table(std::string(kHeader) +
                                                 "a,a.bvh,,,walk,p,1,1,1,,ann,expert,,,,,\n"
                                                 "a,a.bvh,,,walk,p,2,2,2,,bob,expert,,,,,\n"
                                                 "b,b.bvh,,,walk,p,2,2,2,,bob,expert,0.5,,,,\n"
                                                 "c,c.bvh,,,walk,p,,,,,cat,expert,,,,,\n",
                                             "t.csv");
  EXPECT_THAT(observers(table), ElementsAre("ann", "bob"));
  const LabelTable ann = only_observer(table, "ann");
  ASSERT_EQ(ann.rows.size(), 3u);
  EXPECT_EQ(ann.rows[0].flow, 1.0);
  EXPECT_EQ(ann.rows[1].fragment, "b");
  EXPECT_EQ(ann.rows[1].flow, std::nullopt);
  EXPECT_EQ(ann.rows[1].confidence, std::nullopt);
  EXPECT_THAT(blank_rows(ann), ElementsAre("fragment 'b' (line 4): flow, weight, time blank",
                                           "fragment 'c' (line 5): flow, weight, time blank"));
  EXPECT_EQ(only_observer(table, "bob").rows[1].confidence, 0.5);
  try {
    (void)only_observer(table, "cat");
    ADD_FAILURE();
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), base::ErrorKind::kUsage);
    EXPECT_STREQ(error.what(), "no row has labels by observer 'cat' (observers are 'ann', 'bob')");
  }
}

TEST(LabelTable, NamesTheRowsARaterHasYetToFill) {
  const LabelTable table =
      parse_label_table(std::string(kHeader) +
                            "a,a.bvh,,,walk,,,,,,,,,,,,\nb,b.bvh,,,walk,,1,,1,,,expert,,,,,\n"
                            "ab,ab.bvh,,,walk,,1,1,1,,,expert,,a,b,0.5,\n",
                        "t.csv");
  EXPECT_THAT(blank_rows(table), ElementsAre("fragment 'a' (line 2): flow, weight, time blank",
                                             "fragment 'b' (line 3): weight blank"));
}

TEST(LabelTable, ProblemsOfATableInMemoryCountRowsFromOne) {
  LabelTable table;
  table.rows.resize(2);
  table.rows[0].fragment = "a";
  table.rows[0].clip = "a.bvh";
  table.rows[1].fragment = "b";
  table.rows[1].clip = "b.bvh";
  table.rows[1].weight = -4.0;
  EXPECT_THAT(problems(table, "corpus"),
              ElementsAre("corpus: row 2: weight = -4 (must be in [-3, 3])"));
}

TEST(LabelTable, MessagesStayShortAndOnOneLineWhateverTheText) {
  std::string text = kHeader;
  for (int n = 0; n < 300; ++n) {
    text +=
        std::to_string(n) + ",x.bvh,,,,,\"a\nb" + std::string(500, 'z') + "\",,,,,expert,,,,,\n";
  }
  const std::string problem = problem_of(text);
  EXPECT_EQ(std::count(problem.begin(), problem.end(), '\n'), 100);
  EXPECT_THAT(problem, EndsWith("\n.. and 200 more"));
  EXPECT_LT(problem.size(), 101 * 120u);
  EXPECT_THAT(problem, StartsWith("t.csv:2: flow = 'a?bzzz"));
}

// Texts broken at random places are read or refused as Error{kFormat}, nothing else.
TEST(LabelTable, AnyTextIsReadOrRefused) {
  std::mt19937_64 rng(8);
  const std::string odd = ",\"\n\r-+.e09 \xFF\xEF" + std::string(1, '\0');
  int refused = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    std::string text = kGood;
    for (int edit = 0; edit < 3; ++edit) {
      const std::size_t at = rng() % text.size();
      if (rng() % 3 == 0) {
        text.resize(at + 1);
      } else {
        text[at] = odd[rng() % odd.size()];
      }
    }
    refused += problem_of(text).empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 1000);
}

// The schema names the same columns as the table; editors and other programs rely on it.
TEST(LabelTable, SchemaHasEveryColumn) {
  std::ifstream file(std::string(LABAN_SOURCE_DIR) + "/labels/labels.schema.json");
  std::stringstream schema;
  schema << file.rdbuf();
  std::stringstream header(std::string(kHeader, std::string(kHeader).size() - 1));
  for (std::string column; std::getline(header, column, ',');) {
    EXPECT_THAT(schema.str(), HasSubstr("\"" + column + "\": {")) << column;
  }
}

}  // namespace
}  // namespace laban::effort
