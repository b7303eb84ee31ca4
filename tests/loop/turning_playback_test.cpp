#include "laban/loop/turning_playback.h"

#include <algorithm>
#include <numeric>

#include <gmock/gmock.h>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

PlaybackPlan plan() {
  PlaybackPlan plan;
  plan.frame_count = 201;
  plan.turns = {{50, 0.5, 4}, {100, 0.4, 4}, {150, 0.45, 4}};
  plan.first.ease = 3;
  plan.last.ease = 3;
  return plan;
}

TEST(TurningPlayback, TurnsAtTheEndsWhereNothingElseIsToBeDone) {
  PlaybackPlan plain = plan();
  plain.turns.clear();
  TurningPlayback playback(plain, base::Rng(1));
  const PlaybackLeg there = playback.next();
  EXPECT_EQ(there.from, 0);
  EXPECT_EQ(there.to, 200);
  EXPECT_EQ(there.ease_from, 0);
  EXPECT_EQ(there.ease_to, 3);
  const PlaybackLeg back = playback.next();
  EXPECT_EQ(back.from, 200);
  EXPECT_EQ(back.to, 0);
  EXPECT_EQ(back.ease_from, 3);
}

TEST(TurningPlayback, LegsMeetAndLeaveRoomForTheirEasing) {
  PlaybackPlan crowded = plan();
  for (int f = 10; f < 195; f += 5) crowded.turns.push_back({f, 0.5, 1 + f % 9});
  std::sort(crowded.turns.begin(), crowded.turns.end(),
            [](const PlaybackTurn& a, const PlaybackTurn& b) { return a.frame < b.frame; });
  crowded.leaps = {{130, 40}, {160, 30}};
  for (unsigned seed = 1; seed <= 20; ++seed) {
    TurningPlayback playback(crowded, base::Rng(seed));
    PlaybackLeg before = playback.next();
    for (int n = 0; n < 500; ++n) {
      const PlaybackLeg leg = playback.next();
      ASSERT_GE(std::abs(leg.to - leg.from), leg.ease_from + leg.ease_to);
      if (before.leap) {
        ASSERT_EQ(before.to, crowded.leaps[static_cast<std::size_t>(*before.leap)].out_begin);
        ASSERT_EQ(leg.from, crowded.leaps[static_cast<std::size_t>(*before.leap)].in_end);
        ASSERT_GT(leg.to, leg.from);  // forwards goes on
      } else {
        ASSERT_EQ(leg.from, before.to);
        ASSERT_EQ(leg.ease_from, before.ease_to);
        ASSERT_EQ(leg.to > leg.from, before.to < before.from);
      }
      before = leg;
    }
  }
}

TEST(TurningPlayback, DoesNotTakeTheSameTurnAgainAndAgain) {
  // With a step of 1 a point that has turned has k = 0: it passes next time, whatever its P_max.
  PlaybackPlan sure = plan();
  sure.turns = {{100, 1.0, 2}};
  sure.probability_step = 1.0;
  TurningPlayback playback(sure, base::Rng(3));
  EXPECT_EQ(playback.next().to, 100);  // P = 1
  EXPECT_EQ(playback.next().to, 0);
  EXPECT_EQ(playback.next().to, 200);  // k = 0
}

TEST(TurningPlayback, ShowsAllOfTheClipAboutEvenly) {
  PlaybackPlan leaping = plan();
  leaping.leaps = {{120, 60}, {130, 70}};
  for (unsigned seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    TurningPlayback playback(leaping, base::Rng(seed));
    while (std::accumulate(playback.shown().begin(), playback.shown().end(), 0.0) < 8.0 * 201) {
      (void)playback.next();
    }
    const auto& shown = playback.shown();
    const double mean = std::accumulate(shown.begin(), shown.end(), 0.0) / 201.0;
    EXPECT_GT(*std::min_element(shown.begin(), shown.end()), 0.0);
    EXPECT_LT(*std::max_element(shown.begin(), shown.end()), 3.0 * mean);
  }
}

TEST(TurningPlayback, LeapsWhereTheEndIsNoPlaceToTurn) {
  PlaybackPlan lively = plan();
  lively.turns.clear();
  lively.leaps = {{120, 60}, {160, 30}};
  lively.last_turns = false;
  lively.turns_at_all = false;
  TurningPlayback playback(lively, base::Rng(5));
  for (int n = 0; n < 200; ++n) EXPECT_TRUE(playback.next().leap.has_value());
}

TEST(TurningPlayback, RefusesPlansThatDoNotFitTheClip) {
  PlaybackPlan bad = plan();
  bad.turns.push_back({300, 0.5, 1});
  EXPECT_THROW(TurningPlayback(bad, base::Rng(1)), base::Error);
  bad = plan();
  bad.leaps = {{-1, 5}};
  EXPECT_THROW(TurningPlayback(bad, base::Rng(1)), base::Error);
  bad = plan();
  bad.frame_count = 1;
  EXPECT_THROW(TurningPlayback(bad, base::Rng(1)), base::Error);
}

}  // namespace
}  // namespace laban::loop
