#include "laban/transfer/choose_blend.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "toy_corpus.h"

namespace laban::transfer {
namespace {

/// Targets for one factor, the others to stay as the fragment has them.
std::vector<EffortTarget> targets_of(const StyleModel& model, int fragment) {
  std::vector<EffortTarget> targets;
  for (std::size_t f = 0; f < effort::kFactorCount; ++f) {
    for (const double asked : {-1.5, 0.0, 1.5}) {
      EffortTarget& target = targets.emplace_back();
      target.factors[f] = asked;
      target.stay_near = model.fragments[static_cast<std::size_t>(fragment)].effort;
    }
  }
  return targets;
}

/// What choose_blend lowers, of what was measured.
double missed(const EffortTarget& target, const effort::Effort& measured) {
  double sum = 0.0;
  for (const effort::Factor factor : effort::kFactors) {
    const auto f = static_cast<std::size_t>(effort::index_of(factor));
    const double wanted = target.factors[f] ? *target.factors[f] : (*target.stay_near)[factor];
    const double weight = target.factors[f] ? 1.0 : SearchOptions{}.stay;
    sum += weight * (wanted - measured[factor]) * (wanted - measured[factor]);
  }
  return std::sqrt(sum);
}

TEST(ChooseBlend, OneTryIsTheFirstAnswerOfTheSearch) {
  const StyleModel& model = test::measured_toy_model();
  PlayMemory memory(model);
  for (const EffortTarget& target : targets_of(model, 2)) {
    const ChosenBlend chosen = choose_blend(memory, 2, target, {}, 1);
    const BlendChoice first = search_blend(model, 2, target);
    EXPECT_EQ(chosen.choice.fragment_i, first.fragment_i);
    EXPECT_EQ(chosen.choice.fragment_j, first.fragment_j);
    EXPECT_EQ(chosen.choice.alpha, first.alpha);
    EXPECT_EQ(chosen.played.pose.angles, play_choice(model, first).pose.angles);
  }
}

TEST(ChooseBlend, MoreTriesMeasureNearer) {
  const StyleModel& model = test::measured_toy_model();
  ASSERT_TRUE(model.labels_measured);
  PlayMemory memory(model);
  double by_one = 0.0;
  double by_all = 0.0;
  for (int fragment = 0; fragment < static_cast<int>(model.fragments.size()); fragment += 2) {
    for (const EffortTarget& target : targets_of(model, fragment)) {
      double before = 0.0;
      for (const int tries : {1, 2, 3, 6}) {
        const ChosenBlend chosen = choose_blend(memory, fragment, target, {}, tries);
        const double now = missed(target, chosen.measured.effort);
        if (tries > 1) EXPECT_LE(now, before + 1e-12) << "fragment " << fragment;
        before = now;
        if (tries == 1) by_one += now;
        if (tries == kTries) by_all += now;
        EXPECT_NEAR(chosen.choice.distance,
                    target.distance_to(effort::to_vector(chosen.choice.predicted)), 1e-12);
        const effort::Effort again =
            effort::observe(effort::describe(play_choice(model, chosen.choice).pose),
                            model.observer,
                            model.fragments[static_cast<std::size_t>(fragment)].content)
                .effort;
        EXPECT_EQ(again, chosen.measured.effort);
      }
    }
  }
  EXPECT_LT(by_all, 0.9 * by_one);
}

TEST(ChooseBlend, NoBlendIsTriedTwice) {
  const StyleModel& model = test::measured_toy_model();
  PlayMemory memory(model);
  for (const EffortTarget& target : targets_of(model, 3)) {
    // With more tries than blends are worth trying it ends, and more still change nothing.
    const ChosenBlend many = choose_blend(memory, 3, target, {}, 200);
    const ChosenBlend more = choose_blend(memory, 3, target, {}, 1000);
    EXPECT_EQ(many.played.pose.angles, more.played.pose.angles);
  }
}

TEST(ChooseBlend, WhatRatersSayIsNotWhatIsMeasured) {
  const StyleModel& model = test::toy_model();
  ASSERT_FALSE(model.labels_measured);
  PlayMemory memory(model);
  for (const EffortTarget& target : targets_of(model, 1)) {
    const ChosenBlend one = choose_blend(memory, 1, target, {}, 1);
    const ChosenBlend more = choose_blend(memory, 1, target, {}, kTries);
    EXPECT_EQ(one.played.pose.angles, more.played.pose.angles);
  }
}

TEST(ChooseBlend, AModelFileTellsWhetherItsLabelsAreMeasured) {
  for (const StyleModel* model : {&test::measured_toy_model(), &test::toy_model()}) {
    EXPECT_EQ(read_style_model(write_style_model(*model), "a.laban").labels_measured,
              model->labels_measured);
  }
}

TEST(ChooseBlend, RefusesWhatTheSearchRefuses) {
  PlayMemory memory(test::measured_toy_model());
  EXPECT_THROW(static_cast<void>(choose_blend(memory, 0, {})), base::Error);
  EXPECT_THROW(
      static_cast<void>(choose_blend(memory, 99, targets_of(test::measured_toy_model(), 0)[0])),
      base::Error);
}

}  // namespace
}  // namespace laban::transfer
