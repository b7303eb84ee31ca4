#include <fstream>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "program.h"

namespace laban::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

const std::string kTake = LABAN_SOURCE_DIR "/data/take.bvh";
const std::string kWalk = LABAN_SOURCE_DIR "/data/phrase/phrase_walk_p01.bvh";
const std::string kBow = LABAN_SOURCE_DIR "/data/phrase/phrase_bow_p01.bvh";

/// A verb that takes what a room of the studio was set to.
class RoomStateCli : public ::testing::Test {
 protected:
  explicit RoomStateCli(std::string verb) : folder_(fresh_folder()), verb_(std::move(verb)) {}

  [[nodiscard]] Outcome run(const std::string& arguments) const {
    return run_laban(arguments, folder_);
  }
  void write(const std::string& bytes) const {
    std::ofstream(folder_ / "room.json", std::ios::binary) << bytes;
  }
  /// The clip that arguments make.
  [[nodiscard]] std::string made(const std::string& arguments, const std::string& format) const {
    const Outcome outcome = run(verb_ + " " + arguments + " --force -o out." + format);
    EXPECT_EQ(outcome.code, 0) << arguments << ": " << outcome.err;
    return bytes_of(folder_ / ("out." + format));
  }
  void expect_same(const json& state, const std::string& options) const {
    SCOPED_TRACE(options);
    write(state.dump());
    for (const std::string format : {"bvh", "glb"})
      EXPECT_EQ(made("--state room.json", format), made(options, format)) << format;
  }
  /// Expects that exit code, one line on stderr, nothing on stdout and no clip.
  void expect_error(const std::string& arguments, int code, const std::string& told) const {
    SCOPED_TRACE(told);
    fs::remove(folder_ / "out.bvh");
    const Outcome outcome = run(verb_ + " " + arguments + " -o out.bvh");
    EXPECT_EQ(outcome.code, code);
    EXPECT_THAT(outcome.err, HasSubstr(told));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_FALSE(fs::exists(folder_ / "out.bvh"));
  }
  /// Expects that a spoilt state is told of by the file's name and `told`.
  void expect_refused(json state, const std::function<void(json&)>& spoil,
                      const std::string& told) const {
    spoil(state);
    write(state.dump());
    expect_error("--state room.json", 4, ": room.json" + told);
  }
  /// What every room's state is refused for.
  void expect_strict(const json& state, const std::string& room, const std::string& option) const {
    const auto spoilt = [&](const std::function<void(json&)>& spoil, const std::string& told) {
      expect_refused(state, spoil, told);
    };
    spoilt([](json& one) { one = json::array(); }, " is no JSON object");
    spoilt([](json& one) { one["schema"] = "laban.other-room/1"; }, " is no state of " + room);
    spoilt([](json& one) { one.erase("schema"); }, " is no state of " + room);
    spoilt([](json& one) { one["more"] = 1; }, " has 'more', which nothing reads");
    spoilt([](json& one) { one.erase("seed"); }, " has no 'seed'");
    spoilt([](json& one) { one["seed"] = "1"; }, ": 'seed' is no number");
    spoilt([](json& one) { one["seed"] = 0.5; }, ": 'seed' is no whole number");
    spoilt([](json& one) { one["seed"] = -1; }, ": 'seed' must be from 0 to 1000000");
    spoilt([](json& one) { one["foot_fix"] = 1; }, ": 'foot_fix' is neither true nor false");
    write("{\"schema\"");
    expect_error("--state room.json", 4, "room.json: it is no JSON");
    write("");
    expect_error("--state room.json", 4, "room.json: it is no JSON");
    expect_error("--state away.json", 3, "away.json");
    write(state.dump());
    expect_error("--state room.json " + option, 2, "excludes");
    expect_error("--state room.json --seed 1", 2, "excludes");
  }

  fs::path folder_;
  std::string verb_;
};

