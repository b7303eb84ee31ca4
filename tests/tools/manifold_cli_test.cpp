#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "program.h"

namespace laban::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kWalk = LABAN_SOURCE_DIR "/data/phrase/phrase_walk_p01.bvh";
const std::string kTake = LABAN_SOURCE_DIR "/data/take.bvh";

class ManifoldCli : public ::testing::Test {
 protected:
  ManifoldCli() : folder_(fresh_folder()) {}
  [[nodiscard]] Outcome run(const std::string& arguments) const {
    return run_laban(arguments, folder_);
  }
  void learn() const {
    ASSERT_EQ(run("manifold learn " + kWalk + " -o walk.manifold --epochs 10").code, 0);
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

TEST_F(ManifoldCli, LearnsDrawsAndPlaysAllThreeWays) {
  const Outcome learnt =
      run("manifold learn " + kWalk + " -o walk.manifold --picture som.png --epochs 10");
  ASSERT_EQ(learnt.code, 0) << learnt.err;
  EXPECT_THAT(bytes_of(folder_ / "som.png"), StartsWith("\x89PNG"));
  const std::string play = "manifold synthesize walk.manifold ";
  ASSERT_EQ(run(play + "--through 10,12 40,31 20,55 --frames 80 -o out.bvh").code, 0);
  ASSERT_EQ(run(play + "--keys " + kWalk + ":0 " + kWalk + ":30 " + kWalk + ":60 -o keys.glb").code,
            0);
  const Outcome walked =
      run(play + "--start " + kWalk +
          ":0 --seconds 5 --perturb 0.1 --seed 3 -o walk.bvh --picture walk.svg");
  ASSERT_EQ(walked.code, 0) << walked.err;
  EXPECT_THAT(walked.out, HasSubstr("primitives:"));
  const json out = json::parse(run("inspect out.bvh --json").out);
  EXPECT_EQ(out["frames"], 80);
  const json walk = json::parse(run("inspect walk.bvh --json").out);
  EXPECT_EQ(walk["frames"], 301);
  EXPECT_EQ(walk["joints"], json::parse(run("inspect " + kWalk + " --json").out)["joints"]);
  const json map = json::parse(run("inspect walk.manifold --json").out);
  EXPECT_EQ(map["kind"], "manifold");
  EXPECT_EQ(map["columns"], 65);
  EXPECT_EQ(map["record"]["inputs"].size(), 1U);
}

TEST_F(ManifoldCli, GivesTheSameBytesAgain) {
  std::vector<std::string> seen;
  for (const char* threads : {"1", "2"}) {
    const std::string learn = "manifold learn " + kWalk + " -o walk.manifold --epochs 5 --force ";
    ASSERT_EQ(run(learn + "--threads " + threads).code, 0);
    ASSERT_EQ(run("manifold synthesize walk.manifold --start " + kWalk +
                  ":5 --seconds 3 --perturb 0.3 --seed 3 -o walk.bvh --force")
                  .code,
              0);
    seen.push_back(bytes_of(folder_ / "walk.manifold") + bytes_of(folder_ / "walk.bvh"));
  }
  EXPECT_EQ(seen[0], seen[1]);
}

TEST_F(ManifoldCli, SaysWhatIsWrongInOneLine) {
  learn();
  const std::string play = "manifold synthesize walk.manifold -o out.bvh ";
  expect_error(play, 2, "either --through, --keys or --start");
  expect_error(play + "--through 1,2 --start " + kWalk + ":0", 2, "either --through");
  expect_error(play + "--through 1,2 65,3", 2, "--through 65,3: a point is COLUMN,ROW");
  expect_error(play + "--through 12", 2, "a point is COLUMN,ROW");
  expect_error(play + "--through 1,nan", 2, "a point is COLUMN,ROW");
  expect_error(play + "--keys " + kWalk, 2, "a pose is CLIP:FRAME");
  expect_error(play + "--keys " + kWalk + ":9999", 2, "the clip has frames 0 to");
  expect_error(play + "--keys absent.bvh:3", 3, "absent.bvh");
  expect_error(play + "--seconds 0", 2, "--seconds: 0 (must be a number above 0);");
  expect_error(play + "--seconds nan", 2, "--seconds: nan (must be a number above 0);");
  expect_error(play + "--perturb -1", 2, "--perturb: -1 (must be 0 or a number above it);");
  expect_error(play + "--start " + kWalk + ":0 --frames 10", 2, "a walk takes --seconds");
  expect_error("manifold synthesize " + kWalk + " --through 1,2 -o out.bvh", 4, "phrase_walk_p01");
  expect_error("manifold learn " + kWalk + " -o walk.manifold", 3, "walk.manifold");
  expect_error("manifold", 2, "subcommand");
  EXPECT_THAT(files_in(folder_), ElementsAre("walk.manifold"));
}

TEST_F(ManifoldCli, HelpTellsOfEachPart) {
  const Outcome whole = run("help manifold");
  EXPECT_THAT(whole.out, HasSubstr("--through"));
  EXPECT_THAT(whole.out, HasSubstr("--last-radius"));
  const Outcome part = run("manifold synthesize --help");
  EXPECT_EQ(part.code, 0);
  EXPECT_THAT(part.out, StartsWith("Example:\n  laban manifold synthesize"));
  EXPECT_THAT(part.out, HasSubstr("Usage: laban manifold synthesize"));
}

}  // namespace
}  // namespace laban::test
