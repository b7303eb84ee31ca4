#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/atomic_file.h"
#include "laban/motion/forward_kinematics.h"

#include "../tools/program.h"
#include "studio_client.h"
#include "texture.h"

namespace laban::studio {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using enum motion::StandardJoint;

/// A small texture of one take, and a studio that has it open.
class TextureRoomTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (opened_) return;
    folder_ = test::fresh_folder();
    const auto learnt = test::run_laban(
        "texture learn " + kTake + " -o take.texture --min-frames 30 --textons 3", folder_);
    ASSERT_EQ(learnt.code, 0) << learnt.err;
    StudioOptions options;
    options.texture = (folder_ / "take.texture").string();
    opened_ = std::make_unique<StudioClient>(options);
    opened_at_ = Json::parse(opened_->get("/api/texture").body);
    cli::InputRecord record;
    texture_ =
        std::make_unique<texture::MotionTexture>(cli::read_texture_file(options.texture, record));
  }
  static void TearDownTestSuite() { opened_.reset(); }

  static Json state() { return opened_at_["state"]; }
  static Response made(const Json& state) {
    return opened_->post("/api/texture/make", Json{{"state", state}}.dump());
  }
  /// What the verb makes of a state.
  static cli::MadeTexture made_of(const Json& state) {
    return cli::make_texture(*texture_, cli::read_texture_state(state, "state").choices);
  }
  static Vector3d place_of(const motion::Clip& clip, int frame, motion::StandardJoint joint) {
    return motion::forward_kinematics(clip, frame)
        .positions.col(texture_->rig.humanoid.mapped(joint)->joint);
  }
  static Vector3d in_hips(const motion::Clip& clip, int frame, motion::StandardJoint joint) {
    return hips_rotation(clip, frame).conjugate() *
           (place_of(clip, frame, joint) - place_of(clip, frame, kHips));
  }
  static Vector3d hand_in_hips(const motion::Clip& clip, int frame) {
    return in_hips(clip, frame, kLeftHand);
  }
  static Eigen::Quaterniond hips_rotation(const motion::Clip& clip, int frame) {
    return motion::forward_kinematics(clip, frame)
        .rotations[static_cast<std::size_t>(texture_->rig.humanoid.mapped(kHips)->joint)];
  }
  static Json pin(int frame, const char* joint, const Vector3d& place) {
    return {{"frame", frame}, {"joint", joint}, {"place", {place.x(), place.y(), place.z()}}};
  }

  static inline fs::path folder_;
  static inline std::unique_ptr<StudioClient> opened_;
  static inline Json opened_at_;
  static inline std::unique_ptr<texture::MotionTexture> texture_;
};

TEST_F(TextureRoomTest, OpensWithHowTheFirstCaptureBegins) {
  ASSERT_GT(opened_at_["textons"].size(), 1U);
  std::map<int, double> sums;
  for (const Json& one : opened_at_["transitions"]) sums[one[0]] += one[2].get<double>();
  for (const auto& [from, sum] : sums) EXPECT_NEAR(sum, 1.0, 1e-12) << from;
  const Motion motion(made(state()).body);
  EXPECT_EQ(motion.header["parts"].size(), state()["textons"].size());
  EXPECT_EQ(motion.header["parts"].back()["end_frame"], motion.header["frames"]);
  for (const Json& part : motion.header["parts"]) EXPECT_EQ(part["jump"], false);
}

TEST_F(TextureRoomTest, MakingAndWalkingCanBeStopped) {
  const auto interrupted = ::testing::EndsWith("interrupted");
  EXPECT_THAT(opened_->told_when_stopped("/api/texture/make", {{"state", state()}}), interrupted);
  const Json walk = {{"state", state()}, {"piece", 0}};
  EXPECT_THAT(opened_->told_when_stopped("/api/texture/walk", walk), interrupted);
  EXPECT_EQ(opened_->post("/api/texture/walk", walk.dump()).status, 200U);
}

