#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/math/statistics.h"
#include "laban/texture/learn_texture.h"
#include "support/listener.h"

#include "samples.h"

namespace laban::texture {
namespace {

using Eigen::MatrixXd;
using test::known_corpus;
using test::KnownCorpus;
using test::labels_of;
using ::testing::HasSubstr;

TextureLearning four_states(double threshold) {
  TextureLearning options;
  options.threshold = threshold;
  options.fit.min_dimension = 4;
  options.fit.max_dimension = 4;
  return options;
}

/// Share of the true cuts inside takes that have a found one within five frames.
double cuts_found(const KnownCorpus& corpus, const std::vector<Segment>& segments) {
  int cuts = 0;
  int found = 0;
  for (const Segment& truth : corpus.segments) {
    if (std::any_of(corpus.takes.begin(), corpus.takes.end(),
                    [&](const Take& take) { return take.begin == truth.begin; }))
      continue;
    ++cuts;
    found += std::any_of(
                 segments.begin(), segments.end(),
                 [&](const Segment& segment) { return std::abs(segment.begin - truth.begin) <= 5; })
                 ? 1
                 : 0;
  }
  return static_cast<double>(found) / cuts;
}

class KnownTextons : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(KnownTextons, AreFoundWithTheirCuts) {
  const KnownCorpus corpus = known_corpus(5, 4, 12, GetParam());
  // Twice their own one-step error; other textons' is many times that.
  const LearntTextons learnt = learn_textons(corpus.observations, corpus.takes, four_states(0.1));
  EXPECT_EQ(learnt.report.end, LearningEnd::kConverged);
  EXPECT_GE(math::adjusted_rand_index(labels_of(corpus.segments), labels_of(learnt.segments)),
            0.95);
  EXPECT_GE(cuts_found(corpus, learnt.segments), 0.95);
}
INSTANTIATE_TEST_SUITE_P(Corpora, KnownTextons, ::testing::Values(1, 2, 3));

TEST(LearnTextons, BicFindsHowManyThereAre) {
  const KnownCorpus corpus = known_corpus(4, 4, 12, 7);
  TextureLearning options = four_states(0.0);
  options.threshold.reset();
  const LearntTextons learnt = learn_textons(corpus.observations, corpus.takes, options);
  EXPECT_EQ(learnt.textons.size(), 4U);
  ASSERT_GE(learnt.report.candidates.size(), 5U);
  for (const LearningCandidate& chosen : learnt.report.candidates) {
    if (chosen.threshold != learnt.report.threshold) continue;
    for (const LearningCandidate& other : learnt.report.candidates) {
      EXPECT_LE(chosen.bic, other.bic);
    }
  }
}

TEST(LearnTextons, StartsWithTheNumberAskedFor) {
  const KnownCorpus corpus = known_corpus(6, 3, 8, 8);
  for (const int wanted : {1, 3, 6, 12}) {
    TextureLearning options = four_states(0.0);
    options.threshold.reset();
    options.textons = wanted;
    EXPECT_EQ(learn_textons(corpus.observations, corpus.takes, options).report.start_textons,
              wanted);
  }
}

/// Motion that no texton fits well, so that rounds have something to do.
KnownCorpus hard_corpus() {
  KnownCorpus corpus = known_corpus(8, 4, 10, 11);
  base::Rng rng(12);
  corpus.observations += 0.15 * test::normal_matrix(20, corpus.observations.cols(), rng);
  return corpus;
}

TEST(LearnTextons, TheLikelihoodNeverFallsFromRoundToRound) {
  const KnownCorpus corpus = hard_corpus();
  int rounds = 0;
  for (const double threshold : {0.2, 0.5, 0.9}) {
    const LearntTextons learnt =
        learn_textons(corpus.observations, corpus.takes, four_states(threshold));
    double before = learnt.report.start_log_likelihood;
    for (const LearningRound& round : learnt.report.rounds) {
      EXPECT_GE(round.log_likelihood, before - 1e-9 * std::abs(before));
      before = round.log_likelihood;
      ++rounds;
    }
    EXPECT_NEAR(before,
                log_likelihood(corpus.observations, corpus.takes, learnt.segments, learnt.textons,
                               learnt.transition_counts),
                1e-6 * std::abs(before));
  }
  EXPECT_GT(rounds, 3);
}

TEST(LearnTextons, SegmentsCoverTakesAndNeverCrossThem) {
  const KnownCorpus corpus = hard_corpus();
  const LearntTextons learnt = learn_textons(corpus.observations, corpus.takes, four_states(0.5));
  std::size_t at = 0;
  MatrixXd counts =
      MatrixXd::Zero(learnt.transition_counts.rows(), learnt.transition_counts.cols());
  for (const Take& take : corpus.takes) {
    int frame = take.begin;
    int before = -1;
    while (frame < take.begin + take.length) {
      const Segment& segment = learnt.segments.at(at++);
      EXPECT_EQ(segment.begin, frame);
      EXPECT_GE(segment.length, 60);
      if (before >= 0) counts(before, segment.texton) += 1.0;
      before = segment.texton;
      frame += segment.length;
    }
    EXPECT_EQ(frame, take.begin + take.length);
  }
  EXPECT_EQ(at, learnt.segments.size());
  EXPECT_EQ(counts, learnt.transition_counts);
}

TEST(LearnTextons, ThreadsDoNotChangeTheResult) {
  const KnownCorpus corpus = hard_corpus();
  TextureLearning options = four_states(0.5);
  options.threads = 1;
  const LearntTextons one = learn_textons(corpus.observations, corpus.takes, options);
  options.threads = 4;
  const LearntTextons four = learn_textons(corpus.observations, corpus.takes, options);
  EXPECT_EQ(labels_of(one.segments), labels_of(four.segments));
  ASSERT_EQ(one.textons.size(), four.textons.size());
  for (std::size_t i = 0; i < one.textons.size(); ++i)
    EXPECT_EQ(one.textons[i].dynamics.a1, four.textons[i].dynamics.a1);
}

TEST(LearnTextons, GoesOnFromAKeptStateToTheSameEnd) {
  const KnownCorpus corpus = hard_corpus();
  const TextureLearning options = four_states(0.5);
  std::vector<LearntTextons> states;
  const LearntTextons whole =
      learn_textons(corpus.observations, corpus.takes, options, nullptr,
                    [&](const LearntTextons& state) { states.push_back(state); });
  ASSERT_GE(states.size(), 2U);
  const LearntTextons rest =
      learn_textons(corpus.observations, corpus.takes, options, nullptr, {}, &states.front());
  EXPECT_EQ(labels_of(rest.segments), labels_of(whole.segments));
  EXPECT_EQ(rest.report.rounds.size(), whole.report.rounds.size());
}

TEST(LearnTextons, TellsProgressAndCanBeStopped) {
  const KnownCorpus corpus = known_corpus(3, 2, 4, 1);
  TextureLearning options = four_states(0.0);
  options.threshold.reset();
  laban::test::expect_told_and_stopped(6, [&](base::Progress* progress) {
    (void)learn_textons(corpus.observations, corpus.takes, options, progress);
  });
}

TEST(LearnTextons, ATakeShorterThanASegmentIsOneSegment) {
  KnownCorpus corpus = known_corpus(2, 1, 2, 3);
  const int frames = static_cast<int>(corpus.observations.cols());
  corpus.takes = {{"long", 0, frames - 20, 0, 1.0}, {"short", frames - 20, 20, 0, 1.0}};
  const LearntTextons learnt = learn_textons(corpus.observations, corpus.takes, four_states(0.1));
  EXPECT_EQ(learnt.segments.back().begin, frames - 20);
  EXPECT_EQ(learnt.segments.back().length, 20);
}

TEST(LearnTextons, RefusesWhatItCannotLearnFrom) {
  const KnownCorpus corpus = known_corpus(2, 2, 2, 1);
  const auto message = [&](std::vector<Take> takes, const TextureLearning& options) {
    try {
      (void)learn_textons(corpus.observations, takes, options);
    } catch (const base::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const int frames = static_cast<int>(corpus.observations.cols());
  EXPECT_THAT(message({}, {}), HasSubstr("no take"));
  EXPECT_THAT(message({{"a.bvh", 0, 2, 0, 1.0}, {"b.bvh", 2, frames - 2, 0, 1.0}}, {}),
              HasSubstr("a.bvh: 2 frames are too few"));
  EXPECT_THAT(message({{"a.bvh", 0, frames - 1, 0, 1.0}}, {}), HasSubstr("do not cover"));
  TextureLearning options;
  options.min_frames = 2;
  EXPECT_THAT(message(corpus.takes, options), HasSubstr("min_frames = 2 (must be >= 3)"));
  options = {};
  options.threshold = 0.1;
  options.textons = 3;
  EXPECT_THAT(message(corpus.takes, options), HasSubstr("exclude each other"));
}

}  // namespace
}  // namespace laban::texture
