#include "laban/transfer/style_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/transfer/measured_misses.h"
#include "laban/transfer/play_choice.h"

#include "toy_corpus.h"

namespace laban::transfer {
namespace {

effort::EffortVector predict(const StyleModel& model, int i, int j, double alpha) {
  return effort_curve(model, i, j, {alpha}).col(0);
}

// [Torresani06, eq. 12] without what is ours.
constexpr SearchOptions kPapers = {.caution = 0.0, .stay = 0.0};

TEST(SearchBlend, IsAsGoodAsADenseScanOfAllPairs) {
  const StyleModel& model = test::toy_model();
  for (const double asked : {-1.0, 0.0, 0.7, 1.5}) {
    const EffortTarget target{{std::nullopt, asked, -0.3}, {1.0, 1.0, 1.0, 1.0}};
    const BlendChoice choice = search_blend(model, 1, target, kPapers);
    double best = 1e9;
    const auto& neighbors = model.neighbors[1];
    for (std::size_t k = 0; k < neighbors.size(); ++k) {
      best = std::min(best, target.distance_to(effort::to_vector(
                                *model.fragments[static_cast<std::size_t>(neighbors[k])].effort)));
      for (std::size_t l = k + 1; l < neighbors.size(); ++l) {
        for (int n = 0; n <= 3000; ++n) {
          best = std::min(best, target.distance_to(predict(model, neighbors[k], neighbors[l],
                                                           -0.25 + n * 0.0005)));
        }
      }
    }
    // A pair whose curve has two valleys may hide the deeper one between two samples.
    EXPECT_LE(choice.distance, best + 0.02) << "asked " << asked;
  }
}

TEST(BlendSearch, WhatWasMeasuredIsAsGoodAsADenseScanOfCorrectedPairs) {
  const StyleModel& model = test::toy_model();
  const EffortTarget target{{std::nullopt, 0.9, -0.3}, {1.0, 1.0, 1.0, 1.0}};
  const BlendSearch search(model, 1, kPapers);
  MeasuredMisses misses;
  const BlendChoice first = search.nearest_pairs(target, 1).front();
  misses.add(first, Eigen::Vector3d(0.2, -0.6, 0.4));
  const BlendChoice choice = search.best(target, misses);
  double best = 1e9;
  const auto& neighbors = model.neighbors[1];
  const auto missed_by = [&](int i, int j, double alpha) {
    const auto correction = misses.of_pairs(std::array{FragmentPair{i, j}}).front();
    return target.distance_to(predict(model, i, j, alpha) + correction.at(alpha));
  };
  for (std::size_t k = 0; k < neighbors.size(); ++k) {
    best = std::min(best, target.distance_to(effort::to_vector(
                              *model.fragments[static_cast<std::size_t>(neighbors[k])].effort)));
    for (std::size_t l = k + 1; l < neighbors.size(); ++l) {
      for (int n = 0; n <= 750; ++n)
        best = std::min(best, missed_by(neighbors[k], neighbors[l], -0.25 + n * 0.002));
    }
  }
  ASSERT_FALSE(choice.is_seed());
  EXPECT_LE(missed_by(choice.fragment_i, choice.fragment_j, choice.alpha), best + 0.02);
  // What is reported is the regressor's own.
  const auto e = predict(model, choice.fragment_i, choice.fragment_j, choice.alpha);
  EXPECT_LT((e - effort::to_vector(choice.predicted)).norm(), 1e-9);
  EXPECT_NEAR(choice.distance, target.distance_to(e), 1e-9);
  misses.settle({choice.fragment_i, choice.fragment_j});
  const BlendChoice other = search.best(target, misses);
  EXPECT_FALSE(other.fragment_i == choice.fragment_i && other.fragment_j == choice.fragment_j);
}

TEST(BlendSearch, ChoosesOnlyWhatShowsItsContent) {
  StyleModel model = test::toy_model();
  // As if one swing looked like a circle: blends with it may be swings only near the other parent.
  const int unclear = model.neighbors[1][2];
  model.content_margins[static_cast<std::size_t>(unclear)] = -3.0;
  const auto margin = [&](int k) { return model.content_margins[static_cast<std::size_t>(k)]; };
  const BlendSearch search(model, 1, kPapers);
  int with_unclear = 0;
  for (const double flow : {-2.0, -1.0, 0.0, 1.0, 2.0}) {
    for (const double weight : {-2.5, -1.0, 0.0, 1.0, 2.5}) {
      const EffortTarget target{{flow, weight, std::nullopt}, {1.0, 1.0, 1.0, 1.0}};
      std::vector<BlendChoice> choices = search.nearest_pairs(target, 100);
      choices.push_back(search.best(target));
      for (const BlendChoice& choice : choices) {
        const double a = choice.alpha;
        EXPECT_GE((1.0 - a) * margin(choice.fragment_i) + a * margin(choice.fragment_j), -1e-9);
        if (choice.fragment_i == unclear || choice.fragment_j == unclear) ++with_unclear;
      }
    }
  }
  EXPECT_GT(with_unclear, 0) << "they are not shut out";
  // What cannot be chosen is not told to be in reach.
  const EffortTarget any{{0.0, std::nullopt, std::nullopt}, {1.0, 1.0, 1.0, 1.0}};
  const auto whole = BlendSearch(test::toy_model(), 1, kPapers).best(any).reachable;
  const auto kept = search.best(any).reachable;
  for (std::size_t f = 0; f < kept.size(); ++f) {
    EXPECT_GE(kept[f].low, whole[f].low);
    EXPECT_LE(kept[f].high, whole[f].high);
  }
}

TEST(BlendSearch, WhereNoContentIsClearAllMayBeChosen) {
  StyleModel model = test::toy_model();
  std::fill(model.content_margins.begin(), model.content_margins.end(), -1.0);
  const EffortTarget target{{0.4, 0.9, std::nullopt}, {1.0, 2.0, 1.0, 1.0}};
  const BlendChoice unclear = search_blend(model, 8, target);
  const BlendChoice clear = search_blend(test::toy_model(), 8, target);
  EXPECT_EQ(unclear.fragment_i, clear.fragment_i);
  EXPECT_EQ(unclear.fragment_j, clear.fragment_j);
  EXPECT_EQ(unclear.alpha, clear.alpha);
}

TEST(BlendSearch, NearestPairsBeginWithTheBestAndGrowWorse) {
  const StyleModel& model = test::toy_model();
  const EffortTarget target{{std::nullopt, 0.9, -0.3}, {1.0, 1.0, 1.0, 1.0}};
  const BlendSearch search(model, 1, kPapers);
  const std::vector<BlendChoice> ranked = search.nearest_pairs(target, 8);
  ASSERT_EQ(ranked.size(), 8U);
  for (std::size_t n = 0; n < ranked.size(); ++n) {
    const BlendChoice& choice = ranked[n];
    EXPECT_FALSE(choice.is_seed());
    const auto e = predict(model, choice.fragment_i, choice.fragment_j, choice.alpha);
    EXPECT_NEAR(choice.distance, target.distance_to(e), 1e-9);
    if (n > 0) EXPECT_GE(choice.distance, ranked[n - 1].distance - 1e-9);
    for (std::size_t m = 0; m < n; ++m) {
      EXPECT_FALSE(choice.fragment_i == ranked[m].fragment_i &&
                   choice.fragment_j == ranked[m].fragment_j);
    }
  }
  const BlendChoice best = search.best(target);
  if (!best.is_seed()) EXPECT_LE(best.distance, ranked.front().distance + 1e-9);
  EXPECT_LT(search.nearest_pairs(target, 100000).size(), 100000U);
}

TEST(BlendSearch, OfPairReportsABlendAsTheSearchDoes) {
  const StyleModel& model = test::toy_model();
  const EffortTarget target{{0.4, 0.9, std::nullopt}, {1.0, 2.0, 1.0, 1.0}};
  const BlendSearch search(model, 8, kPapers);
  const BlendChoice found = search.best(target);
  ASSERT_FALSE(found.is_seed());
  const BlendChoice set = search.of_pair(found.fragment_i, found.fragment_j, found.alpha, target);
  EXPECT_NEAR(set.distance, found.distance, 1e-9);
  EXPECT_LT((set.features - found.features).norm(), 1e-12);
  const BlendChoice seed = search.of_pair(found.fragment_i, found.fragment_i, 0.0, target);
  EXPECT_TRUE(seed.is_seed());
  EXPECT_EQ(seed.predicted.weight,
            model.fragments[static_cast<std::size_t>(found.fragment_i)].effort->weight);
}

TEST(BlendSearch, OfPairRefusesWhatCannotBeBlendedHere) {
  const StyleModel& model = test::toy_model();
  const BlendSearch search(model, 0, kPapers);
  int other = 0;
  while (model.fragments[static_cast<std::size_t>(other)].content == model.fragments[0].content)
    ++other;
  const auto refused = [&](int i, int j, double alpha) {
    EXPECT_THROW((void)search.of_pair(i, j, alpha, {}), base::Error) << i << " " << j;
  };
  refused(0, 9999, 0.5);
  refused(-1, 0, 0.5);
  refused(0, other, 0.5);
  refused(0, 1, 1.3);
  refused(0, 1, std::nan(""));
  refused(0, 0, 0.5);
}

TEST(SearchBlend, PredictionIsTheRegressorsOwnAndDistanceIsItsError) {
  const StyleModel& model = test::toy_model();
  const EffortTarget target{{0.4, 0.9, std::nullopt}, {1.0, 2.0, 1.0, 1.0}};
  const BlendChoice choice = search_blend(model, 8, target, kPapers);
  ASSERT_FALSE(choice.is_seed());
  const effort::EffortVector e = predict(model, choice.fragment_i, choice.fragment_j, choice.alpha);
  EXPECT_LT((e - effort::to_vector(choice.predicted)).norm(), 1e-9);
  EXPECT_NEAR(choice.distance, target.distance_to(e), 1e-9);
  for (const effort::Factor factor : effort::kFactors) {
    const auto& range = choice.reachable[static_cast<std::size_t>(effort::index_of(factor))];
    EXPECT_GE(choice.predicted[factor], range.low);
    EXPECT_LE(choice.predicted[factor], range.high);
  }
}

TEST(SearchBlend, HitsSpaceWhereItIsLabelledAndRefusesItElsewhere) {
  StyleCorpus corpus = test::toy_corpus();
  const auto label = [](std::optional<effort::Effort>& effort) {
    effort->space = std::clamp(2.0 * effort->time - effort->weight, -3.0, 3.0);
  };
  for (Fragment& fragment : corpus.fragments) label(fragment.effort);
  for (CorpusBlend& blend : corpus.blends) label(blend.effort);
  corpus.factor_count = effort::kMaxFactorCount;
  const StyleModel model =
      read_style_model(write_style_model(train_style_model(corpus)), "space.laban");
  EXPECT_EQ(model.factors().size(), 4U);
  EXPECT_EQ(model.fragments[2].effort->space, corpus.fragments[2].effort->space);
  EffortTarget target;
  for (const double asked : {-0.8, 0.2, 0.9}) {
    target.factors = {std::nullopt, std::nullopt, std::nullopt, asked};
    const BlendChoice choice = search_blend(model, 1, target, kPapers);
    EXPECT_NEAR(choice.predicted.space, asked, 0.05);
    ASSERT_EQ(choice.reachable.size(), 4U);
    EXPECT_LE(choice.reachable[3].low, asked);
    EXPECT_GE(choice.reachable[3].high, asked);
  }
  // The same table, its column Space not looked at.
  EXPECT_THROW((void)search_blend(test::toy_model(), 1, target, kPapers), base::Error);
}

TEST(SearchBlend, WithCautionTheExpectedSquaredDistanceIsTheLeast) {
  const StyleModel& model = test::toy_model();
  for (const double asked : {-1.0, 0.0, 0.7, 1.5}) {
    const EffortTarget target{{std::nullopt, asked, -0.3}, {1.0, 1.0, 1.0, 1.0}};
    const auto expected = [&](const effort::EffortVector& e, double alpha) {
      const double alphas[] = {alpha};
      const effort::EffortVector error = model.regressor.typical_errors(alphas).col(0);
      return std::pow(target.distance_to(e), 2) + std::pow(error[1], 2) + std::pow(error[2], 2);
    };
    const BlendChoice choice = search_blend(model, 1, target, {.stay = 0.0});
    const double found = choice.is_seed()
                             ? std::pow(choice.distance, 2)
                             : expected(effort::to_vector(choice.predicted), choice.alpha);
    double best = 1e9;
    const auto& neighbors = model.neighbors[1];
    for (std::size_t k = 0; k < neighbors.size(); ++k) {
      const auto& seed = *model.fragments[static_cast<std::size_t>(neighbors[k])].effort;
      best = std::min(best, std::pow(target.distance_to(effort::to_vector(seed)), 2));
      for (std::size_t l = k + 1; l < neighbors.size(); ++l) {
        for (int n = 0; n <= 750; ++n) {
          const double alpha = -0.25 + n * 0.002;
          best = std::min(best, expected(predict(model, neighbors[k], neighbors[l], alpha), alpha));
        }
      }
    }
    EXPECT_LE(std::sqrt(found), std::sqrt(best) + 0.02) << "asked " << asked;
  }
}

TEST(SearchBlend, FactorsLeftFreeStayNearWhatTheyWere) {
  const StyleModel& model = test::toy_model();
  double moved = 0.0;
  double moved_freely = 0.0;
  for (int fragment = 0; fragment < 12; ++fragment) {
    const effort::Effort own = *model.fragments[static_cast<std::size_t>(fragment)].effort;
    EffortTarget target{{std::nullopt, 0.8, std::nullopt}, {1.0, 1.0, 1.0, 1.0}};
    const auto others = [&](const BlendChoice& choice) {
      return std::abs(choice.predicted.flow - own.flow) +
             std::abs(choice.predicted.time - own.time);
    };
    moved_freely += others(search_blend(model, fragment, target));
    target.stay_near = own;
    moved += others(search_blend(model, fragment, target));
  }
  EXPECT_LT(moved, 0.7 * moved_freely);
}

TEST(SearchBlend, ASeedsOwnLabelIsReachedExactly) {
  const StyleModel& model = test::toy_model();
  const effort::Effort label = *model.fragments[4].effort;
  const EffortTarget target{{label.flow, label.weight, label.time}, {1.0, 1.0, 1.0, 1.0}};
  EXPECT_EQ(search_blend(model, 4, target).distance, 0.0);
}

TEST(SearchBlend, OneNeighbourLeavesTheFragmentItself) {
  const EffortTarget target{{std::nullopt, 3.0, std::nullopt}, {1.0, 1.0, 1.0, 1.0}};
  const BlendChoice choice = search_blend(test::toy_model(), 5, target, {.neighbors = 1});
  EXPECT_TRUE(choice.is_seed());
  EXPECT_EQ(choice.fragment_i, 5);
}

// All three factors at once: more than two fragments can be blended to in general.
TEST(SearchBlend, FurtherFragmentsComeNearerWhereTwoMiss) {
  const StyleModel& model = test::toy_model();
  int better = 0;
  for (int fragment = 0; fragment < 12; ++fragment) {
    const EffortTarget target{{-0.3 + 0.1 * fragment, 0.8, -0.4}, {1.0, 1.0, 1.0, 1.0}};
    const BlendChoice two = search_blend(model, fragment, target, kPapers);
    double previous = two.distance;
    for (const int way : {3, 4}) {
      const BlendChoice more = search_blend(model, fragment, target, {.way = way, .caution = 0.0});
      EXPECT_LE(more.distance, previous);
      previous = more.distance;
      EXPECT_LE(static_cast<int>(more.shares().size()), way);
      if (more.further.empty()) {
        EXPECT_EQ(more.distance, two.distance);
        continue;
      }
      EXPECT_LT(more.distance, two.distance - kLeastGain);
      EXPECT_NEAR(more.distance, target.distance_to(effort::to_vector(more.predicted)), 1e-12);
      ++better;
    }
  }
  EXPECT_GE(better, 6);
}

TEST(SearchBlend, TwoWaysAreThePapersWhateverMoreCouldDo) {
  const EffortTarget easy{{std::nullopt, 0.3, std::nullopt}, {1.0, 1.0, 1.0, 1.0}};
  const BlendChoice two = search_blend(test::toy_model(), 1, easy, kPapers);
  ASSERT_LT(two.distance, kMissedBy);
  const BlendChoice three = search_blend(test::toy_model(), 1, easy, {.way = 3, .caution = 0.0});
  EXPECT_TRUE(three.further.empty());
  EXPECT_EQ(three.alpha, two.alpha);
}

TEST(BlendChoice, SharesOfANestSumToOne) {
  BlendChoice choice;
  choice.fragment_i = 4;
  choice.fragment_j = 7;
  choice.alpha = 0.25;
  choice.further = {{9, 0.5}, {2, -0.2}};
  const std::vector<BlendShare> shares = choice.shares();
  ASSERT_EQ(shares.size(), 4U);
  EXPECT_DOUBLE_EQ(shares[0].weight, 0.75 * 0.5 * 1.2);
  EXPECT_DOUBLE_EQ(shares[1].weight, 0.25 * 0.5 * 1.2);
  EXPECT_DOUBLE_EQ(shares[2].weight, 0.5 * 1.2);
  EXPECT_DOUBLE_EQ(shares[3].weight, -0.2);
  EXPECT_EQ(shares[3].fragment, 2);
}

// A nest in which the last fragment has no weight is the pair, played alike.
TEST(PlayChoice, AFurtherFragmentWithoutWeightChangesNothing) {
  const StyleModel& model = test::toy_model();
  BlendChoice pair;
  pair.fragment_i = 1;
  pair.fragment_j = 3;
  pair.alpha = 0.4;
  BlendChoice nest = pair;
  nest.further = {{4, 0.0}};
  const PlayedChoice a = play_choice(model, pair);
  const PlayedChoice b = play_choice(model, nest);
  ASSERT_EQ(a.pose.frame_count(), b.pose.frame_count());
  EXPECT_LT((a.pose.angles - b.pose.angles).cwiseAbs().maxCoeff(), 1e-6);
  ASSERT_EQ(b.parts.size(), 3U);
  for (std::size_t n = 0; n < 2; ++n) {
    for (std::size_t k = 0; k < a.parts[n].frames.size(); ++k)
      EXPECT_NEAR(a.parts[n].frames[k], b.parts[n].frames[k], 1e-9);
  }
}

TEST(PlayChoice, EveryPartOfANestGoesByFromItsFirstFrameToItsLast) {
  const StyleModel& model = test::toy_model();
  BlendChoice nest;
  nest.fragment_i = 1;
  nest.fragment_j = 3;
  nest.alpha = 0.4;
  nest.further = {{4, 0.5}};
  const PlayedChoice played = play_choice(model, nest);
  ASSERT_EQ(played.parts.size(), 3U);
  for (const PlayedPart& part : played.parts) {
    const int frames = model.fragments[static_cast<std::size_t>(part.fragment)].pose.frame_count();
    ASSERT_EQ(static_cast<int>(part.frames.size()), played.pose.frame_count());
    EXPECT_TRUE(std::is_sorted(part.frames.begin(), part.frames.end()));
    EXPECT_EQ(part.frames.front(), 0.0);
    EXPECT_NEAR(part.frames.back(), frames - 1.0, 1e-9);
  }
}

TEST(StandardErrors, AreTheRegressorsOwnAndNoneOfAFragmentItself) {
  const StyleModel& model = test::toy_model();
  const EffortTarget target{{0.4, 0.9, std::nullopt}, {1.0, 1.0, 1.0, 1.0}};
  const BlendChoice choices[] = {search_blend(model, 8, target, kPapers),
                                 search_blend(model, 8, target, {.neighbors = 1})};
  const auto errors = standard_errors(model, choices);
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_EQ(errors[1], std::nullopt);
  const auto own = model.regressor.predict_with_error(choices[0].features);
  ASSERT_EQ(errors[0].has_value(), own.has_value());
  if (own) EXPECT_EQ(effort::to_vector(*errors[0]), own->standard_error.col(0));
}

TEST(SearchBlend, RefusesTargetsThatAskForNothingOrTooMuch) {
  EXPECT_THROW((void)search_blend(test::toy_model(), 0, {}), base::Error);
  EXPECT_THROW((void)search_blend(test::toy_model(), 0,
                                  {{3.5, std::nullopt, std::nullopt}, {1.0, 1.0, 1.0, 1.0}}),
               base::Error);
}

}  // namespace
}  // namespace laban::transfer