TEST_F(TextureRoomTest, StretchesAndDrawsAnew) {
  Json longer = state();
  longer["textons"][0]["frames"] = 77;
  EXPECT_EQ(Motion(made(longer).body).header["parts"][0]["end_frame"], 77);
  Json other = state();
  other["seed"] = 5;
  EXPECT_NE(made(other).body, made(state()).body);
  EXPECT_EQ(made(state()).body, made(state()).body);
}

TEST_F(TextureRoomTest, APinnedHandIsWhereItIsWanted) {
  Json state = TextureRoomTest::state();
  state["foot_fix"] = false;
  const cli::MadeTexture before = made_of(state);
  const auto end = static_cast<int>(before.parts[0].end);
  const int frame = end / 2;
  const auto pinned_at = [&](const Vector3d& place) {
    state["textons"][0]["pins"] = Json::array({pin(frame, "left_hand", place)});
    return made_of(state);
  };
  const Vector3d own = hand_in_hips(before.clip, frame);
  const Vector3d place = own + Vector3d(0.03, 0.1, 0.08);
  const cli::MadeTexture pinned = pinned_at(place);
  EXPECT_LT((hand_in_hips(pinned.clip, frame) - place).norm(), 1e-3);
  // Only that texton has moved: where the next one begins all is as before.
  for (const int at : {end - 1, end, end + 10})
    EXPECT_LT((hand_in_hips(pinned.clip, at) - hand_in_hips(before.clip, at)).norm(), 1e-6) << at;
  ASSERT_EQ(pinned.pinned.size(), 1U);
  EXPECT_GT(pinned.pinned[0].state_deviations + pinned.pinned[0].residual_deviations, 0.1);
  // A pin where the hand is anyway changes nothing.
  const cli::MadeTexture same = pinned_at(own);
  for (int at = 0; at < end; ++at)
    EXPECT_LT((hand_in_hips(same.clip, at) - hand_in_hips(before.clip, at)).norm(), 1e-4) << at;
}

TEST_F(TextureRoomTest, PinnedHipsMoveAndHandsAndFeetStay) {
  Json state = TextureRoomTest::state();
  state["foot_fix"] = false;
  // Behind the second block's beginning, where the path has turned away from where it began.
  const cli::MadeTexture before = made_of(state);
  const auto begin = static_cast<int>(before.parts[1].begin);
  const auto end = static_cast<int>(before.parts[1].end);
  const int frame = (end - begin) / 2;
  const Vector3d shift(0.03, -0.05, 0.04);
  state["textons"][1]["pins"] = Json::array({pin(frame, "hips", shift)});
  const cli::MadeTexture pinned = made_of(state);
  const int at = begin + frame;
  const Vector3d wanted = place_of(before.clip, at, kHips) + hips_rotation(before.clip, at) * shift;
  const Vector3d hips = place_of(pinned.clip, at, kHips);
  EXPECT_LT((hips - wanted).norm(), 0.01);
  const Eigen::Quaterniond turn =
      hips_rotation(pinned.clip, at) * hips_rotation(before.clip, at).conjugate();
  for (const auto limb : {kLeftHand, kRightHand, kLeftFoot, kRightFoot}) {
    const Vector3d stays = place_of(before.clip, at, limb) - wanted;
    EXPECT_LT((place_of(pinned.clip, at, limb) - hips - turn * stays).norm(), 1e-3);
  }
  // The path leads on from where it did.
  EXPECT_LT((place_of(pinned.clip, end, kHips) - place_of(before.clip, end, kHips)).norm(), 0.01);
  EXPECT_LT((place_of(pinned.clip, begin, kHips) - place_of(before.clip, begin, kHips)).norm(),
            1e-6);
}

