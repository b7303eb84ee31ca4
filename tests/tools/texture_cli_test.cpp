#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "laban/effort/label_table.h"

#include "program.h"

namespace laban::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kPhrase = LABAN_SOURCE_DIR "/data/phrase/";
const std::string kWalks = kPhrase + "phrase_walk_p01.bvh " + kPhrase + "phrase_walk_p02.bvh " +
                           kPhrase + "phrase_walk_p03.bvh " + kPhrase + "phrase_walk_p04.bvh ";

class TextureCli : public ::testing::Test {
 protected:
  TextureCli() : folder_(fresh_folder()) {}
  [[nodiscard]] Outcome run(const std::string& arguments) const {
    return run_laban(arguments, folder_);
  }
  void learn() const {
    ASSERT_EQ(
        run("texture learn " + kWalks + "-o walk.texture --min-frames 30 --threshold 0.3").code, 0);
  }
  void expect_error(const std::string& arguments, int code, const std::string& part) const {
    SCOPED_TRACE(arguments);
    const Outcome result = run(arguments);
    EXPECT_EQ(result.code, code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(part));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  fs::path folder_;
};

TEST_F(TextureCli, LearnsDrawsAndTells) {
  const Outcome learnt = run("texture learn " + kWalks +
                             "-o walk.texture --min-frames 30 --rate 30 --threshold auto "
                             "--picture learnt.png --json");
  ASSERT_EQ(learnt.code, 0) << learnt.err;
  EXPECT_THAT(bytes_of(folder_ / "learnt.png"), StartsWith("\x89PNG"));
  const json report = json::parse(learnt.out);
  EXPECT_EQ(report["frame_rate_hz"], 30.0);
  EXPECT_EQ(report["takes"], 4);
  EXPECT_GE(report["learning"]["starts"].size(), 5U);
  const Outcome told = run("texture inspect walk.texture --picture transitions.svg");
  EXPECT_EQ(told.code, 0);
  EXPECT_THAT(told.out, HasSubstr("frames at 30 Hz of 4 takes"));
  EXPECT_THAT(bytes_of(folder_ / "transitions.svg"), HasSubstr("<svg"));
  const json inspected = json::parse(run("inspect walk.texture --json").out);
  EXPECT_EQ(inspected["kind"], "texture");
  EXPECT_EQ(inspected["textons"], report["textons"]);
  EXPECT_EQ(inspected["record"]["inputs"].size(), 4U);
}

TEST_F(TextureCli, GoesOnFromACheckpointToTheSameBytes) {
  const std::string learn = "texture learn " + kWalks + "--min-frames 30 --textons 3 ";
  ASSERT_EQ(run(learn + "-o whole.texture --checkpoint state.texture").code, 0);
  const Outcome again = run(learn + "-o again.texture --checkpoint state.texture -v");
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("going on after round"));
  EXPECT_EQ(bytes_of(folder_ / "again.texture"), bytes_of(folder_ / "whole.texture"));
  expect_error("texture learn " + kWalks +
                   "--min-frames 31 --textons 3 -o x.texture --checkpoint state.texture",
               5, "other captures, options or version");
}

TEST_F(TextureCli, FragmentsBecomeACorpusAndAModel) {
  learn();
  const Outcome cut = run("texture fragments walk.texture --labels fragments.csv --json");
  ASSERT_EQ(cut.code, 0) << cut.err;
  const auto table =
      effort::parse_label_table(bytes_of(folder_ / "fragments.csv"), "fragments.csv");
  EXPECT_EQ(table.rows.size(), json::parse(cut.out)["fragments"].get<std::size_t>());
  // Fragments of a take follow each other in its own frames.
  for (std::size_t n = 1; n < table.rows.size(); ++n) {
    if (table.rows[n].clip == table.rows[n - 1].clip)
      EXPECT_EQ(table.rows[n].begin_frame, table.rows[n - 1].end_frame);
  }
  const Outcome corpus =
      run("corpus --fragments fragments.csv --blends 20 --label measured -o corpus.csv --json");
  ASSERT_EQ(corpus.code, 0) << corpus.err;
  EXPECT_EQ(json::parse(corpus.out)["fragments"], table.rows.size());
  EXPECT_EQ(json::parse(corpus.out)["blends"], 20);
  const Outcome trained = run("train --labels corpus.csv -o walk.laban");
  EXPECT_EQ(trained.code, 0) << trained.err;
}

TEST_F(TextureCli, SaysWhatIsWrong) {
  expect_error("texture learn " + kWalks + "-o x.texture --threshold soon", 2, "number >= 0");
  expect_error("texture learn " + kWalks + "-o x.texture --threshold 0.1 --textons 4", 2,
               "exclude each other");
  expect_error("texture inspect " + kPhrase + "phrase_walk_p01.bvh", 4, "phrase_walk_p01.bvh: ");
  expect_error("corpus --blends 3 -o x.csv", 2, "either a folder of --clips or a table");
  learn();
  expect_error("texture fragments walk.texture --labels x.csv --least 1000", 5,
               "no texton has 1000 segments");
}

}  // namespace
}  // namespace laban::test
