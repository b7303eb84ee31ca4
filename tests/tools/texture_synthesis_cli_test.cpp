#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "program.h"

namespace laban::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kTake = LABAN_SOURCE_DIR "/data/take.bvh";
const std::string kWalk = LABAN_SOURCE_DIR "/data/phrase/phrase_walk_p01.bvh";

class TextureSynthesisCli : public ::testing::Test {
 protected:
  TextureSynthesisCli() : folder_(fresh_folder()) {}
  void SetUp() override {
    const Outcome learnt = run("texture learn " + kTake + " " + kWalk +
                               " -o dance.texture --min-frames 40 --threshold 0.05");
    ASSERT_EQ(learnt.code, 0) << learnt.err;
  }
  [[nodiscard]] Outcome run(const std::string& arguments) const {
    return run_laban(arguments, folder_);
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

TEST_F(TextureSynthesisCli, DancesOnAndTheSameForTheSameSeed) {
  const std::string synthesize = "texture synthesize dance.texture --seconds 12 --json ";
  const Outcome made = run(synthesize + "--seed 3 -o a.bvh --picture a.png --report a.json");
  ASSERT_EQ(made.code, 0) << made.err;
  const json report = json::parse(made.out);
  EXPECT_EQ(report["frames"], 720);
  EXPECT_GT(report["textons"].size(), 2U);
  EXPECT_EQ(json::parse(bytes_of(folder_ / "a.json")), report);
  EXPECT_THAT(bytes_of(folder_ / "a.png"), StartsWith("\x89PNG"));
  ASSERT_EQ(run(synthesize + "--seed 3 -o b.bvh").code, 0);
  EXPECT_EQ(bytes_of(folder_ / "a.bvh"), bytes_of(folder_ / "b.bvh"));
  ASSERT_EQ(run(synthesize + "--seed 4 -o c.bvh").code, 0);
  EXPECT_NE(bytes_of(folder_ / "a.bvh"), bytes_of(folder_ / "c.bvh"));
}

TEST_F(TextureSynthesisCli, StreamsTheSameRowsAndGoesThroughAPipe) {
  const Outcome whole = run("texture synthesize dance.texture --seconds 12 -o - --format bvh");
  ASSERT_EQ(whole.code, 0) << whole.err;
  const Outcome streamed = run("texture synthesize dance.texture --seconds 12 -o - --stream");
  ASSERT_EQ(streamed.code, 0) << streamed.err;
  const auto rows = [](const std::string& bvh) { return bvh.substr(bvh.find("Frame Time")); };
  EXPECT_EQ(rows(streamed.out), rows(whole.out));
}

TEST_F(TextureSynthesisCli, GoesFromOnePoseToAnotherInTheTimeAsked) {
  const Outcome made = run("texture synthesize dance.texture --from " + kTake + ":0 --to " + kTake +
                           ":700 --frames 320 --no-foot-fix -o way.bvh --json");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(json::parse(made.out)["frames"], 320);
  expect_error("texture synthesize dance.texture --from " + kTake + ":0 --frames 320 -o x.bvh", 2,
               "--from and --to go together");
  expect_error("texture synthesize dance.texture --from " + kTake + ":5000 --to " + kTake +
                   ":7 --frames 320 -o x.bvh",
               2, "the clip has frames 0 to 740");
  expect_error("texture synthesize dance.texture --from " + kTake + " --to " + kTake +
                   ":7 --frames 320 -o x.bvh",
               2, "a pose is CLIP:FRAME");
}

TEST_F(TextureSynthesisCli, FindsPathsAndPlaysThem) {
  const Outcome found = run("texture path dance.texture 0 2 --json");
  ASSERT_EQ(found.code, 0) << found.err;
  const json path = json::parse(found.out)["path"];
  EXPECT_EQ(path.front(), 0);
  EXPECT_EQ(path.back(), 2);
  const Outcome text = run("texture path dance.texture 0 2");
  const Outcome played = run("texture synthesize dance.texture -o path.bvh --json --path " +
                             text.out.substr(0, text.out.size() - 1));
  ASSERT_EQ(played.code, 0) << played.err;
  const json parts = json::parse(played.out)["textons"];
  ASSERT_EQ(parts.size(), path.size());
  for (std::size_t n = 0; n < path.size(); ++n) EXPECT_EQ(parts[n]["texton"], path[n]);
  expect_error("texture path dance.texture 0 999", 2, "there is no texton 999");
  expect_error("texture path dance.texture 0 2 --avoid 2", 2, "both passed and avoided");
  expect_error("texture path dance.texture 0 0 --length 1 --via 1", 5, "no path from texton 0");
  expect_error("texture path dance.texture 0 2 --length 1", 5, "leave --length out");
}

TEST_F(TextureSynthesisCli, EditsAndStretchesATexton) {
  // A texton's own frame changes nothing of it: take.bvh begins with texton 0.
  const Outcome pinned = run("texture edit dance.texture --texton 0 --pin 20:" + kTake +
                             ":20 --no-foot-fix -o same.bvh --json --picture same.svg");
  ASSERT_EQ(pinned.code, 0) << pinned.err;
  const json same = json::parse(pinned.out);
  EXPECT_LT(same["state_deviations"], 1e-3);
  EXPECT_EQ(same["frames"], same["captured_frames"]);
  EXPECT_THAT(bytes_of(folder_ / "same.svg"), HasSubstr("<svg"));
  const Outcome far =
      run("texture edit dance.texture --texton 0 --pin 20:" + kTake + ":400 -o far.bvh");
  EXPECT_EQ(far.code, 0) << far.err;
  EXPECT_THAT(far.err, HasSubstr("beyond 3 it is spoilt"));
  const Outcome longer =
      run("texture edit dance.texture --texton 0 --stretch 1.5 -o longer.bvh --json");
  ASSERT_EQ(longer.code, 0) << longer.err;
  const json stretched = json::parse(longer.out);
  EXPECT_NEAR(stretched["frames"].get<double>(), 1.5 * stretched["captured_frames"].get<double>(),
              0.51);
  expect_error("texture edit dance.texture --texton 0 -o x.bvh", 2, "say what to edit");
  expect_error("texture edit dance.texture --texton 0 --pin 9999:" + kTake + ":0 -o x.bvh", 2,
               "the texton has frames 0 to");
  expect_error("texture edit dance.texture --texton 999 --stretch 2 -o x.bvh", 2,
               "there is no texton 999");
}

TEST_F(TextureSynthesisCli, SaysWhatDoesNotGoTogether) {
  const std::string synthesize = "texture synthesize dance.texture ";
  expect_error(synthesize + "-o x.bvh", 2, "say how long");
  expect_error(synthesize + "--stream -o x.bvh", 2, "--stream writes to stdout");
  expect_error(synthesize + "--path 0 --seconds 3 -o x.bvh", 2, "--path says what is danced");
  expect_error(synthesize + "--first 999 --seconds 3 -o x.bvh", 2, "there is no texton 999");
  expect_error("texture synthesize " + kTake + " --seconds 3 -o x.bvh", 4, kTake);
}

}  // namespace
}  // namespace laban::test
