#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"

#include "../tools/program.h"
#include "studio_client.h"

namespace laban::studio {
namespace {

Json first_state() {
  return post_json("/api/loop/open", {{"clip", "c0"}})["state"];
}

Json request_of(const Json& state) {
  return {{"clip", "c0"}, {"state", state}};
}

TEST(LoopRoom, TellsTurningPointsAsTheVerbDoes) {
  Json state = first_state();
  state["turning"]["threshold"] = 0.95;
  const Json turns = post_json("/api/loop/turns", request_of(state));
  const auto told =
      test::run_laban("loop turns " + kTake + " --threshold 0.95 --json", test::fresh_folder());
  const Json verb = Json::parse(told.out);
  ASSERT_GT(turns["points"].size(), 2U);
  ASSERT_EQ(turns["points"].size(), verb["turning_points"].size());
  for (std::size_t n = 0; n < turns["points"].size(); ++n) {
    EXPECT_EQ(turns["points"][n]["frame"], verb["turning_points"][n]["frame"]);
    EXPECT_GE(turns["points"][n]["symmetry"].get<double>(), 0.95);
  }
  EXPECT_EQ(turns["symmetry"], verb["symmetry"]);
}

TEST(LoopRoom, ASeamlessLoopComesWithItsSeamAndItsRound) {
  const Motion motion(post("/api/loop/make", request_of(first_state()).dump()).body);
  const Json& report = motion.header["report"];
  EXPECT_EQ(report["kind"], "seamless");
  ASSERT_EQ(report["seams"].size(), 1U);
  EXPECT_EQ(report["seams"][0]["switch_frames"].size(), motion.header["joints"].size());
  EXPECT_GT(report["travel_m"].get<double>(), 0.5);
  // The round takes the first frame to where the one after the last would be.
  const double yaw = report["round_yaw_deg"].get<double>() * 0.017453292519943295;
  const float x = motion.number("root", 0);
  const float z = motion.number("root", 2);
  const double next_x =
      std::cos(yaw) * x + std::sin(yaw) * z + report["round_shift_m"][0].get<double>();
  const double next_z =
      std::cos(yaw) * z - std::sin(yaw) * x + report["round_shift_m"][1].get<double>();
  const auto last = 3 * (motion.header["frames"].get<std::size_t>() - 1);
  EXPECT_NEAR(next_x, motion.number("root", last), 0.03);
  EXPECT_NEAR(next_z, motion.number("root", last + 2), 0.03);
}

TEST(LoopRoom, WhatIsExportedIsWhatTheVerbMakesOfTheState) {
  const auto folder = test::fresh_folder();
  Json seamless = first_state();
  seamless["in_place"] = true;
  seamless["seam"]["overlap"] = 30;
  seamless["seam"]["blend_frames"] = 12;
  Json endless = first_state();
  endless["kind"] = "endless";
  endless["seconds"] = 6.5;
  endless["seed"] = 4;
  endless["turning"]["distance"] = "l2";
  for (const Json& state : {seamless, endless}) {
    base::write_file(folder / "room.json", state.dump(2), {.overwrite = true});
    for (const std::string format : {"bvh", "glb"}) {
      const Response exported = post("/api/loop/export?format=" + format, request_of(state).dump());
      EXPECT_EQ(exported.file_name, "take_loop." + format);
      const auto run = test::run_laban(
          "loop synthesize --state room.json --force -o " + exported.file_name, folder);
      ASSERT_EQ(run.code, 0) << run.err;
      EXPECT_EQ(test::bytes_of(folder / exported.file_name), exported.body);
    }
  }
  const auto both =
      test::run_laban("loop synthesize --state room.json --seed 2 -o out.bvh", folder);
  EXPECT_EQ(both.code, 2);
  EXPECT_THAT(both.err, ::testing::HasSubstr("--seed"));
}

TEST(LoopRoom, NamesWhatIsWrongWithAState) {
  const auto refused = [](const std::function<void(Json&)>& spoil, const std::string& told) {
    Json state = first_state();
    spoil(state);
    try {
      (void)post("/api/loop/make", request_of(state).dump());
      ADD_FAILURE() << "taken: " << state;
    } catch (const base::Error& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(told));
    }
  };
  refused([](Json& state) { state["schema"] = "laban.effort-room/1"; }, "the loop room");
  refused([](Json& state) { state["kind"] = "round"; }, "'kind' is none of seamless, endless");
  refused([](Json& state) { state["seconds"] = 1e9; }, "'seconds' must be from");
  refused([](Json& state) { state["seam"].erase("poisson"); }, "has no 'poisson'");
  refused([](Json& state) { state["seam"]["overlap"] = 200; }, "--overlap 200 is more than");
  refused([](Json& state) { state["turning"]["window_s"] = "1"; }, "'window_s' is no number");
  refused([](Json& state) { state["more"] = 1; }, "'more'");
  refused([](Json& state) { state["seed"] = -1; }, "'seed'");
  EXPECT_EQ(status_of([] { (void)post("/api/loop/make", "{}"); }), 400U);
  EXPECT_EQ(post_json("/api/loop/state", {{"state", first_state()}}), Json::object());
  EXPECT_THROW((void)post_json("/api/loop/state", {{"state", Json::object()}}), base::Error);
  EXPECT_EQ(status_of([] { (void)post("/api/loop/open", "{\"clip\": \"c9\"}"); }), 404U);
}

}  // namespace
}  // namespace laban::studio