class LoopStateCli : public RoomStateCli {
 protected:
  LoopStateCli() : RoomStateCli("loop synthesize") {}
  static json seamless() {
    return {{"schema", "laban.loop-room/1"},
            {"input", kTake},
            {"kind", "seamless"},
            {"seconds", 20},
            {"in_place", true},
            {"turns", true},
            {"seams", true},
            {"seam_count", 5},
            {"probability_step", 0.2},
            {"foot_fix", true},
            {"seed", 1},
            {"seam",
             {{"texton_frames", 100},
              {"texton_s", 0},
              {"overlap", 30},
              {"blend_frames", 12},
              {"seam_metric", "gradient"},
              {"poisson", false},
              {"joint_weight", 0.01}}},
            {"turning",
             {{"distance", "mahalanobis"},
              {"threshold", 0.9},
              {"window_s", 0.5},
              {"falloff", 1},
              {"apart_s", 0.25}}},
            {"reading", json::object()}};
  }
};

TEST_F(LoopStateCli, MakesWhatTheSameOptionsMake) {
  expect_same(seamless(), kTake +
                              " --seamless --in-place --texton-frames 100 --overlap 30 "
                              "--blend-frames 12 --seam-metric gradient --no-poisson");
  json endless = seamless();
  endless.update({{"input", kBow},
                  {"kind", "endless"},
                  {"seconds", 12},
                  {"in_place", false},
                  {"seam_count", 1},
                  {"probability_step", 0.5},
                  {"foot_fix", false},
                  {"seed", 4}});
  endless["seam"]["texton_frames"] = 60;
  endless["turning"].update(
      {{"distance", "l2"}, {"threshold", 0.8}, {"window_s", 1.5}, {"falloff", 3}});
  const std::string options =
      kBow +
      " --seconds 12 --seam-count 1 --probability-step 0.5 --no-foot-fix --seed 4 "
      "--texton-frames 60 --overlap 30 --blend-frames 12 --seam-metric gradient --no-poisson "
      "--distance l2 --threshold 0.8 --window 1.5 --falloff 3";
  expect_same(endless, options);
  endless["seams"] = false;
  expect_same(endless, options + " --no-seams");
  endless.update({{"seams", true}, {"turns", false}});
  expect_same(endless, options + " --no-turns");
}

TEST_F(LoopStateCli, AnInputStandsAboveTheStates) {
  json state = seamless();
  state["input"] = "away.bvh";
  write(state.dump());
  EXPECT_EQ(run("loop synthesize " + kTake + " --state room.json -o out.bvh").code, 0);
  expect_error("--state room.json", 3, "away.bvh");
}

TEST_F(LoopStateCli, NamesFileAndKeyOfWhatIsWrong) {
  expect_strict(seamless(), "the loop room", "--seconds 3");
  const auto refused = [&](const std::function<void(json&)>& spoil, const std::string& told) {
    expect_refused(seamless(), spoil, told);
  };
  refused([](json& one) { one["input"] = 3; }, ": 'input' is no text");
  refused([](json& one) { one["kind"] = "round"; }, ": 'kind' is none of seamless, endless");
  refused([](json& one) { one["seconds"] = nullptr; }, ": 'seconds' is no number");
  refused([](json& one) { one["seconds"] = 1e9; }, ": 'seconds' must be from 0.1 to 3600");
  refused([](json& one) { one["seam_count"] = 0; }, ": 'seam_count' must be from 1 to 100");
  refused([](json& one) { one["probability_step"] = 3; },
          ": 'probability_step' must be from 0 to 2");
  refused([](json& one) { one["seam"] = 3; }, ": 'seam' is no JSON object");
  refused([](json& one) { one["seam"].erase("poisson"); }, ": 'seam' has no 'poisson'");
  refused([](json& one) { one["seam"]["overlap"] = 3; },
          ": 'seam': 'overlap' must be from 4 to 2000");
  refused([](json& one) { one["seam"]["overlap"] = 200; }, ": --overlap 200 is more than");
  refused([](json& one) { one["turning"]["falloff"] = "1"; },
          ": 'turning': 'falloff' is no number");
  refused([](json& one) { one["turning"]["distance"] = "l1"; },
          ": 'turning': 'distance' is none of mahalanobis, l2");
  refused([](json& one) { one["reading"]["fps"] = 0; }, ": 'reading': 'fps' must be above 0");
  refused([](json& one) { one["reading"]["input_up"] = "w"; },
          ": 'reading': 'input_up' is neither");
}

