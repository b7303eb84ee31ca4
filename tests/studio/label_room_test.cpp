#include "label_room.h"

#include <algorithm>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/atomic_file.h"

#include "../tools/program.h"

namespace laban::studio {
namespace {

namespace fs = std::filesystem;

/// Eight clips of two contents and three blends, blank.
fs::path blank_sheet() {
  const fs::path folder = test::fresh_folder();
  for (const std::string content : {"walk", "bow"}) {
    for (const std::string performer : {"p01", "p02", "p03", "p04"}) {
      const std::string name = "phrase_" + content + "_" + performer + ".bvh";
      fs::copy_file(fs::path(LABAN_SOURCE_DIR) / "data/phrase" / name, folder / name);
    }
  }
  const auto made = test::run_laban(
      "corpus --clips . --pattern 'phrase_{content}_{performer}' --blends 3 --label none -o "
      "sheet.csv",
      folder);
  EXPECT_EQ(made.code, 0) << made.err;
  return folder / "sheet.csv";
}

LabellingOptions options(const fs::path& sheet, const std::string& observer = "ann") {
  LabellingOptions options;
  options.table = sheet.string();
  options.observer = observer;
  options.seed = 7;
  options.repeats = 0.2;
  return options;
}

effort::LabelTable table_of(const fs::path& sheet) {
  return effort::parse_label_table(base::read_file(sheet), "sheet.csv");
}

Json rating(const Json& place, const Json& flow) {
  return {{"place", place},     {"factors", {{"flow", flow}, {"weight", -0.5}, {"time", 2}}},
          {"confidence", 0.75}, {"comment", "a \"comment\", with a comma\nand a line"},
          {"replays", 3},       {"seconds", 4.5}};
}

std::vector<std::string> names(int count) {
  std::vector<std::string> all;
  for (int n = 0; n < count; ++n) all.push_back("f" + std::to_string(n));
  return all;
}

TEST(RatingOrder, ShowsEachOnceAndSomeAgainLaterUnannounced) {
  const auto order = rating_order(names(40), 3, 0.25);
  ASSERT_EQ(order.size(), 50U);
  std::map<std::string, std::vector<std::size_t>> places;
  for (std::size_t n = 0; n < order.size(); ++n) {
    EXPECT_EQ(order[n].repeat, static_cast<int>(places[order[n].fragment].size()));
    places[order[n].fragment].push_back(n);
  }
  EXPECT_EQ(places.size(), 40U);
  for (const auto& [name, at] : places)
    if (at.size() == 2) EXPECT_GT(at[1] - at[0], 5U) << name;
  EXPECT_EQ(rating_order(names(40), 3, 0.25), order);
  EXPECT_NE(rating_order(names(40), 4, 0.25), order);
  EXPECT_EQ(rating_order(names(40), 3, 0.0).size(), 40U);
  EXPECT_EQ(rating_order(names(1), 3, 1.0).size(), 1U);
}

TEST(LabelRoom, PutsEveryAnswerIntoTheTableBeforeTheNext) {
  const fs::path sheet = blank_sheet();
  LabelRoom room(options(sheet), {});
  Json next = room.next();
  const int all = next["all"];
  EXPECT_EQ(all, 11 + 2);
  int answers = 0;
  while (!next["place"].is_null()) {
    next = room.answer(rating(next["place"], answers % 2 == 0 ? Json(1.5) : Json()));
    ++answers;
    EXPECT_EQ(next["done"], answers);
    const auto rows = table_of(sheet).rows;
    EXPECT_EQ(std::count_if(rows.begin(), rows.end(),
                            [](const auto& row) { return row.observer == "ann"; }),
              answers);
  }
  EXPECT_EQ(answers, all);
  const effort::LabelTable table = table_of(sheet);
  EXPECT_EQ(table.rows.size(), 13U);  // the blank rows were filled, the repeats added
  for (const effort::LabelRow& row : table.rows) {
    EXPECT_EQ(row.weight, -0.5);
    EXPECT_EQ(row.confidence, 0.75);
    EXPECT_EQ(row.comment, "a \"comment\", with a comma and a line");
  }
  const std::string log = test::bytes_of(sheet.string() + ".log");
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), all);
  EXPECT_THAT(log, ::testing::HasSubstr("\"seed\":7"));
  EXPECT_THAT(log, ::testing::HasSubstr("\"replays\":3"));
}

