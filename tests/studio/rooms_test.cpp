#include <cstdio>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../tools/program.h"
#include "studio_client.h"

namespace laban::studio {
namespace {

Json asked_for(double time) {
  Json state = post_json("/api/effort/open", {{"clip", "c0"}})["state"];
  state["asked"]["time"] = time;
  return state;
}

TEST(Studio, PageCarriesANonceOfItsOwnEachTime) {
  const Response first = get("/");
  EXPECT_EQ(first.body, "<p id=\"" + first.nonce + "\">");
  EXPECT_EQ(first.nonce.size(), 32U);
  EXPECT_NE(get("/").nonce, first.nonce);
}

TEST(Studio, AnswersNothingElse) {
  for (const char* target : {"/index.html", "/api", "/api/clips/c0", "/api/clips/motion?clip=c9",
                             "/etc/passwd", "/../../etc/passwd", "/api/clips/../../../etc/passwd",
                             "/%2e%2e/%2e%2e/etc/passwd", "/api/clips/..%2f..%2fetc%2fpasswd"}) {
    EXPECT_EQ(status_of([&] { (void)get(target); }), 404U) << target;
  }
}

TEST(StudioVerb, SaysWhatItIsAndWhatItCannotOpen) {
  const auto folder = test::fresh_folder();
  EXPECT_THAT(test::run_laban("help studio", folder).out,
              ::testing::StartsWith("Example:\n  laban studio"));
  const auto missing = test::run_laban("studio nowhere.bvh --no-browser", folder);
  EXPECT_EQ(missing.code, 3);
  EXPECT_THAT(missing.err, ::testing::HasSubstr("nowhere.bvh"));
  EXPECT_EQ(missing.out, "");
}

TEST(Stage, AMotionMessageHoldsTheClip) {
  const io::ClipFile file = io::read_clip(kTake);
  const Motion motion(get("/api/clips/motion?clip=c0").body);
  ASSERT_EQ(motion.header["frames"], file.clip.frame_count());
  ASSERT_EQ(motion.header["joints"].size(), static_cast<std::size_t>(file.clip.joint_count()));
  EXPECT_EQ(motion.header["rate_hz"], file.clip.frame_rate_hz());
  const std::size_t frame = 100;
  const std::size_t joint = 6;
  const Eigen::Vector4d q = file.clip.rotation(100, 6).coeffs();
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t joints = motion.header["joints"].size();
    EXPECT_NEAR(motion.number("rotations", 4 * (frame * joints + joint) + k),
                q[static_cast<Eigen::Index>(k)], 1e-6);
  }
  EXPECT_NEAR(motion.number("root", 3 * frame + 1), file.clip.root_positions()(1, 100), 1e-6);
  EXPECT_EQ(motion.header["joints"][6]["side"], "left");
  const auto contacts = motion.header["arrays"]["contacts"]["offset"].get<std::size_t>();
  EXPECT_EQ(contacts + 2 * static_cast<std::size_t>(file.clip.frame_count()), motion.arrays.size());
}

TEST(Stage, TakesDroppedFilesByNameAloneAndSaysWhatIsWrong) {
  const std::string bytes = test::bytes_of(kTake);
  const Json dropped = Json::parse(post("/api/clips?name=my%20take.bvh", bytes).body);
  EXPECT_EQ(dropped["name"], "my take.bvh");
  EXPECT_EQ(get("/api/clips/motion?clip=" + dropped["id"].get<std::string>()).body,
            get("/api/clips/motion?clip=c0").body);
  for (const char* name : {"", "..", "../a.bvh", "/a.bvh", "a%2fb.bvh", "a%5cb.bvh", "a%22.bvh"}) {
    const std::string target = std::string("/api/clips?name=") + name;
    EXPECT_EQ(status_of([&] { (void)post(target, bytes); }), 400U) << name;
  }
  try {
    (void)post("/api/clips?name=broken.bvh", bytes.substr(0, 2000));
    FAIL() << "half a file was taken";
  } catch (const base::Error& error) {
    EXPECT_THAT(error.what(), ::testing::StartsWith("broken.bvh:"));
  }
}

TEST(Stage, AMotionWithoutItsSkeletonIsToldToBeDroppedWithIt) {
  StudioClient studio(StudioOptions{});
  try {
    (void)studio.post("/api/clips?name=walk.amc", ":DEGREES\n1\nroot 0 0 0 0 0 0\n");
    FAIL() << "an .amc was taken without its .asf";
  } catch (const HttpError& error) {
    EXPECT_EQ(error.status(), 400U);
    EXPECT_THAT(error.what(), ::testing::HasSubstr("drop its .asf"));
  }
}

TEST(EffortRoom, AStyledClipIsWhatTheVerbWritesByteForByte) {
  const auto folder = test::fresh_folder();
  Json state = asked_for(1.5);
  state["asked"]["flow"] = -0.75;
  state["strength"] = 0.8;
  state["keep_timing"] = true;
  const Json others = post_json("/api/effort/snippet",
                                {{"clip", "c0"}, {"state", state}, {"snippet", 2}})["runners_up"];
  state["locks"] = {{{"snippet", 2}, {"fragments", others[3]["fragments"]}, {"alpha", 0.625}}};
  base::write_file(folder / "room.json", state.dump(2));
  for (const std::string format : {"bvh", "glb"}) {
    const Response exported =
        post("/api/effort/export?format=" + format, Json{{"clip", "c0"}, {"state", state}}.dump());
    EXPECT_EQ(exported.file_name, "take_styled." + format);
    const auto run = test::run_laban("apply --state room.json -o " + exported.file_name, folder);
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(test::bytes_of(folder / exported.file_name), exported.body) << format;
  }
}

TEST(EffortRoom, DraftsPlayTheFirstAnswerAndLeaveQualityOut) {
  const Json request = {{"clip", "c0"}, {"state", asked_for(-1.0)}, {"draft", true}};
  const Motion draft(post("/api/effort/style", request.dump()).body);
  EXPECT_FALSE(draft.header["report"].contains("quality"));
  Json first = request;
  first["draft"] = false;
  first["state"]["tries"] = 1;
  first["state"]["rounds"] = 0;
  const Motion whole(post("/api/effort/style", first.dump()).body);
  EXPECT_TRUE(whole.header["report"].contains("quality"));
  EXPECT_EQ(draft.arrays, whole.arrays);
  EXPECT_EQ(draft.header["report"]["snippets"], whole.header["report"]["snippets"]);
}

TEST(EffortRoom, AllFreeIsTheInputAsCaptured) {
  const Json state = post_json("/api/effort/open", {{"clip", "c0"}})["state"];
  const Motion styled(
      post("/api/effort/style", Json{{"clip", "c0"}, {"state", state}}.dump()).body);
  for (const Json& snippet : styled.header["report"]["snippets"])
    EXPECT_TRUE(snippet["kept_as_captured"]);
}

TEST(EffortRoom, AllFreeIsExportedAsTheVerbWritesIt) {
  const auto folder = test::fresh_folder();
  const Json state = post_json("/api/effort/open", {{"clip", "c0"}})["state"];
  base::write_file(folder / "room.json", state.dump());
  const Response exported =
      post("/api/effort/export?format=bvh", Json{{"clip", "c0"}, {"state", state}}.dump());
  const auto run = test::run_laban("apply --state room.json -o free.bvh", folder);
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(test::bytes_of(folder / "free.bvh"), exported.body);
}

TEST(EffortRoom, WeightsChangeTheSearchAsTheVerbsDo) {
  const auto folder = test::fresh_folder();
  Json state = asked_for(2.0);
  state["asked"]["flow"] = -2.0;
  state["asked"]["weight"] = -2.0;
  const auto exported = [&] {
    return post("/api/effort/export?format=bvh", Json{{"clip", "c0"}, {"state", state}}.dump())
        .body;
  };
  const std::string even = exported();
  state["weights"] = {1, 1, 20};
  const std::string uneven = exported();
  EXPECT_NE(uneven, even);
  const auto run = test::run_laban("apply '" + kTake +
                                       "' --flow -2 --weight -2 --time 2 --weights 1,1,20 "
                                       "-o weighed.bvh",
                                   folder);
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(test::bytes_of(folder / "weighed.bvh"), uneven);
}

TEST(EffortRoom, EffortOverTimeIsAsTheVerbMeasuresIt) {
  const auto folder = test::fresh_folder();
  const std::string walk = LABAN_SOURCE_DIR "/data/phrase/phrase_walk_p01.bvh";
  StudioOptions options;
  options.clips = {walk};  // one content: it is measured against that one's reference
  StudioClient studio(options);
  const Json told = studio.post_json("/api/effort/over-time", {{"clip", "c0"}, {"state", nullptr}});
  const auto run = test::run_laban("measure '" + walk + "' --over-time curve.csv", folder);
  ASSERT_EQ(run.code, 0) << run.err;
  std::istringstream curve(test::bytes_of(folder / "curve.csv"));
  std::string line;
  std::size_t frames = 0;
  while (std::getline(curve, line)) {
    double seconds = 0.0, flow = 0.0, weight = 0.0, time = 0.0;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &seconds, &flow, &weight, &time) != 4)
      continue;
    ASSERT_LT(frames, told["seconds"].size());
    EXPECT_NEAR(told["effort"]["flow"][frames].get<double>(), flow, 1e-5);
    EXPECT_NEAR(told["effort"]["weight"][frames].get<double>(), weight, 1e-5);
    EXPECT_NEAR(told["effort"]["time"][frames].get<double>(), time, 1e-5);
    ++frames;
  }
  EXPECT_EQ(frames, told["seconds"].size());
}

