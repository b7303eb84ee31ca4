#include <fstream>
#include <regex>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "laban/effort/label_table.h"

#include "program.h"

namespace laban::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

const std::string kData = LABAN_SOURCE_DIR "/data/";
const std::string kTake = kData + "take.bvh";
const std::string kWalk = kData + "phrase/phrase_walk_p01.bvh";
const std::string kOtherWalk = kData + "phrase/phrase_walk_p02.bvh";
const std::string kBow = kData + "phrase/phrase_bow_p01.bvh";
const std::string kLabels = LABAN_SOURCE_DIR "/labels/phrase.csv";
const std::vector<std::string> kVerbs = {
    "agree",   "apply",   "train",   "evaluate", "corpus",  "match", "segment",  "blend",  "curve",
    "measure", "inspect", "convert", "draw",     "suggest", "loop",  "manifold", "texture"};

void write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

class Cli : public ::testing::Test {
 protected:
  Cli() : folder_(fresh_folder()) {}
  [[nodiscard]] Outcome run(const std::string& arguments) const {
    return run_laban(arguments, folder_);
  }
  /// Expects one line on stderr, that exit code, nothing on stdout and no file left.
  void expect_error(const std::string& arguments, int code, const std::string& part) const {
    SCOPED_TRACE(arguments);
    const auto before = files_in(folder_);
    const Outcome result = run(arguments);
    EXPECT_EQ(result.code, code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(part));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_THAT(result.out, IsEmpty());
    EXPECT_EQ(files_in(folder_), before);
  }
  fs::path folder_;
};

TEST_F(Cli, HelpStartsWithTheExamplesAndListsEveryVerb) {
  const Outcome help = run("--help");
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(
      help.out,
      StartsWith("  laban apply walk.bvh --flow -2 --weight 1.5 --time 2 -o walk_sudden.glb\n"));
  for (const std::string& verb : kVerbs) {
    EXPECT_THAT(help.out, HasSubstr("\n  " + verb + " "));
    const Outcome own = run("help " + verb);
    EXPECT_EQ(own.code, 0);
    EXPECT_THAT(own.out, StartsWith("Example:\n  laban " + verb));
    EXPECT_EQ(run(verb + " --help").out, own.out);
  }
}

TEST_F(Cli, ManPageAndCompletionNameEveryVerb) {
  const std::string page = bytes_of(LABAN_SOURCE_DIR "/tools/laban/laban.1");
  const std::string completion = bytes_of(LABAN_SOURCE_DIR "/tools/laban/laban.bash-completion");
  for (const std::string& verb : kVerbs) {
    EXPECT_THAT(page, HasSubstr(".B " + verb + "\n"));
    EXPECT_THAT(completion, HasSubstr(verb + " "));
  }
}

TEST_F(Cli, ApplyTakesAStateInsteadOfOptions) {
  const std::string state =
      R"({"schema": "laban.effort-room/1", "input": ")" + kTake +
      R"(", "model": "", "asked": {"time": 1.5}, "relative": false, "weights": [1, 1, 1],
        "detail": "replace", "strength": 1, "keep_timing": false, "strict": false, "foot_fix": true,
        "neighbours": 25, "samples": 16, "caution": 1, "stay": 0.15, "way": 2, "tries": 3, "rounds": 3,
        "locks": [], "reading": {}})";
  write(folder_ / "room.json", state);
  EXPECT_EQ(run("apply --state room.json -o by_state.bvh").code, 0);
  EXPECT_EQ(run("apply " + kTake + " --time 1.5 -o by_options.bvh").code, 0);
  EXPECT_EQ(bytes_of(folder_ / "by_state.bvh"), bytes_of(folder_ / "by_options.bvh"));
  EXPECT_EQ(run("apply " + kWalk + " --state room.json -o walk.bvh").code, 0);

  // One that is older than rounds asks for none.
  std::string old = state;
  const std::string rounds = R"( "rounds": 3,)";
  old.erase(old.find(rounds), rounds.size());
  write(folder_ / "old.json", old);
  EXPECT_EQ(run("apply --state old.json -o by_old_state.bvh").code, 0);
  EXPECT_EQ(run("apply " + kTake + " --time 1.5 --rounds 0 -o no_rounds.bvh").code, 0);
  EXPECT_EQ(bytes_of(folder_ / "by_old_state.bvh"), bytes_of(folder_ / "no_rounds.bvh"));
  EXPECT_NE(bytes_of(folder_ / "no_rounds.bvh"), bytes_of(folder_ / "by_options.bvh"));

  // What was set by hand is on record, and tells one batch from another.
  std::string locked = state;
  const std::string locks = R"("locks": [)";
  locked.insert(
      locked.find(locks) + locks.size(),
      R"({"snippet": 0, "fragments": ["phrase_walk_p01", "phrase_walk_p02"], "alpha": 0.5})");
  write(folder_ / "locked.json", locked);
  EXPECT_EQ(run("apply --state room.json --output-dir batch").code, 0);
  const std::string searched = bytes_of(folder_ / "batch" / "take.bvh");
  EXPECT_EQ(run("apply --state locked.json --output-dir batch --force").code, 0);
  EXPECT_NE(bytes_of(folder_ / "batch" / "take.bvh"), searched);
  EXPECT_EQ(run("apply --state locked.json -o locked.bvh --report locked_report.json").code, 0);
  EXPECT_THAT(bytes_of(folder_ / "locked_report.json"), HasSubstr("\"by_hand\""));

  expect_error("apply --state room.json --time 1 -o out.bvh", 2, "--time excludes --state");
  expect_error("apply --time 1 -o out.bvh", 2, "INPUT is required");
  write(folder_ / "none.json", "{\"schema\"");
  expect_error("apply --state none.json -o out.bvh", 4, "none.json: it is no JSON");
  std::string spoilt = state;
  spoilt.replace(spoilt.find("\"way\": 2"), 8, "\"way\": 9");
  write(folder_ / "spoilt.json", spoilt);
  expect_error("apply --state spoilt.json -o out.bvh", 4, "spoilt.json: SearchOptions::way = 9");
  std::string free = state;
  free.replace(free.find("1.5"), 3, "null");
  write(folder_ / "free.json", free);
  EXPECT_EQ(run("apply --state free.json -o free.bvh").code, 0);  // as captured
  expect_error("apply " + kTake + " -o out.bvh", 2, "no target given");
}

