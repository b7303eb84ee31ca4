#include "laban/transfer/corpus_evaluation.h"

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "toy_corpus.h"

namespace laban::transfer {
namespace {

using effort::Protocol;

effort::EvaluationOptions quick() {
  effort::EvaluationOptions options{.runs = 3, .train = 20, .test = 8, .threads = 1};
  options.models = {effort::RegressorKind::kKernelRidge};
  return options;
}

TEST(ParentGroups, AreThePerformersOrContentsOfTheParents) {
  const StyleCorpus corpus = test::toy_corpus(20);
  const auto performers = parent_groups(corpus, Protocol::kLeavePerformerOut);
  const auto contents = parent_groups(corpus, Protocol::kLeaveContentOut);
  EXPECT_EQ(performers.names.size(), 6U);
  EXPECT_EQ(contents.names.size(), 2U);
  for (std::size_t n = 0; n < 20; ++n) {
    const Fragment& parent =
        corpus.fragments[static_cast<std::size_t>(corpus.blends[n].fragment_j)];
    EXPECT_EQ(performers.names[static_cast<std::size_t>(performers.second[n])], parent.performer);
    EXPECT_EQ(contents.first[n], contents.second[n]);
    EXPECT_EQ(contents.names[static_cast<std::size_t>(contents.second[n])], parent.content);
  }
  EXPECT_THROW((void)parent_groups(corpus, Protocol::kRandom), base::Error);
}

// Whatever a performer does, nothing that a run without him trains on may change. His fragments are
// made quite different; coordinates of all others stay to the last bit.
TEST(CoordinatesKnownTo, DoNotDependOnTheFragmentsThatAreHeldOut) {
  StyleCorpus corpus = test::toy_corpus(0);
  std::vector<int> known;
  const std::string left_out = corpus.fragments.front().performer;
  for (std::size_t n = 0; n < corpus.fragments.size(); ++n) {
    if (corpus.fragments[n].performer != left_out) known.push_back(static_cast<int>(n));
  }
  const auto before = coordinates_known_to(corpus.fragments, known);
  const auto full_before =
      content_coordinates(corpus.fragments, fit_corpus_content_map(corpus.fragments));
  for (Fragment& fragment : corpus.fragments) {
    if (fragment.performer == left_out) fragment.pose.angles *= -3.0;
  }
  const auto after = coordinates_known_to(corpus.fragments, known);
  const auto full_after =
      content_coordinates(corpus.fragments, fit_corpus_content_map(corpus.fragments));
  for (const int n : known) {
    EXPECT_EQ(before[static_cast<std::size_t>(n)], after[static_cast<std::size_t>(n)]);
    EXPECT_NE(full_before[static_cast<std::size_t>(n)], full_after[static_cast<std::size_t>(n)]);
  }
  EXPECT_NE(before[0], after[0]);
  EXPECT_THROW((void)coordinates_known_to(corpus.fragments, {}), base::Error);
}

TEST(EvaluateCorpus, TheRunThatLeavesAPerformerOutDoesNotSeeHisLabels) {
  StyleCorpus corpus = test::toy_corpus(30);
  const auto before = evaluate_corpus(corpus, Protocol::kLeavePerformerOut, quick());
  const std::string left_out = before.run_list.front().held_out;
  // Labels of his blends change: the run's models must not, so its errors move as its labels do.
  const auto groups = parent_groups(corpus, Protocol::kLeavePerformerOut);
  const auto splits = effort::leave_one_out_splits(groups, 30);
  const int changed = splits.front().test.front();
  corpus.blends[static_cast<std::size_t>(changed)].effort->flow += 1.0;
  const auto after = evaluate_corpus(corpus, Protocol::kLeavePerformerOut, quick());
  // A label y + 1 moves the squared error (f - y)^2 by 1 - 2 (f - y); with y + 2, by 4 - 4 (f - y).
  corpus.blends[static_cast<std::size_t>(changed)].effort->flow += 1.0;
  const auto again = evaluate_corpus(corpus, Protocol::kLeavePerformerOut, quick());
  const double tests = before.run_list.front().test;
  const double one = tests * (after.run_errors[0](0, 0) - before.run_errors[0](0, 0));
  const double two = tests * (again.run_errors[0](0, 0) - before.run_errors[0](0, 0));
  EXPECT_NEAR(two - 2.0 * one, 2.0, 1e-9) << left_out;
}

TEST(EvaluateCorpus, RunsEveryProtocol) {
  const StyleCorpus corpus = test::toy_corpus(30);
  EXPECT_EQ(evaluate_corpus(corpus, Protocol::kRandom, quick()).runs, 3);
  const auto contents = evaluate_corpus(corpus, Protocol::kLeaveContentOut, quick());
  EXPECT_EQ(contents.runs, 2);
  EXPECT_EQ(contents.run_list[0].test, contents.run_list[1].train);
  EXPECT_EQ(contents.protocol, Protocol::kLeaveContentOut);
}

}  // namespace
}  // namespace laban::transfer