TEST(EffortRoom, EveryRequestStandsForItself) {
  const Json request = {{"clip", "c0"}, {"state", asked_for(1.0)}};
  const std::string before = post("/api/effort/style", request.dump()).body;
  (void)post("/api/effort/style", Json{{"clip", "c0"}, {"state", asked_for(-2.0)}}.dump());
  EXPECT_EQ(post("/api/effort/style", request.dump()).body, before);
}

TEST(EffortRoom, ASnippetsCurvesPassThroughWhatItPlays) {
  const Json state = asked_for(0.5);
  const Json request = {{"clip", "c0"}, {"state", state}, {"snippet", 0}};
  const Json told = post_json("/api/effort/snippet", request);
  const Motion styled(
      post("/api/effort/style", Json{{"clip", "c0"}, {"state", state}}.dump()).body);
  const Json& played = styled.header["report"]["snippets"][0];
  EXPECT_EQ(told["curves"]["fragments"][0], played["fragment_i"]);
  EXPECT_EQ(told["curves"]["fragments"][1], played["fragment_j"]);
  const auto alphas = told["curves"]["alphas"].get<std::vector<double>>();
  const auto curve = told["curves"]["predicted"]["time"].get<std::vector<double>>();
  const double alpha = played["alpha"];
  for (std::size_t n = 1; n < alphas.size(); ++n) {
    if (alpha < alphas[n - 1] || alpha > alphas[n]) continue;
    const double share = (alpha - alphas[n - 1]) / (alphas[n] - alphas[n - 1]);
    EXPECT_NEAR((1.0 - share) * curve[n - 1] + share * curve[n],
                played["predicted"]["time"].get<double>(), 0.01);
  }
  EXPECT_EQ(told["runners_up"].size(), 12U);
}

