#include "laban/align/unseen_costs.h"

#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/align/content_groups.h"
#include "laban/align/dtw.h"
#include "laban/align/segment_input.h"
#include "laban/base/error.h"
#include "support/clips.h"

namespace laban::align {
namespace {

using laban::test::random_pose_matrix;
using motion::PoseMatrix;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Corpus {
  std::vector<PoseMatrix> poses;
  std::vector<int> groups;
  std::vector<int> performers;

  void add(int group, int performer, unsigned manner) {
    PoseMatrix pose = random_pose_matrix({.frames = 24 + 3 * performer,
                                          .seed = static_cast<unsigned>(group + 1),
                                          .amplitude_rad = 0.5});
    pose.angles += 0.4 * random_pose_matrix({.frames = pose.frame_count(), .seed = manner}).angles;
    poses.push_back(pose);
    groups.push_back(group);
    performers.push_back(performer);
  }
};

// Two contents by four performers; performer 0 does content 0 twice.
Corpus corpus_of_four() {
  Corpus corpus;
  for (int group = 0; group < 2; ++group) {
    for (int performer = 0; performer < 4; ++performer)
      corpus.add(group, performer, static_cast<unsigned>(20 + 4 * group + performer));
  }
  corpus.add(0, 0, 77);
  return corpus;
}

Corpus without(const Corpus& corpus, int performer) {
  Corpus rest;
  for (std::size_t i = 0; i < corpus.poses.size(); ++i) {
    if (corpus.performers[i] == performer) continue;
    rest.poses.push_back(corpus.poses[i]);
    rest.groups.push_back(corpus.groups[i]);
    rest.performers.push_back(corpus.performers[i]);
  }
  return rest;
}

// Oracle: the metric is learnt anew without the performer.
TEST(UnseenCosts, AreThoseOfTheMetricLearntWithoutThePerformer) {
  const Corpus corpus = corpus_of_four();
  const Eigen::MatrixXd costs = unseen_costs(corpus.poses, corpus.groups, corpus.performers);
  for (std::size_t i = 0; i < corpus.poses.size(); ++i) {
    const Corpus rest = without(corpus, corpus.performers[i]);
    const FragmentSet set(fit_content_metric(rest.poses, rest.groups, rest.performers),
                          corpus.poses, corpus.groups, corpus.performers);
    for (std::size_t j = 0; j < corpus.poses.size(); ++j) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      if (corpus.groups[i] != corpus.groups[j] || corpus.performers[i] == corpus.performers[j]) {
        EXPECT_EQ(costs(row, column), kInfinity);
        continue;
      }
      const double expected = dtw_cost(set.features()[i], set.features()[j]).mean_cost();
      EXPECT_NEAR(costs(row, column), expected, 1e-3 * expected);  // aligned in single precision
    }
  }
}

TEST(UnseenCosts, AreDearerThanThoseOfAMetricThatKnowsEveryone) {
  const Corpus corpus = corpus_of_four();
  const FragmentSet set(fit_content_metric(corpus.poses, corpus.groups, corpus.performers),
                        corpus.poses, corpus.groups, corpus.performers);
  const auto known = group_cost_statistics(all_pair_costs(set.features()).mean_cost, corpus.groups);
  const auto unseen = group_cost_statistics(
      unseen_costs(corpus.poses, corpus.groups, corpus.performers), corpus.groups);
  ASSERT_EQ(unseen.size(), known.size());
  for (std::size_t g = 0; g < known.size(); ++g) {
    EXPECT_GT(unseen[g].median, known[g].median);
    EXPECT_GT(unseen[g].threshold, known[g].threshold);
  }
}

TEST(UnseenCosts, ComeFromAllWhereTooLittleIsLeft) {
  Corpus one = without(without(without(corpus_of_four(), 1), 2), 3);  // content 0 twice, 1 once
  const Eigen::MatrixXd costs = unseen_costs(one.poses, one.groups, one.performers);
  const FragmentSet set(fit_content_metric(one.poses, one.groups, one.performers), one.poses,
                        one.groups, one.performers);
  const double expected = dtw_cost(set.features()[0], set.features()[2]).mean_cost();
  EXPECT_NEAR(costs(0, 2), expected, 1e-3 * expected);
  EXPECT_EQ(costs(0, 1), kInfinity);
  EXPECT_EQ(costs(1, 1), kInfinity);
}

TEST(UnseenCosts, AreTheSameForAnyNumberOfThreads) {
  const Corpus corpus = corpus_of_four();
  EXPECT_EQ(unseen_costs(corpus.poses, corpus.groups, corpus.performers, {.threads = 1}),
            unseen_costs(corpus.poses, corpus.groups, corpus.performers, {.threads = 2}));
}

TEST(UnseenCosts, TellNothingWithoutTwoFragmentsOfOneContent) {
  Corpus corpus;
  corpus.add(0, 0, 20);
  corpus.add(1, 1, 21);
  const Eigen::MatrixXd costs = unseen_costs(corpus.poses, corpus.groups, corpus.performers);
  EXPECT_EQ(costs, Eigen::MatrixXd::Constant(2, 2, kInfinity));
}

std::string message_of(const Corpus& corpus) {
  try {
    (void)unseen_costs(corpus.poses, corpus.groups, corpus.performers);
  } catch (const base::Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(UnseenCosts, RefuseWhatDoesNotFitTogether) {
  Corpus corpus = corpus_of_four();
  corpus.performers.pop_back();
  EXPECT_EQ(message_of(corpus), "unseen_costs: 8 performers for 9 fragments");
  corpus.groups.clear();
  EXPECT_EQ(message_of(corpus), "unseen_costs: no fragments, or no groups");
}

}  // namespace
}  // namespace laban::align