TEST_F(TextureRoomTest, HeadAndElbowGoWhereTheyArePinned) {
  Json state = TextureRoomTest::state();
  state["foot_fix"] = false;
  const cli::MadeTexture before = made_of(state);
  const auto frame = static_cast<int>(before.parts[0].end / 2);
  const Vector3d head = in_hips(before.clip, frame, kHead) + Vector3d(0.02, -0.03, 0.05);
  const Vector3d hand = hand_in_hips(before.clip, frame) + Vector3d(0.0, 0.08, 0.06);
  const Vector3d elbow = in_hips(before.clip, frame, kLeftForearm) + Vector3d(0.1, 0.1, 0.0);
  state["textons"][0]["pins"] = {pin(frame, "left_forearm", elbow), pin(frame, "head", head),
                                 pin(frame, "left_hand", hand)};
  const cli::MadeTexture pinned = made_of(state);
  EXPECT_LT((in_hips(pinned.clip, frame, kHead) - head).norm(), 1e-3);
  EXPECT_LT((hand_in_hips(pinned.clip, frame) - hand).norm(), 1e-3);
  state["textons"][0]["pins"].erase(0);
  EXPECT_LT((in_hips(pinned.clip, frame, kLeftForearm) - elbow).norm(),
            (in_hips(made_of(state).clip, frame, kLeftForearm) - elbow).norm() - 0.005);
}

TEST_F(TextureRoomTest, PinsOfADrawnPathGiveWhatTheVerbMakes) {
  Json state = TextureRoomTest::state();
  (void)made(state);
  state["textons"][0]["pins"] = Json::array({pin(30, "left_hand", {0.3, 0.3, 0.3})});
  const auto root = [](const Motion& motion) { return motion.number("root", 3 * 31); };
  const Motion pinned(made(state).body);
  const Motion draft(
      opened_->post("/api/texture/make", Json{{"state", state}, {"draft", true}}.dump()).body);
  EXPECT_EQ(draft.header["quality"], nullptr);
  EXPECT_NE(pinned.header["quality"], nullptr);
  EXPECT_EQ(draft.arrays, pinned.arrays);
  EXPECT_NEAR(root(pinned), made_of(state).clip.root_positions()(0, 31), 1e-6);
  // Other noise is another path.
  state["noise"] = 0.0;
  EXPECT_NEAR(root(Motion(made(state).body)), made_of(state).clip.root_positions()(0, 31), 1e-6);
}

TEST_F(TextureRoomTest, WhatIsExportedIsWhatTheVerbMakesOfTheState) {
  Json state = TextureRoomTest::state();
  state["noise"] = 0.7;
  state["seed"] = 3;
  state["textons"][1]["frames"] = 50;
  state["textons"][1]["pins"] = {
      {{"frame", 20}, {"joint", "right_foot"}, {"place", {-0.1, -0.6, 0.2}}},
      {{"frame", 20}, {"joint", "right_hand"}, {"place", {-0.3, 0.5, 0.3}}},
      {{"frame", 20}, {"joint", "right_forearm"}, {"place", {-0.4, 0.2, 0.3}}},
      {{"frame", 25}, {"joint", "head"}, {"place", {0.0, 0.6, 0.1}}},
      {{"frame", 30}, {"joint", "hips"}, {"place", {0.02, -0.05, 0.03}}}};
  base::write_file(folder_ / "room.json", state.dump(2), {.overwrite = true});
  for (const std::string format : {"bvh", "glb"}) {
    const Response exported =
        opened_->post("/api/texture/export?format=" + format, Json{{"state", state}}.dump());
    EXPECT_EQ(exported.file_name, "take." + format);
    const auto run = test::run_laban(
        "texture synthesize --state room.json --force -o " + exported.file_name, folder_);
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(test::bytes_of(folder_ / exported.file_name), exported.body);
  }
  const auto both =
      test::run_laban("texture synthesize --state room.json --noise 0 -o out.bvh", folder_);
  EXPECT_EQ(both.code, 2);
}