TEST(LabelRoom, GoesOnWhereItStoppedAndGivesAnotherRaterRowsOfTheirOwn) {
  const fs::path sheet = blank_sheet();
  Json next;
  {
    LabelRoom room(options(sheet), {});
    for (int n = 0; n < 4; ++n) next = room.answer(rating(room.next()["place"], 1));
  }
  LabelRoom again(options(sheet), {});
  EXPECT_EQ(again.next(), next);
  LabelRoom other(options(sheet, "bob"), {});
  EXPECT_EQ(other.next()["done"], 0);
  for (int n = 0; n < 4; ++n) (void)other.answer(rating(other.next()["place"], -1));
  const effort::LabelTable table = table_of(sheet);
  EXPECT_THAT(effort::observers(table), ::testing::UnorderedElementsAre("ann", "bob"));
  EXPECT_EQ(again.next(), next);
  const Json agreement = again.agreement();
  EXPECT_EQ(agreement["raters"].size(), 2U);
  EXPECT_EQ(agreement["factors"].size(), 3U);
}

TEST(LabelRoom, TwoStudiosOnOneTableLoseNothing) {
  const fs::path sheet = blank_sheet();
  std::vector<std::unique_ptr<LabelRoom>> rooms;
  for (const std::string observer : {"ann", "bob"})
    rooms.push_back(std::make_unique<LabelRoom>(options(sheet, observer), cli::Common{}));
  std::vector<std::future<int>> raters;
  for (const auto& room : rooms) {
    raters.push_back(std::async(std::launch::async, [&room] {
      int answers = 0;
      for (Json next = room->next(); !next["place"].is_null(); ++answers)
        next = room->answer(rating(next["place"], 1));
      return answers;
    }));
  }
  // An answer that is lost would be asked for again.
  for (auto& rater : raters) EXPECT_EQ(rater.get(), rooms.front()->next()["all"]);
}

/// Answers what is asked, each motion otherwise.
void answer_all(LabelRoom& room, int most = 1000) {
  Json next = room.next();
  for (int n = 0; n < most && !next["place"].is_null(); ++n) {
    const std::string motion = room.motion(next["place"], false).body;
    const double half = 0.5 * static_cast<double>(std::hash<std::string>{}(motion) % 13) - 3.0;
    next = room.answer(
        {{"place", next["place"]}, {"factors", {{"flow", half}, {"weight", -half}, {"time", 1}}}});
  }
}

/// Fragments in the order in which they were answered first.
std::vector<std::string> answered_order(const fs::path& sheet) {
  std::vector<std::string> names;
  std::istringstream log(test::bytes_of(sheet.string() + ".log"));
  for (std::string line; std::getline(log, line);) {
    const Json told = Json::parse(line);
    if (told["repeat"] == 0) names.push_back(told["fragment"]);
  }
  return names;
}

TEST(LabelRoom, AsksForBlendsAsSuggestOrdersThem) {
  const fs::path sheet = blank_sheet();
  LabellingOptions asked = options(sheet);
  asked.suggested = true;
  {
    LabelRoom room(asked, {});
    EXPECT_EQ(room.next()["all"], 8 + 2 + 3);
    answer_all(room, 10);  // the fragments, two of them twice
  }
  const auto told =
      test::run_laban("suggest --labels sheet.csv --count 3 --json", sheet.parent_path());
  ASSERT_EQ(told.code, 0) << told.err;
  std::vector<std::string> wanted;
  const Json suggested = Json::parse(told.out);
  for (const Json& one : suggested["suggestions"]) wanted.push_back(one["fragment"]);
  ASSERT_EQ(wanted.size(), 3U);
  {
    LabelRoom room(asked, {});
    answer_all(room, 1);
  }
  LabelRoom room(asked, {});  // goes on behind the first blend
  answer_all(room);
  EXPECT_EQ(room.next()["done"], 13);
  const std::vector<std::string> order = answered_order(sheet);
  ASSERT_EQ(order.size(), 11U);
  EXPECT_EQ(std::vector(order.end() - 3, order.end()), wanted);
}

TEST(LabelRoom, AsksForSpaceOnRequest) {
  const fs::path sheet = blank_sheet();
  LabellingOptions asked = options(sheet);
  EXPECT_EQ(LabelRoom(asked, {}).next()["factors"].size(), 3U);
  asked.space = true;
  LabelRoom room(asked, {});
  Json next = room.next();
  EXPECT_EQ(next["factors"].back(), "space");
  (void)room.answer({{"place", next["place"]}, {"factors", {{"space", -2.5}}}});
  const auto rows = table_of(sheet).rows;
  const auto row =
      std::find_if(rows.begin(), rows.end(), [](const auto& one) { return one.observer == "ann"; });
  EXPECT_EQ(row->space, -2.5);
  EXPECT_EQ(row->confidence, std::nullopt);
}