TEST_F(Cli, LoopMakesEndlessMotionAndPerfectLoops) {
  const std::string bow = kBow;
  EXPECT_EQ(run("loop synthesize " + bow +
                " --frames 700 -o endless.bvh --report endless.json "
                "--picture endless.svg")
                .code,
            0);
  EXPECT_THAT(bytes_of(folder_ / "endless.bvh"), HasSubstr("Frames: 700\n"));
  EXPECT_THAT(bytes_of(folder_ / "endless.json"), HasSubstr("laban.loop_synthesize/1"));
  EXPECT_EQ(run("loop synthesize " + bow + " --seamless --in-place -o loop.glb").code, 0);
  EXPECT_EQ(run("loop join " + bow + " " + kOtherWalk + " -o both.bvh").code, 0);
  EXPECT_EQ(run("loop turns " + bow + " --picture turns.png").code, 0);
}

TEST_F(Cli, LoopStreamsTheFramesThatItWouldWrite) {
  EXPECT_EQ(run("loop synthesize " + kBow + " --frames 900 --seed 4 -o file.bvh").code, 0);
  const Outcome streamed = run("loop synthesize " + kBow + " --frames 900 --seed 4 --stream -o -");
  EXPECT_EQ(streamed.code, 0);
  EXPECT_EQ(streamed.out, bytes_of(folder_ / "file.bvh"));
}

TEST_F(Cli, LoopSaysWhatDoesNotGoTogether) {
  expect_error("loop", 2, "loop");
  expect_error("loop synthesize " + kBow + " -o out.bvh", 2, "say how long");
  expect_error("loop synthesize " + kBow + " --seamless --frames 9 -o out.bvh", 2, "--seamless");
  expect_error("loop synthesize " + kBow + " --frames 9 --stream -o out.bvh", 2, "stdout");
  expect_error("loop synthesize " + kBow + " --frames 9 --overlap 90 --texton-frames 50 -o out.bvh",
               2, "--overlap 90 is more than --texton-frames 50");
  expect_error("loop join " + kBow + " " + kBow + " --blend-frames 60 -o out.bvh", 2,
               "--blend-frames 60 is more than --overlap 50");
  expect_error("loop synthesize " + kBow + " --seconds nan -o out.bvh", 2,
               "--seconds: nan (must be a number above 0)");
  expect_error("loop turns " + kBow + " --picture turns.pdf", 2, ".png or .svg");
}