TEST_F(TextureRoomTest, AWalkWithoutEndGoesOnFromPieceToPiece) {
  const auto piece = [](int n, int seed) {
    Json state = TextureRoomTest::state();
    state["seed"] = seed;
    return Motion(
        opened_->post("/api/texture/walk", Json{{"state", state}, {"piece", n}}.dump()).body);
  };
  const Motion first = piece(0, 2);
  const Motion second = piece(1, 2);
  const auto last = 3 * (first.header["frames"].get<std::size_t>() - 1);
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(first.number("root", last + k), second.number("root", k), 0.05);
  EXPECT_EQ(first.header["parts"][0]["begin_frame"], 0);
  (void)piece(0, 7);
  EXPECT_EQ(piece(1, 2).arrays, second.arrays);  // made again
  EXPECT_EQ(status_of([&] { (void)piece(5000, 2); }), 400U);
}

TEST_F(TextureRoomTest, FindsPathsAsTheVerbDoes) {
  const int from = state()["textons"][0]["texton"];
  const int to = state()["textons"].back()["texton"];
  const Json found = opened_->post_json("/api/texture/path", {{"from", from}, {"to", to}});
  const auto verb = test::run_laban(
      "texture path take.texture " + std::to_string(from) + " " + std::to_string(to) + " --json",
      folder_);
  ASSERT_EQ(verb.code, 0) << verb.err;
  const Json told = Json::parse(verb.out);
  EXPECT_EQ(found["path"], told["path"]);
  EXPECT_EQ(found["cost_nats"], told["cost_nats"]);
  // A bridge from a texton to itself goes by others.
  const Json round =
      opened_->post_json("/api/texture/path", {{"from", from}, {"to", from}, {"bridge", true}});
  if (!round["path"].is_null()) {
    EXPECT_GE(round["path"].size(), 3U);
    EXPECT_EQ(round["path"].front(), from);
    EXPECT_EQ(round["path"].back(), from);
  }
}

TEST_F(TextureRoomTest, NamesWhatIsWrongWithAState) {
  const auto refused = [](const std::function<void(Json&)>& spoil, const std::string& told) {
    Json state = TextureRoomTest::state();
    spoil(state);
    try {
      (void)made(state);
      ADD_FAILURE() << "taken: " << state;
    } catch (const std::exception& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(told));
    }
  };
  const auto pinned = [](int frame, const char* joint) {
    return Json::array({pin(frame, joint, {0.0, 0.0, 0.3})});
  };
  refused([](Json& state) { state["schema"] = "laban.map-room/1"; }, "the texture room");
  refused([](Json& state) { state["textons"] = Json::array(); }, "1 to 2000 textons");
  refused([](Json& state) { state["textons"][0]["texton"] = 999; }, "no texton 999");
  refused([](Json& state) { state["textons"][0]["frames"] = 2; }, "'frames' must be from 5");
  refused(
      [](Json& state) {
        state["textons"] = Json::array();
        for (int n = 0; n < 6; ++n)
          state["textons"].push_back({{"texton", 0}, {"frames", 100'000}, {"pins", Json::array()}});
      },
      "more than 500000 frames");
  refused([&](Json& state) { state["textons"][0]["pins"] = pinned(9, "neck"); },
          "'joint' is none of");
  refused([&](Json& state) { state["textons"][1]["pins"] = pinned(1, "left_hand"); }, "frame 1 of");
  refused([&](Json& state) { state["textons"][0]["pins"] = pinned(5000, "left_hand"); },
          "frame 5000");
  refused([](Json& state) { state["noise"] = -1; }, "'noise' must be");
  refused([](Json& state) { state["texture"] = "other.texture"; }, "--texture other.texture");
  EXPECT_EQ(status_of([] {
              (void)opened_->post_json("/api/texture/path", {{"from", 0}, {"to", 4000}});
            }),
            400U);
}

}  // namespace
}  // namespace laban::studio