TEST(LabelRoom, NothingObservedIsAnAnswerThatCountsNowhere) {
  const fs::path sheet = blank_sheet();
  LabelRoom room(options(sheet), {});
  const Json place = room.next()["place"];
  const Json next = room.answer({{"place", place}, {"factors", Json::object()}});
  EXPECT_EQ(next["done"], 1);
  const auto rows = table_of(sheet).rows;
  const auto row =
      std::find_if(rows.begin(), rows.end(), [](const auto& one) { return one.observer == "ann"; });
  EXPECT_EQ(row->confidence, 0.0);
  EXPECT_FALSE(row->flow);
}

TEST(LabelRoom, RefusesWhatIsNoRatingAndWritesNothing) {
  const fs::path sheet = blank_sheet();
  LabelRoom room(options(sheet), {});
  const std::string before = base::read_file(sheet);
  const Json place = room.next()["place"];
  for (const Json& flow : {Json(0.25), Json(3.5), Json("1"), Json(true)})
    EXPECT_THROW((void)room.answer(rating(place, flow)), HttpError) << flow;
  EXPECT_THROW((void)room.answer(rating(-1, 1)), HttpError);
  EXPECT_THROW((void)room.answer(rating(99, 1)), HttpError);
  EXPECT_THROW((void)room.answer(rating("0", 1)), HttpError);
  Json unsure = rating(place, 1);
  unsure["confidence"] = 2;
  EXPECT_THROW((void)room.answer(unsure), HttpError);
  EXPECT_EQ(base::read_file(sheet), before);
  (void)room.answer(rating(place, 1));
  EXPECT_THROW((void)room.answer(rating(place, 1)), HttpError);  // a second time
}

TEST(LabelRoom, AnAnswerIsMendedInItsRowAndTheLogKeepsTheOldOne) {
  const fs::path sheet = blank_sheet();
  LabelRoom room(options(sheet), {});
  const Json place = room.next()["place"];
  EXPECT_THROW((void)room.answered_at(place), HttpError);
  const Json next = room.answer(rating(place, 1));
  EXPECT_EQ(room.answered_at(place)["factors"]["flow"], 1.0);
  EXPECT_EQ(room.answered_at(place)["confidence"], 0.75);
  const effort::LabelTable before = table_of(sheet);

  Json mended = rating(place, -2.5);
  mended["mend"] = true;
  mended["factors"]["time"] = nullptr;
  mended["comment"] = "";
  EXPECT_EQ(room.answer(mended), next);
  const effort::LabelTable after = table_of(sheet);
  ASSERT_EQ(after.rows.size(), before.rows.size());
  for (std::size_t n = 0; n < after.rows.size(); ++n) {
    EXPECT_EQ(after.rows[n].fragment, before.rows[n].fragment);
    if (after.rows[n].observer != "ann") continue;
    EXPECT_EQ(after.rows[n].flow, -2.5);
    EXPECT_EQ(after.rows[n].time, std::nullopt);
    EXPECT_EQ(after.rows[n].comment, "");
  }
  std::istringstream log(test::bytes_of(sheet.string() + ".log"));
  std::string line;
  for (int n = 0; n < 2; ++n) std::getline(log, line);
  EXPECT_EQ(Json::parse(line)["before"]["factors"]["flow"], 1.0);
  EXPECT_EQ(Json::parse(line)["before"]["factors"]["time"], 2.0);

  Json none = rating(next["place"], 1);
  none["mend"] = true;
  EXPECT_THROW((void)room.answer(none), HttpError);
  mended["factors"]["flow"] = 0.25;
  EXPECT_THROW((void)room.answer(mended), HttpError);
  EXPECT_EQ(table_of(sheet).rows.size(), before.rows.size());
}

TEST(LabelRoom, ShowsMotionsWithoutNamesOnOneBody) {
  LabelRoom room(options(blank_sheet()), {});
  const int all = room.next()["all"];
  std::set<std::string> neutrals;
  for (int place = 0; place < all; ++place) {
    const std::string variant = room.motion(place, false).body;
    EXPECT_THAT(variant.substr(0, 6000), ::testing::Not(::testing::HasSubstr("phrase")));
    EXPECT_THAT(variant.substr(0, 6000), ::testing::HasSubstr("\"leg_length_m\":0.84"));
    const std::string neutral = room.motion(place, true).body;
    EXPECT_NE(neutral, variant);
    neutrals.insert(neutral);
  }
  EXPECT_EQ(neutrals.size(), 4U);  // one a content, and another beside that one itself
  EXPECT_THROW((void)room.motion(all, false), HttpError);
}

}  // namespace
}  // namespace laban::studio