TEST(EffortRoom, RefusesStatesThatAreNoneAndNamesTheKey) {
  const auto refused = [](const std::function<void(Json&)>& spoil, const std::string& words) {
    Json state = asked_for(1.0);
    spoil(state);
    try {
      (void)post("/api/effort/style", Json{{"clip", "c0"}, {"state", state}}.dump());
      ADD_FAILURE() << "taken: " << state;
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(words));
    }
  };
  refused([](Json& state) { state["schema"] = "laban.effort-room/9"; }, "schema");
  refused([](Json& state) { state.erase("strength"); }, "has no 'strength'");
  refused([](Json& state) { state["more"] = 1; }, "'more'");
  refused([](Json& state) { state["asked"]["time"] = 7; }, "[-3, 3]");
  refused([](Json& state) { state["asked"]["time"] = "1"; }, "'time' is no number");
  refused([](Json& state) { state["way"] = 2.5; }, "'way' is no whole number");
  refused([](Json& state) { state["tries"] = 0; }, "tries");
  refused([](Json& state) { state["weights"] = {1, 0, 1}; }, "'weights'");
  refused([](Json& state) { state["model"] = "other.laban"; }, "--model other.laban");
  refused(
      [](Json& state) {
        state["locks"] = {{{"snippet", 0}, {"fragments", {"a", "b"}}, {"alpha", 0}}};
      },
      "no fragment 'a'");
  refused([](Json& state) { state = Json::array(); }, "no JSON object");
}

}  // namespace
}  // namespace laban::studio
