#include "laban/transfer/style_corpus.h"

#include <set>

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "toy_corpus.h"

namespace laban::transfer {
namespace {

TEST(DrawBlends, PairsFragmentsOfOneContentAndNoPairTwice) {
  const StyleCorpus corpus = test::toy_corpus(0);
  const auto blends = draw_blends(corpus.fragments, {.count = 30, .seed = 5});  // 2 * C(6, 2) pairs
  ASSERT_EQ(blends.size(), 30U);
  std::set<std::pair<int, int>> pairs;
  for (const CorpusBlend& blend : blends) {
    EXPECT_EQ(corpus.fragments[static_cast<std::size_t>(blend.fragment_i)].content,
              corpus.fragments[static_cast<std::size_t>(blend.fragment_j)].content);
    EXPECT_GE(blend.alpha, -0.25);
    EXPECT_LE(blend.alpha, 1.25);
    EXPECT_TRUE(pairs.insert(std::minmax(blend.fragment_i, blend.fragment_j)).second);
  }
}

TEST(DrawBlends, IsTheSameForTheSameSeedOnly) {
  const StyleCorpus corpus = test::toy_corpus(0);
  const auto alphas = [&](std::uint64_t seed) {
    std::vector<double> found;
    for (const auto& blend : draw_blends(corpus.fragments, {.count = 10, .seed = seed}))
      found.push_back(blend.alpha);
    return found;
  };
  EXPECT_EQ(alphas(1), alphas(1));
  EXPECT_NE(alphas(1), alphas(2));
}

TEST(AlignPair, BlendsEndInTheParentsThemselves) {
  const StyleCorpus corpus = test::toy_corpus(0);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      if (i == j) continue;
      const auto& pose_i = corpus.fragments[static_cast<std::size_t>(i)].pose;
      const auto at_zero =
          blend::blend(align_pair(pose_i, corpus.fragments[static_cast<std::size_t>(j)].pose), 0.0)
              .pose;
      ASSERT_EQ(at_zero.frame_count(), pose_i.frame_count());
      EXPECT_LT((at_zero.angles - pose_i.angles).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

TEST(AlignPair, RefusesClipsOfTooDifferentLengths) {
  const auto slow = test::toy_clip(false, 1.0, 0.2, 0.0);
  const auto quick = test::toy_clip(false, 1.0, 2.0, 0.0);
  EXPECT_THROW((void)align_pair(slow, quick), base::Error);
}

TEST(StyleSamples, WeighByConfidenceAndGroupTheLabelsOfOneBlend) {
  StyleCorpus corpus = test::toy_corpus(3);
  const auto map = fit_corpus_content_map(corpus.fragments);
  const auto coordinates = content_coordinates(corpus.fragments, map);
  for (CorpusBlend& blend : corpus.blends) blend.weight = 0.3;
  const auto plain = style_samples(corpus, coordinates);
  EXPECT_TRUE(plain.groups.empty());
  EXPECT_EQ(plain.weights.size(), 0);  // equal weights are none

  CorpusBlend second = corpus.blends[1];  // another observer's word
  second.effort->flow = -1.0;
  second.weight = 0.9;
  corpus.blends.push_back(second);
  const auto both = style_samples(corpus, coordinates);
  EXPECT_EQ(both.groups, (std::vector<int>{0, 1, 2, 1}));
  EXPECT_EQ(both.features.col(1), both.features.col(3));
  EXPECT_EQ(both.labels(0, 3), -1.0);
  ASSERT_EQ(both.weights.size(), 4);
  EXPECT_NEAR(both.weights.mean(), 1.0, 1e-15);
  EXPECT_NEAR(both.weights[3] / both.weights[0], 3.0, 1e-12);
  EXPECT_NO_THROW(both.check());
  EXPECT_NEAR(both.subset(std::vector{3, 0}).weights[0], both.weights[3], 1e-15);

  corpus.blends[0].weight = 0.0;
  EXPECT_THROW(corpus.check(), base::Error);
  auto broken = both;
  broken.weights[2] = -1.0;
  EXPECT_THROW(broken.check(), base::Error);
  broken.weights.resize(2);
  EXPECT_THROW(broken.check(), base::Error);
}

TEST(StyleSamples, NameTheBlendThatHasNoLabel) {
  StyleCorpus corpus = test::toy_corpus(3);
  corpus.blends[1].effort.reset();
  const auto map = fit_corpus_content_map(corpus.fragments);
  try {
    (void)style_samples(corpus, content_coordinates(corpus.fragments, map));
    FAIL();
  } catch (const base::Error& error) {
    EXPECT_NE(std::string(error.what()).find("blend_002"), std::string::npos);
  }
}

TEST(StyleCorpus, RefusesParentsOfTwoContents) {
  StyleCorpus corpus = test::toy_corpus(3);
  corpus.blends[0].fragment_i = 0;
  corpus.blends[0].fragment_j = 11;
  EXPECT_THROW(corpus.check(), base::Error);
}

}  // namespace
}  // namespace laban::transfer