class MapStateCli : public RoomStateCli {
 protected:
  MapStateCli() : RoomStateCli("manifold synthesize") {
    const Outcome learnt =
        run("manifold learn " + kWalk + " -o walk.manifold --size 20 --epochs 10 --primitives 4");
    EXPECT_EQ(learnt.code, 0) << learnt.err;
  }
  static json path() {
    return {{"schema", "laban.map-room/1"},
            {"manifold", "walk.manifold"},
            {"way", "path"},
            {"points",
             {{{"column", 3.25}, {"row", 4.5}, {"key", nullptr}},
              {{"column", 12}, {"row", 9}, {"key", "walk.bvh:3"}},
              {{"column", 5}, {"row", 15}, {"key", nullptr}}}},
            {"frames", 70},
            {"seconds", 10},
            {"perturb", 0},
            {"seed", 1},
            {"travel", "primitives"},
            {"foot_fix", false}};
  }
};

TEST_F(MapStateCli, MakesWhatTheSameOptionsMake) {
  const std::string through = "walk.manifold --through 3.25,4.5 12,9 5,15 ";
  expect_same(path(), through + "--frames 70 --travel primitives --no-foot-fix");
  json as_captured = path();
  as_captured.update({{"frames", nullptr}, {"travel", "contacts"}, {"foot_fix", true}});
  expect_same(as_captured, through);
  // A walk begins at a pose: the state has the place of it.
  const std::string start = "walk.manifold --start " + kWalk + ":30 --seconds 3 --seed 9 ";
  const json drawn = json::parse(run(verb_ + " " + start + "-o start.bvh --json").out);
  json walk = path();
  walk.update({{"way", "walk"}, {"frames", nullptr}, {"seconds", 3}, {"perturb", 0.3}});
  walk.update({{"seed", 9}, {"travel", "contacts"}, {"foot_fix", true}});
  const json& start_point = drawn["run"]["options"]["points"][0];
  walk["points"] = json::array({{{"column", start_point[0]}, {"row", start_point[1]}}});
  expect_same(walk, start + "--perturb 0.3");
}

TEST_F(MapStateCli, AManifoldStandsAboveTheStates) {
  json state = path();
  state["manifold"] = "away.manifold";
  write(state.dump());
  EXPECT_EQ(run("manifold synthesize walk.manifold --state room.json -o out.bvh").code, 0);
  expect_error("--state room.json", 3, "away.manifold");
}

