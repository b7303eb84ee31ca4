#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"

#include "../tools/program.h"
#include "studio_client.h"

namespace laban::studio {
namespace {

namespace fs = std::filesystem;

/// A small map of a walk, and a studio that has it open beside a take.
class MapRoomTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (opened_) return;
    folder_ = test::fresh_folder();
    const auto learnt = test::run_laban(
        "manifold learn " LABAN_SOURCE_DIR
        "/data/phrase/phrase_walk_p01.bvh -o walk.manifold --size 20 --epochs 10 --primitives 4",
        folder_);
    ASSERT_EQ(learnt.code, 0) << learnt.err;
    StudioOptions options;
    options.clips = {kTake};
    options.manifold = (folder_ / "walk.manifold").string();
    opened_ = std::make_unique<StudioClient>(options);
    map_ = Json::parse(opened_->get("/api/map").body);
  }
  static void TearDownTestSuite() { opened_.reset(); }

  static Json state() { return map_["state"]; }
  static Motion made(const Json& state) {
    return Motion(opened_->post("/api/map/make", Json{{"state", state}}.dump()).body);
  }

  static inline fs::path folder_;
  static inline std::unique_ptr<StudioClient> opened_;
  static inline Json map_;
};

TEST_F(MapRoomTest, OpensWithAWalkAndAllThatIsDrawn) {
  EXPECT_EQ(map_["columns"], 20);
  EXPECT_EQ(map_["node_distances_m"].size(), 400U);
  EXPECT_EQ(map_["primitives"].size(), 4U);
  ASSERT_EQ(map_["takes"].size(), 1U);
  EXPECT_EQ(map_["takes"][0]["points"].size(), map_["takes"][0]["primitives"].size());
  const Motion motion = made(state());
  EXPECT_EQ(motion.header["path"].size(), motion.header["frames"].get<std::size_t>());
  EXPECT_GT(motion.header["primitives"].size(), 2U);
  EXPECT_NEAR(motion.header["frames"].get<double>() / motion.header["rate_hz"].get<double>(), 10.0,
              0.1);
}

TEST_F(MapRoomTest, AWalkCanBeStopped) {
  Json walk = state();
  walk["seconds"] = 60;
  EXPECT_THAT(opened_->told_when_stopped("/api/map/make", {{"state", walk}}),
              ::testing::EndsWith("interrupted"));
}

TEST_F(MapRoomTest, AFrameLiesWhereThePoseIsLikeIt) {
  const Json placed = opened_->post_json("/api/map/place", {{"clip", "c0"}, {"frame", 40}});
  EXPECT_EQ(placed["key"], kTake + ":40");
  EXPECT_LT(placed["away_cm"].get<double>(), 25.0);
  const Motion pose(opened_->post("/api/map/pose", Json{{"point", placed["point"]}}.dump()).body);
  EXPECT_EQ(pose.header["frames"], 1);
  const Json path = opened_->post_json("/api/map/clip", {{"clip", "c0"}});
  EXPECT_EQ(path["points"][40 / path["stride"].get<std::size_t>()], placed["point"]);
}

TEST_F(MapRoomTest, WhatIsExportedIsWhatTheVerbMakesOfTheState) {
  Json path = state();
  path["way"] = "path";
  path["points"] = {{{"column", 3.25}, {"row", 4.5}, {"key", nullptr}},
                    {{"column", 12}, {"row", 9}, {"key", "walk.bvh:3"}},
                    {{"column", 5}, {"row", 15}, {"key", nullptr}}};
  path["frames"] = 70;
  path["travel"] = "primitives";
  Json walk = state();
  walk["seconds"] = 3;
  walk["perturb"] = 0.3;
  walk["seed"] = 9;
  for (const Json& one : {path, walk}) {
    base::write_file(folder_ / "room.json", one.dump(2), {.overwrite = true});
    for (const std::string format : {"bvh", "glb"}) {
      const Response exported =
          opened_->post("/api/map/export?format=" + format, Json{{"state", one}}.dump());
      EXPECT_EQ(exported.file_name, "walk." + format);
      const auto run = test::run_laban(
          "manifold synthesize --state room.json --force -o " + exported.file_name, folder_);
      ASSERT_EQ(run.code, 0) << run.err;
      EXPECT_EQ(test::bytes_of(folder_ / exported.file_name), exported.body);
    }
  }
  EXPECT_EQ(made(path).header["passed"].size(), 3U);
  // The same points by hand.
  const auto by_hand = test::run_laban(
      "manifold synthesize walk.manifold --through 3.25,4.5 12,9 5,15 --frames 70 --travel "
      "primitives -o by_hand.bvh",
      folder_);
  ASSERT_EQ(by_hand.code, 0) << by_hand.err;
  EXPECT_EQ(test::bytes_of(folder_ / "by_hand.bvh"),
            opened_->post("/api/map/export?format=bvh", Json{{"state", path}}.dump()).body);
}

TEST_F(MapRoomTest, NamesWhatIsWrongWithARequest) {
  const auto refused = [](const std::function<void(Json&)>& spoil, const std::string& told) {
    Json state = MapRoomTest::state();
    spoil(state);
    try {
      (void)made(state);
      ADD_FAILURE() << "taken: " << state;
    } catch (const std::exception& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(told));
    }
  };
  refused([](Json& state) { state["schema"] = "laban.loop-room/1"; }, "the map room");
  refused([](Json& state) { state["points"] = Json::array(); }, "1 to 10000 points");
  refused([](Json& state) { state["points"][0]["row"] = "x"; }, "'row' is no number");
  refused([](Json& state) { state["points"][0]["more"] = 1; }, "'more'");
  refused([](Json& state) { state["travel"] = "fly"; }, "'travel' is none of");
  refused([](Json& state) { state["seconds"] = 1e5; }, "'seconds' must be");
  refused([](Json& state) { state["frames"] = 70; }, "'frames' is of a path");
  refused(
      [](Json& state) {
        state["way"] = "path";
        state["frames"] = 0;
      },
      "'frames' must be");
  refused([](Json& state) { state["manifold"] = "other.manifold"; }, "--manifold other.manifold");
  for (const char* body : {"{}", "{\"point\": [1]}", "{\"point\": [1, \"2\"]}"})
    EXPECT_EQ(status_of([&] { (void)opened_->post("/api/map/pose", body); }), 400U) << body;
  EXPECT_EQ(opened_->post_json("/api/map/state", {{"state", state()}}), Json::object());
  EXPECT_THROW((void)opened_->post_json("/api/map/state", {{"state", Json::object()}}),
               base::Error);
  EXPECT_EQ(status_of([] {
              (void)opened_->post_json("/api/map/place", {{"clip", "c0"}, {"frame", 100000}});
            }),
            400U);
}

}  // namespace
}  // namespace laban::studio
