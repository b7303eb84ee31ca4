#include "work.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "studio_client.h"

namespace laban::studio {
namespace {

TEST(Work, TellsHowFarARequestHasCome) {
  Work work;
  EXPECT_EQ(work.told()["busy"], false);
  {
    const Work::Turn turn(work);
    EXPECT_EQ(work.told()["busy"], true);
    EXPECT_TRUE(work.told()["fraction"].is_null());
    EXPECT_TRUE(work.update(0.25));
    EXPECT_EQ(work.told()["fraction"], 0.25);
  }
  EXPECT_EQ(work.told()["busy"], false);
  EXPECT_TRUE(work.told()["fraction"].is_null());
}

TEST(Work, IsStoppedOnceAndGoesOnWithTheNextRequest) {
  Work work;
  {
    const Work::Turn turn(work);
    work.stop();
    EXPECT_FALSE(work.update(0.5));
  }
  const Work::Turn next(work);
  EXPECT_TRUE(work.update(0.0));
}

TEST(Work, OfTheEffortRoomCanBeStoppedAndDoneAgain) {
  StudioOptions options;
  options.clips = {kTake};
  StudioClient studio(options);
  const Json clip = {{"clip", "c0"}};
  const auto interrupted = ::testing::EndsWith("interrupted");
  EXPECT_THAT(studio.told_when_stopped("/api/effort/open", clip), interrupted);
  const Json opened = studio.post_json("/api/effort/open", clip);
  Json request = {{"clip", "c0"}, {"state", opened["state"]}};
  request["state"]["asked"]["time"] = 1.0;
  EXPECT_THAT(studio.told_when_stopped("/api/effort/style", request), interrupted);
  EXPECT_EQ(studio.post("/api/effort/style", request.dump()).status, 200U);
}

TEST(Work, OfTheLoopRoomCanBeStoppedAndDoneAgain) {
  Json request = {{"clip", "c0"},
                  {"state", post_json("/api/loop/open", {{"clip", "c0"}})["state"]}};
  request["state"]["kind"] = "endless";
  request["state"]["seconds"] = 60.0;
  EXPECT_THAT(client().told_when_stopped("/api/loop/make", request),
              ::testing::EndsWith("interrupted"));
  EXPECT_EQ(post("/api/loop/make", request.dump()).status, 200U);
}

}  // namespace
}  // namespace laban::studio