TEST_F(MapStateCli, NamesFileAndKeyOfWhatIsWrong) {
  expect_strict(path(), "the map room", "--through 1,2");
  const auto refused = [&](const std::function<void(json&)>& spoil, const std::string& told) {
    expect_refused(path(), spoil, told);
  };
  const std::string no_points = ": 'points' is no list of 1 to 10000 points";
  refused([](json& one) { one["points"] = json::array(); }, no_points);
  refused([](json& one) { one["points"] = nullptr; }, no_points);
  refused([](json& one) { one["points"] = json(10'001, one["points"][0]); }, no_points);
  refused([](json& one) { one["points"][1] = {1, 2}; }, ": a point is no JSON object");
  refused([](json& one) { one["points"][1]["row"] = "x"; }, ": a point: 'row' is no number");
  refused([](json& one) { one["points"][1].erase("column"); }, ": a point has no 'column'");
  refused([](json& one) { one["points"][1]["key"] = 3; }, ": a point: 'key' is no text");
  refused([](json& one) { one["points"][1]["more"] = 1; }, ": a point has 'more'");
  refused([](json& one) { one["manifold"] = nullptr; }, ": 'manifold' is no text");
  refused([](json& one) { one["way"] = "run"; }, ": 'way' is none of path, walk");
  refused([](json& one) { one["frames"] = 0; }, ": 'frames' must be from 1 to 1000000");
  refused([](json& one) { one["seconds"] = 1e5; }, ": 'seconds' must be from 0.1 to 3600");
  refused([](json& one) { one["perturb"] = -1; }, ": 'perturb' must be from 0 to 1000");
  refused([](json& one) { one["travel"] = "fly"; },
          ": 'travel' is none of contacts, primitives, none");
}

class TextureStateCli : public RoomStateCli {
 protected:
  TextureStateCli() : RoomStateCli("texture synthesize") {
    const Outcome learnt =
        run("texture learn " + kTake + " -o take.texture --min-frames 30 --textons 3");
    EXPECT_EQ(learnt.code, 0) << learnt.err;
  }
  static json played() {
    const auto block = [](int texton) {
      return json{{"texton", texton}, {"frames", nullptr}, {"pins", json::array()}};
    };
    return {{"schema", "laban.texture-room/1"},
            {"texture", "take.texture"},
            {"textons", {block(0), block(1), block(0)}},
            {"noise", 0.7},
            {"variation", 0.5},
            {"seed", 3},
            {"foot_fix", false}};
  }
};

TEST_F(TextureStateCli, MakesWhatTheSameOptionsMake) {
  expect_same(played(),
              "take.texture --path 0 1 0 --noise 0.7 --variation 0.5 --seed 3 --no-foot-fix");
  json likeliest = played();
  likeliest.update({{"noise", 0}, {"variation", 0}, {"foot_fix", true}});
  expect_same(likeliest, "take.texture --path 0 1 0 --noise 0 --variation 0 --seed 3");
}

TEST_F(TextureStateCli, ATextureStandsAboveTheStates) {
  json state = played();
  state["texture"] = "away.texture";
  write(state.dump());
  EXPECT_EQ(run("texture synthesize take.texture --state room.json -o out.bvh").code, 0);
  expect_error("--state room.json", 3, "away.texture");
}

TEST_F(TextureStateCli, NamesFileAndKeyOfWhatIsWrong) {
  expect_strict(played(), "the texture room", "--path 1");
  const auto refused = [&](const std::function<void(json&)>& spoil, const std::string& told) {
    expect_refused(played(), spoil, told);
  };
  const auto pin = [](const json& joint, const json& place) {
    return json::array({{{"frame", 9}, {"joint", joint}, {"place", place}}});
  };
  refused([](json& one) { one["texture"] = 1; }, ": 'texture' is no text");
  refused([](json& one) { one["textons"] = json::array(); },
          ": 'textons' is no list of 1 to 2000 textons");
  refused([](json& one) { one["textons"][1] = 1; }, ": a texton is no JSON object");
  refused([](json& one) { one["textons"][1].erase("pins"); }, ": a texton has no 'pins'");
  refused([](json& one) { one["textons"][1]["texton"] = -1; }, ": a texton: 'texton' must be");
  refused([](json& one) { one["textons"][1]["frames"] = 2; },
          ": a texton: 'frames' must be from 5");
  refused([](json& one) { one["textons"][1]["pins"] = 2; }, ": a texton: 'pins' is no list");
  refused(
      [&](json& one) {
        one["textons"][1]["pins"] = pin("nose", {0, 0, 0});
      },
      ": a pin: 'joint' is none of");
  refused(
      [&](json& one) {
        one["textons"][1]["pins"] = pin("left_hand", {0, 0});
      },
      ": a pin: 'place' is no list of 3 numbers");
  refused(
      [&](json& one) {
        one["textons"][1]["pins"] = pin("left_hand", {0, 0, "1"});
      },
      ": a pin: 'place' is no number");
  refused(
      [&](json& one) {
        one["textons"][1]["pins"] = pin("left_hand", {0, 0, 11});
      },
      ": a pin: 'place' is more than 10 m away");
  refused([](json& one) { one["noise"] = 11; }, ": 'noise' must be from 0 to 10");
  refused([](json& one) { one["variation"] = 2; }, ": 'variation' must be from 0 to 1");
}

}  // namespace
}  // namespace laban::test