TEST_F(Cli, VersionIsOneLine) {
  const Outcome version = run("--version");
  EXPECT_EQ(version.code, 0);
  EXPECT_THAT(version.out, ::testing::MatchesRegex("laban [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST_F(Cli, UsageErrorsExitWithTwoAndSayWhereHelpIs) {
  expect_error("juggle", 2, "'laban --help' lists the verbs");
  expect_error("apply", 2, "'laban help apply' lists the options");
  expect_error("help juggle", 2, "there is no verb 'juggle'");
  expect_error("apply " + kTake + " --time 4 -o out.bvh", 2, "--time");
  expect_error("apply " + kTake + " -o out.bvh", 2, "no target given");
  expect_error("apply " + kTake + " --time 1 -o out.fbx", 2, "out.fbx");
  expect_error("draw " + kWalk + " -o out.gif", 2, "a picture is a .png or .svg file");
}

TEST_F(Cli, ApplyGivesTheSameActionsInTheAskedEffort) {
  const Outcome result = run(
      "apply " + kTake + " --time 1.5 --weight 1 -o out.bvh --report out.json --picture out.png");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(files_in(folder_), ElementsAre("out.bvh", "out.json", "out.png"));
  const json report = json::parse(bytes_of(folder_ / "out.json"));
  EXPECT_EQ(report["schema"], "laban.apply/1");
  EXPECT_EQ(run("apply " + kTake +
                " --time 1.5 --weight 1 --no-foot-fix -o slides.bvh --report slides.json")
                .code,
            0);
  const json slides = json::parse(bytes_of(folder_ / "slides.json"));
  EXPECT_LT(report["quality"]["foot_skate_cm_per_frame"],
            slides["quality"]["foot_skate_cm_per_frame"]);
  EXPECT_GE(report["quality"]["toe_height_2nd_percentile_m"], -0.01);
  EXPECT_GT(report["quality"]["jerk_sources_m_s3"], 0.0);
  std::vector<std::string> contents;
  for (const json& snippet : report["snippets"]) {
    const std::string content = snippet["content"];
    if (contents.empty() || contents.back() != content) contents.push_back(content);
    EXPECT_TRUE(snippet["predicted"]["time"].is_number());
  }
  EXPECT_THAT(contents, ElementsAre("walk", "bow", "wave", "reach", "kick"));
  EXPECT_EQ(report["run"]["inputs"].size(), 2U);
  // The output is a clip of the same rig that can be read back.
  const json facts = json::parse(run("inspect --json out.bvh").out);
  const json input = json::parse(run("inspect --json " + kTake).out);
  EXPECT_EQ(facts["rig"]["joints"], input["rig"]["joints"]);
  EXPECT_EQ(facts["frame_rate_hz"], input["frame_rate_hz"]);
}

TEST_F(Cli, ApplyAsksForChangesAfterAPlusSign) {
  const auto asked = [&](const std::string& options) {
    const Outcome result = run("apply " + kWalk + " " + options + " -o out.bvh --json --force");
    EXPECT_EQ(result.code, 0) << result.err;
    return json::parse(result.out)["snippets"][0];
  };
  const json up = asked("--time +0.5 --flow 1");
  EXPECT_EQ(up["asked"]["flow"], 1.0);
  EXPECT_NEAR(up["asked"]["time"], up["measured_before"]["time"].get<double>() + 0.5, 1e-12);
  EXPECT_EQ(asked("--time +-0.5")["asked"], asked("--relative --time -0.5")["asked"]);
  EXPECT_EQ(asked("--time +6")["asked"]["time"], 3.0);
  const std::string apply = "apply " + kWalk + " -o new.bvh ";
  expect_error(apply + "--time +6.5", 2, "--time +6.5: a change must be in [-6, 6]");
  expect_error(apply + "--time -3.5", 2, "--time -3.5: an Effort must be in [-3, 3]");
  expect_error(apply + "--time quick", 2, "--time quick: no number");
  expect_error(apply + "--time 1 --weights 1,0,1", 2, "--weights");
}

TEST_F(Cli, WeightsSayWhichFactorCountsMost) {
  const auto missed = [&](const std::string& weights) {
    const json report =
        json::parse(run("apply " + kWalk + " --flow -2 --weight 2 --time -2 --weights " + weights +
                        " -o out.bvh --json --force")
                        .out);
    EXPECT_EQ(report["run"]["options"]["asked"]["weights"].size(), 4U);
    return std::abs(report["snippets"][0]["predicted"]["time"].get<double>() + 2.0);
  };
  EXPECT_LT(missed("1,1,50"), missed("50,50,1"));
}

TEST_F(Cli, AnEffortCurveIsAskedForOverTime) {
  write(folder_ / "curve.csv", "seconds,flow,time\n0,,-1\n20,,1\n");
  const Outcome result = run("apply " + kTake + " --effort-curve curve.csv -o out.bvh --json");
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(result.out);
  double previous = -1.0;
  for (const json& snippet : report["snippets"]) {
    EXPECT_TRUE(snippet["asked"]["flow"].is_null());
    EXPECT_GT(snippet["asked"]["time"], previous);
    previous = snippet["asked"]["time"];
  }
  EXPECT_EQ(report["run"]["inputs"].size(), 3U);
  write(folder_ / "bad.csv", "seconds,time\n0,1\n1,much\n");
  expect_error("apply " + kTake + " --effort-curve bad.csv -o new.bvh", 4,
               "bad.csv:3: time = 'much' is no number");
  expect_error("apply " + kTake + " --effort-curve curve.csv --time 1 -o new.bvh", 2, "excludes");
}

TEST_F(Cli, StrengthTimingAndDetailSayHowMuchOfTheInputLivesOn) {
  const json input = json::parse(run("inspect --json " + kTake).out);
  const auto frames = [&](const std::string& options) {
    EXPECT_EQ(run("apply " + kTake + " --time 2 -o out.bvh --force " + options).code, 0);
    return json::parse(run("inspect --json out.bvh").out)["frames"];
  };
  EXPECT_EQ(frames("--keep-timing"), input["frames"]);
  EXPECT_EQ(frames("--keep-timing --detail residual --strength 0.5"), input["frames"]);
  EXPECT_NE(frames(""), input["frames"]);
  EXPECT_EQ(frames("--strength 0 --no-foot-fix"), input["frames"]);
  // The input is back: the same poses, so aligning the two costs nothing to speak of.
  const json match = json::parse(run("match --json --metric raw out.bvh " + kTake).out);
  EXPECT_LT(match["mean_cost"], 1e-3);  // rad^2 in single precision; two walks cost 5.6
}

TEST_F(Cli, WhatIsOutOfReachIsToldWithTheNearest) {
  const Outcome result =
      run("apply " + kWalk + " --neighbours 2 --flow 3 --weight -3 --time 3 -o out.bvh");
  ASSERT_EQ(result.code, 0);
  EXPECT_THAT(result.err, HasSubstr("is out of reach of 1 of 1 snippets; the nearest"));
  EXPECT_THAT(result.out, HasSubstr(" +- "));
  const Outcome near = run("apply " + kWalk + " --time 0.1 -o near.bvh");
  EXPECT_THAT(near.err, IsEmpty());
}

TEST_F(Cli, ABatchGoesOnWhereItStoppedAndWhateverFails) {
  write(folder_ / "bad.bvh", "HIERARCHY\n");
  const std::string clips = kWalk + " bad.bvh " + kOtherWalk + " " + kBow;
  const auto statuses = [](const Outcome& result) {
    std::vector<std::string> found;
    const json report = json::parse(result.out);
    for (const json& clip : report["clips"]) found.push_back(clip["status"]);
    return found;
  };
  const Outcome first = run("apply " + clips + " --time 1 --output-dir one --json --threads 1");
  EXPECT_EQ(first.code, 4);
  EXPECT_THAT(first.err, HasSubstr("1 of 4 clips failed, the first: bad.bvh:"));
  EXPECT_THAT(statuses(first), ElementsAre("done", "failed", "done", "done"));
  EXPECT_EQ(files_in(folder_ / "one").size(), 4U);

  // Whatever the number of threads, and in a folder named like one.
  const Outcome both = run("apply " + clips + " --time 1 -o two/ --json --threads 4");
  for (const std::string& name : files_in(folder_ / "one"))
    EXPECT_TRUE(bytes_of(folder_ / "one" / name) == bytes_of(folder_ / "two" / name)) << name;

  // One output is gone: it alone is made again, and all is as it was.
  const std::string table = bytes_of(folder_ / "one/summary.csv");
  fs::remove(folder_ / "one/phrase_bow_p01.bvh");
  const Outcome again = run("apply " + clips + " --time 1 --output-dir one --json");
  EXPECT_THAT(statuses(again), ElementsAre("skipped", "failed", "skipped", "done"));
  EXPECT_EQ(bytes_of(folder_ / "one/summary.csv"), table);
  // Other options are not the same: nothing is overwritten, unless told.
  const Outcome other = run("apply " + clips + " --time 2 --output-dir one");
  EXPECT_EQ(other.code, 3);
  EXPECT_THAT(other.err, HasSubstr("give --force"));
  EXPECT_EQ(bytes_of(folder_ / "one/summary.csv"), table);
  EXPECT_THAT(statuses(run("apply " + clips + " --time 2 --output-dir one --json --force")),
              ElementsAre("done", "failed", "done", "done"));
}

TEST_F(Cli, ABatchNeedsAFolderAndANameForEachOutput) {
  const std::string two = kWalk + " " + kBow + " --time 1 ";
  expect_error("apply " + two + "-o out.bvh", 2, "--output-dir");
  expect_error("apply " + two, 2, "--output-dir");
  expect_error("apply " + kWalk + " --time 1", 2, "no output given");
  expect_error("apply " + two + "--output-dir out --picture out.png", 2, "--picture");
  expect_error("apply " + kWalk + " " + kWalk + " --time 1 --output-dir out", 2,
               "would both become");
  expect_error("apply " + folder_.string() + " --time 1 --output-dir out", 2, "no clip");
}

TEST_F(Cli, TheSameCommandGivesTheSameBytes) {
  const auto outcome = [&](const std::string& threads) {
    EXPECT_EQ(run("apply " + kTake + " --flow 1 -o out.glb --report out.json --force").code, 0);
    EXPECT_EQ(run("train --labels " + kLabels + " -o out.laban --force --threads " + threads).code,
              0);
    std::string bytes;
    for (const char* ending : {"glb", "json", "laban"}) {
      bytes += bytes_of(folder_ / ("out." + std::string(ending)));
    }
    return bytes;
  };
  const std::string once = outcome("1");
  EXPECT_GT(once.size(), 100'000U);
  EXPECT_TRUE(once == outcome("2"));  // megabytes: not to be printed
}

TEST_F(Cli, ClipsPassThroughPipes) {
  const Outcome result = run("apply - --input-format bvh --time 1 -o - --format bvh < " + kTake);
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, StartsWith("HIERARCHY"));
  expect_error("apply - --time 1 -o out.bvh < " + kTake, 2, "--input-format");
}

TEST_F(Cli, ARigWithoutAPersonIsToldByTheJointsThatAreMissing) {
  write(folder_ / "crane.bvh",
        "HIERARCHY\nROOT base\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nJOINT "
        "arm\n{\nOFFSET 0 10 0\n"
        "CHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 10 "
        "0\n}\n}\n}\nMOTION\nFrames: 2\n"
        "Frame Time: 0.0333333\n0 0 0 0 0 0\n0 0 0 1 0 0\n");
  expect_error("apply crane.bvh --time 1 -o out.bvh", 5, "crane.bvh: ");
}

TEST_F(Cli, TooFewFramesAreToldByNumber) {
  ASSERT_EQ(run("convert " + kTake + " --end 8 -o short.bvh").code, 0);
  expect_error("apply short.bvh --time 1 -o out.bvh", 5, "8 frames");
}

TEST_F(Cli, NoContentMatchIsAnErrorOnlyIfStrict) {
  // Walks are not in a model of reaches: the same take finds nothing there.
  ASSERT_EQ(run("corpus --clips " + kData +
                "phrase --pattern 'phrase_{content}_{performer}' --contents reach --blends 30 "
                "--label measured -o reaches.csv")
                .code,
            0);
  ASSERT_EQ(run("train --labels reaches.csv -o reaches.laban").code, 0);
  expect_error("apply " + kWalk + " --model reaches.laban --strict --time 1 -o out.bvh", 5,
               "match no content of the model");
  const Outcome kept = run("apply " + kWalk + " --model reaches.laban --time 1 -o out.bvh");
  EXPECT_EQ(kept.code, 0) << kept.err;
  EXPECT_THAT(kept.err, HasSubstr("kept as captured"));

  // Stretches that are told are apart: what lies on end is one.
  const Outcome take = run("apply " + kTake + " --model reaches.laban --time 1 -o take.bvh");
  std::set<std::string> ends;
  const std::regex stretch("([0-9.]+) s to ([0-9.]+) s match no content");
  for (std::sregex_iterator told(take.err.begin(), take.err.end(), stretch), none; told != none;
       ++told) {
    EXPECT_FALSE(ends.contains((*told)[1])) << take.err;
    ends.insert((*told)[2]);
  }
  EXPECT_FALSE(ends.empty()) << take.err;
}

TEST_F(Cli, ALabelOutOfRangeIsToldByLine) {
  std::string table = bytes_of(kLabels);
  const std::size_t second_line = table.find('\n') + 1;
  effort::LabelTable parsed = effort::parse_label_table(table, "phrase.csv");
  parsed.rows.front().flow = 3.4;
  write(folder_ / "bad.csv", effort::format_label_table(parsed));
  ASSERT_NE(second_line, 0U);
  expect_error("train --labels bad.csv -o out.laban", 4,
               "bad.csv:2: flow = 3.4 (must be in [-3, 3])");
}

TEST_F(Cli, AModelOfAnotherVersionIsTold) {
  std::string bytes = bytes_of(LABAN_DEFAULT_MODEL);
  ++bytes[40];
  write(folder_ / "new.laban", bytes);
  expect_error("apply " + kTake + " --model new.laban --time 1 -o out.bvh", 4,
               "new.laban: its format version is " + std::to_string(bytes[40]));
}

TEST_F(Cli, AnOutputThatCannotBeWrittenIsToldBeforeTheWork) {
  expect_error("apply " + kTake + " --time 1 -o nowhere/out.bvh", 3,
               "the folder nowhere does not exist");
  write(folder_ / "out.bvh", "mine");
  expect_error("apply " + kTake + " --time 1 -o out.bvh", 3, "exists already; give --force");
  EXPECT_EQ(bytes_of(folder_ / "out.bvh"), "mine");
  EXPECT_EQ(run("apply " + kTake + " --time 1 -o out.bvh --force").code, 0);
  expect_error("apply missing.bvh --time 1 -o new.bvh", 3, "missing.bvh");
}

TEST_F(Cli, SuggestRanksBlankBlendsAndWritesThemBlankInThatOrder) {
  const std::string corpus = "corpus --clips " + kData +
                             "phrase --pattern phrase_{content}_{performer} --contents walk,bow";
  ASSERT_EQ(run(corpus + " --blends 30 --label measured -o full.csv").code, 0);
  // The cold start: fragments are labelled, no blend is.
  effort::LabelTable table = effort::parse_label_table(bytes_of(folder_ / "full.csv"), "full.csv");
  for (effort::LabelRow& row : table.rows) {
    if (!row.is_blend()) continue;
    row.flow = row.weight = row.time = std::nullopt;
  }
  write(folder_ / "partial.csv", effort::format_label_table(table));
  const Outcome cold = run("suggest --labels partial.csv --count 5 -o next.csv");
  ASSERT_EQ(cold.code, 0) << cold.err;
  EXPECT_THAT(cold.out, HasSubstr("   5  blend_"));
  const effort::LabelTable next =
      effort::parse_label_table(bytes_of(folder_ / "next.csv"), "next.csv");
  const auto blends = effort::blends(next);
  ASSERT_EQ(blends.size(), 5U);
  EXPECT_THAT(cold.out, HasSubstr("   1  " + blends.front().fragment));
  EXPECT_EQ(effort::blank_rows(next).size(), 5U);
  EXPECT_EQ(effort::seeds(next).size(), effort::seeds(table).size());

  const Outcome drawn = run("suggest --labels full.csv --pool 40 --count 2 --seed 3");
  EXPECT_THAT(drawn.out, HasSubstr("suggested_"));
  EXPECT_EQ(drawn.out, run("suggest --labels full.csv --pool 40 --count 2 --seed 3").out);
  const Outcome full = run("suggest --labels full.csv");
  EXPECT_EQ(full.code, 5);
  EXPECT_THAT(full.err, HasSubstr("no blend to choose from"));
}

// The product's purpose: clips to view, blanks to fill in by a human rater, a model of them.
TEST_F(Cli, ARatersSheetBecomesAModel) {
  const std::string source = "corpus --clips " + kData +
                             "phrase --pattern 'phrase_{content}_{performer}' --contents bow,wave ";
  ASSERT_EQ(
      run(source + "--blends 40 --label none --write-blends sheet --blend-format bvh -o sheet.csv")
          .code,
      0);
  ASSERT_EQ(files_in(folder_ / "sheet").size(), 40U);
  EXPECT_EQ(run("measure sheet/blend_001.bvh").code, 0);
  const Outcome blank = run("train --labels sheet.csv -o mine.laban");
  EXPECT_EQ(blank.code, 5);
  EXPECT_THAT(blank.err, HasSubstr("blend_040"));
  EXPECT_THAT(blank.err, HasSubstr("64 of 64 rows are still blank"));

  // A rater who rates as the kinematic observer does, to half points, and leaves one blend out.
  ASSERT_EQ(run(source + "--blends 40 --label measured -o measured.csv").code, 0);
  effort::LabelTable filled =
      effort::parse_label_table(bytes_of(folder_ / "sheet.csv"), "sheet.csv");
  const effort::LabelTable measured =
      effort::parse_label_table(bytes_of(folder_ / "measured.csv"), "measured.csv");
  for (std::size_t n = 0; n + 1 < filled.rows.size(); ++n) {
    EXPECT_EQ(filled.rows[n].fragment, measured.rows[n].fragment);
    filled.rows[n].flow = std::round(2.0 * *measured.rows[n].flow) / 2.0;
    filled.rows[n].weight = std::round(2.0 * *measured.rows[n].weight) / 2.0;
    filled.rows[n].time = std::round(2.0 * *measured.rows[n].time) / 2.0;
    filled.rows[n].observer = "rater";
  }
  write(folder_ / "sheet.csv", effort::format_label_table(filled));
  const Outcome one_left = run("train --labels sheet.csv -o mine.laban");
  EXPECT_THAT(one_left.err, HasSubstr("1 of 64 rows are still blank"));
  ASSERT_EQ(run("train --labels sheet.csv -o mine.laban --skip-blank").code, 0);
  const Outcome applied = run("apply " + kBow + " --model mine.laban --weight 2 -o strong.glb");
  EXPECT_EQ(applied.code, 0) << applied.err;
}

TEST_F(Cli, SpaceIsAskedForWhereEveryLabelHasIt) {
  effort::LabelTable table = effort::parse_label_table(bytes_of(kLabels), kLabels);
  std::erase_if(table.rows, [](const effort::LabelRow& row) { return row.content != "walk"; });
  for (effort::LabelRow& row : table.rows) {
    if (!row.clip.empty()) row.clip = fs::path(kData) / "phrase" / fs::path(row.clip).filename();
    row.space = std::clamp(0.5 * *row.time - 0.5 * *row.weight, -3.0, 3.0);
  }
  write(folder_ / "space.csv", effort::format_label_table(table));
  const Outcome trained = run("train --labels space.csv -o space.laban --json");
  ASSERT_EQ(trained.code, 0) << trained.err;
  EXPECT_TRUE(json::parse(trained.out)["factors"].contains("space"));
  const Outcome applied =
      run("apply " + kWalk + " --model space.laban --space 0.5 -o direct.bvh --json");
  ASSERT_EQ(applied.code, 0) << applied.err;
  const json snippet = json::parse(applied.out)["snippets"][0];
  EXPECT_EQ(snippet["asked"]["space"], 0.5);
  EXPECT_NEAR(snippet["predicted"]["space"], 0.5, 0.3);
  EXPECT_EQ(snippet["reachable"].count("space"), 1U);
  EXPECT_FALSE(snippet["measured"].contains("space"));  // nobody measures it
  EXPECT_EQ(json::parse(run("curve --model space.laban --json").out)["pairs"][0].contains("space"),
            true);
  const Outcome evaluated =
      run("evaluate --labels space.csv --runs 2 --models kernel-ridge --train 12 --test 5 --json");
  ASSERT_EQ(evaluated.code, 0) << evaluated.err;
  EXPECT_TRUE(json::parse(evaluated.out)["factors"].contains("space"));

  const std::string apply = "apply " + kWalk + " -o new.bvh ";
  expect_error(apply + "--space 1", 2, "target space is asked of a model whose labels have none");
  expect_error(apply + "--model space.laban --space +1", 2, "nobody measures the input's Space");
  table.rows.back().space.reset();
  write(folder_ / "space.csv", effort::format_label_table(table));
  const Outcome partly = run("train --labels space.csv -o other.laban");
  EXPECT_EQ(partly.code, 0);
  EXPECT_THAT(partly.err, HasSubstr("Space is left out, 1 of"));
}

/// The embedded labels as three raters might have given them: ann as they are, bob half a point
/// higher and half as sure, cat of the bows only.
effort::LabelTable three_raters() {
  effort::LabelTable table;
  for (effort::LabelRow row : effort::parse_label_table(bytes_of(kLabels), kLabels).rows) {
    row.source = effort::LabelSource::kExpert;
    if (!row.clip.empty()) row.clip = fs::path(kData) / "phrase" / fs::path(row.clip).filename();
    row.observer = "ann";
    table.rows.push_back(row);
    if (row.content == "bow") {
      row.observer = "cat";
      table.rows.push_back(row);
    }
    row.observer = "bob";
    row.confidence = 0.5;
    for (auto* factor : {&row.flow, &row.weight, &row.time})
      *factor = std::min(3.0, **factor + 0.5);
    table.rows.push_back(row);
  }
  return table;
}

TEST_F(Cli, AgreePrintsAlphaAndCorrelationsOfRaters) {
  effort::LabelTable table = three_raters();
  write(folder_ / "raters.csv", effort::format_label_table(table));
  const Outcome text = run("agree --labels raters.csv");
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("3 raters: ann, cat, bob; 165 fragments and blends"));
  EXPECT_THAT(text.out, Not(HasSubstr("within")));
  const json all = json::parse(run("agree --labels raters.csv --json").out);
  const json& flow = all["factors"]["flow"];
  EXPECT_EQ(flow["units"], 165);
  EXPECT_EQ(flow["alpha"]["resamples"], 2000);
  EXPECT_GT(flow["alpha"]["value"], 0.8);
  EXPECT_LT(flow["alpha"]["value"], 1.0);
  EXPECT_LT(flow["alpha"]["interval"][0], flow["alpha"]["value"]);
  EXPECT_GT(flow["alpha"]["interval"][1], flow["alpha"]["value"]);
  EXPECT_EQ(flow["icc_2_1"]["units"].get<int>() + flow["icc_2_1"]["dropped"].get<int>(), 165);
  EXPECT_TRUE(all["repeats"].empty());
  // Two who say the same.
  const json two = json::parse(run("agree --labels raters.csv --json --raters ann,cat").out);
  EXPECT_EQ(two["factors"]["time"]["alpha"]["value"], 1.0);
  EXPECT_EQ(two["factors"]["time"]["icc_2_1"]["value"], 1.0);
  // The same seed, the same interval; another one, another.
  EXPECT_EQ(json::parse(run("agree --labels raters.csv --json").out), all);
  EXPECT_NE(json::parse(run("agree --labels raters.csv --json --seed 2").out)["factors"],
            all["factors"]);

  expect_error("agree --labels raters.csv --raters ann,dan", 2,
               "raters.csv: no row has labels by rater 'dan' (raters are 'ann', 'cat', 'bob')");
  expect_error("agree --labels " + kLabels, 5, "agreement needs two raters, or repeats of one");

  effort::LabelRow again = table.rows.front();
  again.flow = *again.flow + 0.5;
  again.repeat = 1;
  table.rows.push_back(again);
  write(folder_ / "raters.csv", effort::format_label_table(table));
  const json repeats = json::parse(run("agree --labels raters.csv --json").out)["repeats"];
  ASSERT_EQ(repeats.size(), 3U);
  EXPECT_EQ(repeats[0]["rater"], "ann");
  EXPECT_NEAR(repeats[0]["mean_absolute_difference"].get<double>(), 0.5, 1e-12);
  EXPECT_TRUE(repeats[0]["icc_1_1"]["value"].is_null());  // of one unit
}

TEST_F(Cli, TrainLearnsFromTheRatersItIsTold) {
  write(folder_ / "raters.csv", effort::format_label_table(three_raters()));
  const auto train = [&](const std::string& options) {
    const Outcome result =
        run("train --labels raters.csv -o mine.laban --force --json --skip-blank " + options);
    EXPECT_EQ(result.code, 0) << result.err;
    return json::parse(result.out);
  };
  const json mean = train("");
  EXPECT_EQ(mean["blends"], 105);
  EXPECT_EQ(mean["labels"], 105);
  EXPECT_EQ(mean["raters"]["observers"], json({"ann", "cat", "bob"}));
  const json each = train("--each-rater");
  EXPECT_EQ(each["blends"], 105);
  EXPECT_GT(each["labels"], 210);
  EXPECT_EQ(each["raters"]["labels"], "each");
  EXPECT_EQ(train("--rater ann")["labels"], 105);
  const json cat = train("--rater cat");
  EXPECT_LT(cat["labels"], 105);
  EXPECT_EQ(cat["contents"], json({"bow"}));
  expect_error(
      "train --labels raters.csv -o no.laban --rater eve", 2,
      "raters.csv: no row has labels by observer 'eve' (observers are 'ann', 'cat', 'bob')");
  expect_error("train --labels raters.csv -o no.laban --rater ann --each-rater", 2, "--rater");
  // Cat has not rated all there is.
  EXPECT_THAT(run("train --labels raters.csv -o no.laban --rater cat").err,
              HasSubstr("rows are still blank"));
  const Outcome table = run("evaluate --labels raters.csv --runs 2 --each-rater");
  EXPECT_THAT(table.out, HasSubstr("2 runs, trained on 183 and tested on 44 labels")) << table.err;
}

TEST_F(Cli, TheEmbeddedLabelsAreWhatTheCorpusVerbMeasures) {
  ASSERT_EQ(run("corpus --clips " + kData +
                "phrase --pattern 'phrase_{content}_{performer}' --blends 105 --seed 1 --label "
                "measured -o again.csv")
                .code,
            0);
  const auto again = effort::parse_label_table(bytes_of(folder_ / "again.csv"), "again.csv");
  const auto kept = effort::parse_label_table(bytes_of(kLabels), "phrase.csv");
  ASSERT_EQ(again.rows.size(), kept.rows.size());
  ASSERT_EQ(kept.rows.size(), 165U);
  for (std::size_t n = 0; n < kept.rows.size(); ++n) {
    EXPECT_EQ(again.rows[n].fragment, kept.rows[n].fragment);
    EXPECT_EQ(again.rows[n].alpha, kept.rows[n].alpha);
    // Written to three decimals; another compiler may round the last one the other way.
    EXPECT_NEAR(*again.rows[n].flow, *kept.rows[n].flow, 0.0015);
    EXPECT_NEAR(*again.rows[n].weight, *kept.rows[n].weight, 0.0015);
    EXPECT_NEAR(*again.rows[n].time, *kept.rows[n].time, 0.0015);
  }
}

TEST_F(Cli, MatchOfAClipWithItselfIsFree) {
  const json same = json::parse(run("match --json " + kWalk + " " + kWalk).out);
  EXPECT_EQ(same["schema"], "laban.match/1");
  EXPECT_EQ(same["cost"], 0.0);
  const json walks = json::parse(run("match --json " + kWalk + " " + kOtherWalk).out);
  const json walk_and_bow = json::parse(run("match --json " + kWalk + " " + kBow).out);
  EXPECT_LT(walks["mean_cost"], walk_and_bow["mean_cost"]);
  const json nearest = json::parse(run("match --json " + kWalk).out);
  EXPECT_EQ(nearest["nearest"][0]["content"], "walk");
}

TEST_F(Cli, SegmentCoversTheTake) {
  const json cut = json::parse(run("segment --json " + kTake).out);
  EXPECT_EQ(cut["snippets"].front()["begin_frame"], 0);
  for (std::size_t n = 1; n < cut["snippets"].size(); ++n) {
    EXPECT_EQ(cut["snippets"][n]["begin_frame"], cut["snippets"][n - 1]["end_frame"]);
  }
}

TEST_F(Cli, BlendAtZeroIsTheFirstClip) {
  ASSERT_EQ(run("blend " + kWalk + " " + kOtherWalk + " --alpha 0 -o same.bvh").code, 0);
  const json match = json::parse(run("match --json --metric raw same.bvh " + kWalk).out);
  EXPECT_LT(match["mean_cost"], 1e-9);
}

TEST_F(Cli, CurveMeasureInspectAndDrawWriteWhatTheySay) {
  EXPECT_EQ(run("curve --picture curve.svg --csv curve.csv").code, 0);
  EXPECT_THAT(bytes_of(folder_ / "curve.csv"),
              StartsWith("fragment_i,fragment_j,alpha,flow,weight,time,"));
  EXPECT_THAT(bytes_of(folder_ / "curve.svg"), HasSubstr("<svg"));
  const json measured = json::parse(
      run("measure --json --content walk --over-time walk.csv --picture walk.png " + kWalk).out);
  EXPECT_EQ(measured["clips"][0]["content"], "walk");
  // The picture says what it is measured against, and what is done when.
  EXPECT_EQ(run("measure --content walk --window 0.5 --picture walk.svg " + kWalk).code, 0);
  EXPECT_THAT(bytes_of(folder_ / "walk.svg"), HasSubstr("in the default model; window 0.5 s"));
  EXPECT_THAT(bytes_of(folder_ / "walk.svg"), HasSubstr(">walk<"));
  EXPECT_EQ(run("draw " + kWalk + " " + kOtherWalk + " -o walks.png").code, 0);
  EXPECT_THAT(bytes_of(folder_ / "walks.png"), StartsWith("\x89PNG"));
  EXPECT_EQ(run("draw " + kWalk + " " + kOtherWalk + " --animate walks.html").code, 0);
  EXPECT_THAT(bytes_of(folder_ / "walks.html"), StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(bytes_of(folder_ / "walks.html"), HasSubstr("phrase_walk_p02"));
  expect_error("draw " + kWalk, 2, "name a picture with -o or a page with --animate");
  expect_error("draw" + (" " + kWalk + " " + kWalk + " " + kWalk) + " " + kWalk + " " + kWalk +
                   " --animate five.html",
               2, "--animate shows at most 4 clips");
  EXPECT_EQ(json::parse(run("inspect --json " LABAN_DEFAULT_MODEL).out)["fragments"].size(), 60U);
  EXPECT_EQ(json::parse(run("inspect --json " + kLabels).out)["blends"], 105);

  // Beside itself nothing is worse.
  const Outcome same = run("measure --json --against " + kWalk + " " + kWalk);
  EXPECT_EQ(same.code, 0);
  EXPECT_TRUE(json::parse(same.out)["found"].empty());
  EXPECT_NEAR(json::parse(same.out)["quality"]["content_cost_ratio"].get<double>(), 0.0, 1e-9);
  const json other =
      json::parse(run("measure --json --content walk --against " + kWalk + " " + kOtherWalk).out);
  EXPECT_GT(other["quality"]["content_cost_ratio"], 0.1);
  EXPECT_LT(other["quality"]["content_cost_ratio"], 3.0);
  expect_error("measure --against " + kWalk + " " + kWalk + " " + kWalk, 2, "--against");
}

TEST_F(Cli, EvaluatePrintsTableOneWithThePapersNumbers) {
  const Outcome result =
      run("evaluate --labels " + kLabels + " --runs 4 --csv table.csv --plot table.svg");
  ASSERT_EQ(result.code, 0) << result.err;
  for (const char* part : {"linear-interpolation", "linear-ridge", "kernel-ridge", "svr",
                           "residual-kernel-ridge", "label variance", "0.65", "0.39"}) {
    EXPECT_THAT(result.out, HasSubstr(part));
  }
  EXPECT_THAT(bytes_of(folder_ / "table.svg"), HasSubstr("residual kernel ridge"));
  EXPECT_THAT(bytes_of(folder_ / "table.csv"),
              StartsWith("factor,model,mean_squared_error,standard_error,"));
}

TEST_F(Cli, EvaluateLeavesOnePerformerOrContentOut) {
  const std::string models = " --models linear-interpolation,residual-kernel-ridge";
  const json performers = json::parse(
      run("evaluate --json --labels " + kLabels + " --protocol leave-performer-out" + models).out);
  EXPECT_EQ(performers["runs"], 12);
  EXPECT_EQ(performers["held_out"].size(), 12U);
  EXPECT_EQ(performers["tested_blends"], 105);
  for (const json& held_out : performers["held_out"])
    EXPECT_EQ(held_out["train"].get<int>() + held_out["test"].get<int>(), 105);
  const json& time = performers["factors"]["time"];
  EXPECT_EQ(time["differences"].size(), 1U);
  EXPECT_EQ(time["differences"][0]["difference"]["degrees_of_freedom"], 11);

  ASSERT_EQ(run("evaluate --labels " + kLabels + " --protocol leave-content-out" + models +
                " --runs-csv runs.csv -q")
                .code,
            0);
  const std::string runs = bytes_of(folder_ / "runs.csv");
  EXPECT_EQ(std::count(runs.begin(), runs.end(), '\n'), 1 + 5 * 3 * 2);
  EXPECT_THAT(runs, HasSubstr("walk"));

  expect_error("evaluate --labels " + kLabels + " --protocol leave-content-out --runs 9", 2,
               "--runs, --train and --test are for random splits");
  expect_error("evaluate --labels " + kLabels + " --protocol leave-nobody-out", 2, "--protocol");
  expect_error("evaluate --labels " + kLabels + " --models best", 2, "--models");
}

// Whatever the number of threads, and once more: the same bytes.
TEST_F(Cli, EvaluateGivesTheSameBytesAgain) {
  for (const char* protocol : {"random --runs 6", "leave-performer-out"}) {
    SCOPED_TRACE(protocol);
    std::vector<std::string> seen;
    for (const char* threads : {"1", "2", "2"}) {
      const std::string options = std::string(" --threads ") + threads +
                                  " --models linear-ridge,kernel-ridge,residual-kernel-ridge"
                                  " --csv t.csv --runs-csv r.csv --plot p.svg --force --json";
      const Outcome result =
          run("evaluate --labels " + kLabels + " --protocol " + protocol + options);
      ASSERT_EQ(result.code, 0) << result.err;
      seen.push_back(result.out + bytes_of(folder_ / "t.csv") + bytes_of(folder_ / "r.csv") +
                     bytes_of(folder_ / "p.svg"));
    }
    EXPECT_EQ(seen[0], seen[1]);
    EXPECT_EQ(seen[1], seen[2]);
  }
}

TEST_F(Cli, EvaluateInterruptedLeavesNoFile) {
  const Outcome result =
      run_shell("timeout --preserve-status -s INT 2 \"$laban\" evaluate --labels " + kLabels +
                    " --runs 100000 --csv t.csv --runs-csv r.csv --plot p.svg"
                    " >out.txt; echo $? >code.txt",
                folder_);
  EXPECT_EQ(result.code, 0);
  EXPECT_EQ(bytes_of(folder_ / "code.txt"), "130\n");
  EXPECT_THAT(files_in(folder_), ElementsAre("code.txt", "out.txt"));
  EXPECT_THAT(bytes_of(folder_ / "out.txt"), IsEmpty());
}

TEST_F(Cli, CurveTellsItsStandardErrorWhereTheRegressorDoes) {
  const json curve = json::parse(run("curve --json").out);
  ASSERT_EQ(curve["pairs"].size(), 3U);
  for (const json& pair : curve["pairs"]) {
    ASSERT_EQ(pair["weight_error"].size(), curve["alpha"].size());
    for (const json& error : pair["weight_error"]) EXPECT_GE(error, 0.0);
  }
  const Outcome printed = run("curve");
  EXPECT_THAT(printed.out, StartsWith("fragment_i,fragment_j,alpha,flow,weight,time,flow_error,"
                                      "weight_error,time_error\n"));
  EXPECT_EQ(std::count(printed.out.begin(), printed.out.end(), '\n'), 1 + 3 * 81);
}

}  // namespace
}  // namespace laban::test
