#include "laban/transfer/style_search.h"

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "toy_corpus.h"

namespace laban::transfer {
namespace {

effort::EffortVector predict(const StyleModel& model, int i, int j, double alpha) {
  return effort_curve(model, i, j, {alpha}).col(0);
}

TEST(SearchBlend, IsAsGoodAsADenseScanOfAllPairs) {
  const StyleModel& model = test::toy_model();
  for (const double asked : {-1.0, 0.0, 0.7, 1.5}) {
    const EffortTarget target{{std::nullopt, asked, -0.3}, {1.0, 1.0, 1.0}};
    const BlendChoice choice = search_blend(model, 1, target);
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

TEST(SearchBlend, PredictionIsTheRegressorsOwnAndDistanceIsItsError) {
  const StyleModel& model = test::toy_model();
  const EffortTarget target{{0.4, 0.9, std::nullopt}, {1.0, 2.0, 1.0}};
  const BlendChoice choice = search_blend(model, 8, target);
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

TEST(SearchBlend, ASeedsOwnLabelIsReachedExactly) {
  const StyleModel& model = test::toy_model();
  const effort::Effort label = *model.fragments[4].effort;
  const EffortTarget target{{label.flow, label.weight, label.time}, {1.0, 1.0, 1.0}};
  EXPECT_EQ(search_blend(model, 4, target).distance, 0.0);
}

TEST(SearchBlend, OneNeighbourLeavesTheFragmentItself) {
  const EffortTarget target{{std::nullopt, 3.0, std::nullopt}, {1.0, 1.0, 1.0}};
  const BlendChoice choice = search_blend(test::toy_model(), 5, target, {.neighbors = 1});
  EXPECT_TRUE(choice.is_seed());
  EXPECT_EQ(choice.fragment_i, 5);
}

TEST(SearchBlend, RefusesTargetsThatAskForNothingOrTooMuch) {
  EXPECT_THROW((void)search_blend(test::toy_model(), 0, {}), base::Error);
  EXPECT_THROW((void)search_blend(test::toy_model(), 0,
                                  {{3.5, std::nullopt, std::nullopt}, {1.0, 1.0, 1.0}}),
               base::Error);
}

}  // namespace
}  // namespace laban::transfer
