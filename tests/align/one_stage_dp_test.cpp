#include "laban/align/one_stage_dp.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/base/rng.h"
#include "support/sanitizers.h"

#include "features.h"

namespace laban::align {
namespace {

using test::random_features;
using test::tied_features;

using Fragments = std::vector<Eigen::MatrixXd>;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Every path of METHODS 1.5 from a cell on, one after the other; no table, no state but the path's.
class Enumeration {
 public:
  Enumeration(const Eigen::MatrixXd& input, const Fragments& fragments, SegmentOptions options)
      : input_(input), fragments_(fragments), options_(options) {}

  double cheapest() const {
    double best = kInfinity;
    for (std::size_t i = 0; i < fragments_.size(); ++i) best = std::min(best, entered(0, i));
    return best;
  }

 private:
  // The path just entered fragment i at input frame p.
  double entered(int p, std::size_t i) const {
    return options_.snippet_cost + from(p, 0, i, {.holds = 0, .skips = 0});
  }

  struct Run {
    int holds;  // in a row up to this cell
    int skips;
  };

  double from(int p, int q, std::size_t i, Run run) const {
    const bool p_last = p == input_.cols() - 1;
    const bool q_last = q == fragments_[i].cols() - 1;
    const int limit = options_.slope_limit.value_or(1000) - 1;
    const bool limited = options_.slope_limit.has_value();
    double rest = p_last && q_last ? 0.0 : kInfinity;
    if (!p_last && run.holds < limit && !(limited && run.skips > 0)) {
      rest = std::min(rest, from(p + 1, q, i, {run.holds + 1, 0}));
    }
    if (!q_last && run.skips < limit && !(limited && run.holds > 0)) {
      rest = std::min(rest, from(p, q + 1, i, {0, run.skips + 1}));
    }
    if (!p_last && !q_last) rest = std::min(rest, from(p + 1, q + 1, i, {0, 0}));
    if (!p_last && q_last) {
      for (std::size_t j = 0; j < fragments_.size(); ++j) rest = std::min(rest, entered(p + 1, j));
    }
    return (input_.col(p) - fragments_[i].col(q)).squaredNorm() + rest;
  }

  const Eigen::MatrixXd& input_;
  const Fragments& fragments_;
  SegmentOptions options_;
};

Fragments small_fragments(int count, int longest, base::Rng& rng) {
  Fragments fragments;
  for (int i = 0; i < count; ++i) {
    fragments.push_back(random_features(2, 1 + rng.index(longest), rng));
  }
  return fragments;
}

void expect_cover(const Segmentation& segmentation, int frame_count) {
  int begin = 0;
  for (const Snippet& snippet : segmentation.snippets) {
    EXPECT_EQ(snippet.begin, begin);
    EXPECT_GT(snippet.end, snippet.begin);
    begin = snippet.end;
  }
  EXPECT_EQ(begin, frame_count);
}

TEST(Segment, EqualsExhaustiveSearch) {
  base::Rng rng(1);
  for (int trial = 0; trial < 150; ++trial) {
    SCOPED_TRACE(trial);
    const auto input = random_features(2, 1 + rng.index(5), rng);
    const Fragments fragments = small_fragments(1 + rng.index(3), 3, rng);
    const SegmentOptions options{.snippet_cost = trial % 2 == 0 ? 0.0 : 0.7};
    const auto result = segment(input, fragments, options);
    ASSERT_TRUE(result.has_value());
    EXPECT_NEAR(result->cost, Enumeration(input, fragments, options).cheapest(), 1e-11);
    expect_cover(*result, static_cast<int>(input.cols()));
  }
}

TEST(Segment, EqualsExhaustiveSearchUnderASlopeLimit) {
  base::Rng rng(2);
  int without_path = 0;
  for (int trial = 0; trial < 200; ++trial) {
    SCOPED_TRACE(trial);
    const auto input = random_features(2, 1 + rng.index(6), rng);
    Fragments fragments = small_fragments(2, 4, rng);
    if (trial % 4 == 0) fragments.assign(1, random_features(2, 5, rng));
    const SegmentOptions options{.snippet_cost = trial % 2 == 0 ? 0.0 : 0.3,
                                 .slope_limit = 2 + trial % 3};
    const double expected = Enumeration(input, fragments, options).cheapest();
    const auto result = segment(input, fragments, options);
    ASSERT_EQ(result.has_value(), expected < kInfinity);
    if (!result) {
      ++without_path;
      continue;
    }
    EXPECT_NEAR(result->cost, expected, 1e-11);
    expect_cover(*result, static_cast<int>(input.cols()));
  }
  EXPECT_GT(without_path, 0);  // the case is in the sample
}

TEST(Segment, SnippetCostsAreTheirOwnAlignmentsAndSumToTheOptimum) {
  base::Rng rng(3);
  for (int trial = 0; trial < 30; ++trial) {
    SCOPED_TRACE(trial);
    const auto input = random_features(2, 60, rng);
    const Fragments fragments = small_fragments(5, 12, rng);
    const double snippet_cost = trial % 2 == 0 ? 0.0 : 1.5;
    const auto result = segment(input, fragments, {.snippet_cost = snippet_cost});
    ASSERT_TRUE(result.has_value());
    double sum = 0.0;
    for (const Snippet& snippet : result->snippets) {
      const DtwResult own = dtw(input.middleCols(snippet.begin, snippet.end - snippet.begin),
                                fragments[static_cast<std::size_t>(snippet.fragment)]);
      EXPECT_NEAR(snippet.cost, own.cost, 1e-9);
      EXPECT_EQ(snippet.path_length, static_cast<int>(own.path.size()));
      sum += own.cost + snippet_cost;
    }
    EXPECT_NEAR(result->cost, sum, 1e-9);
  }
}

TEST(Segment, FindsTheFragmentsThatWereJoined) {
  base::Rng rng(4);
  Fragments fragments;
  for (int i = 0; i < 6; ++i) fragments.push_back(random_features(8, 10 + 3 * i, rng));
  Eigen::MatrixXd input(8, 10 + 19 + 13);
  input << fragments[0], fragments[3], fragments[1];
  const auto result = segment(input, fragments);
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->cost, 0.0);
  ASSERT_EQ(result->snippets.size(), 3U);
  EXPECT_EQ(result->snippets[0].fragment, 0);
  EXPECT_EQ(result->snippets[1].fragment, 3);
  EXPECT_EQ(result->snippets[1].begin, 10);
  EXPECT_EQ(result->snippets[1].end, 29);
  EXPECT_EQ(result->snippets[2].fragment, 1);
}

TEST(Segment, PrefersStayingToEnteringAndTheLowestFragment) {
  const Eigen::MatrixXd input = Eigen::MatrixXd::Ones(1, 4);
  const Fragments fragments(3, Eigen::MatrixXd::Ones(1, 1));  // every path is free
  const auto result = segment(input, fragments);
  ASSERT_TRUE(result.has_value());
  ASSERT_EQ(result->snippets.size(), 1U);
  EXPECT_EQ(result->snippets[0].fragment, 0);
  EXPECT_EQ(result->snippets[0].path_length, 4);
}

TEST(Segment, AHighSnippetCostLeavesOneSnippet) {
  base::Rng rng(5);
  const auto input = random_features(2, 30, rng);
  const Fragments fragments = small_fragments(4, 6, rng);
  EXPECT_GT(segment(input, fragments)->snippets.size(), 1U);
  EXPECT_EQ(segment(input, fragments, {.snippet_cost = 1e6})->snippets.size(), 1U);
}

TEST(Segment, SlopeLimitBoundsEverySnippetsLength) {
  base::Rng rng(6);
  const auto input = random_features(2, 200, rng);
  const Fragments fragments = small_fragments(6, 20, rng);
  for (int limit = 2; limit <= 3; ++limit) {
    const auto result = segment(input, fragments, {.slope_limit = limit});
    ASSERT_TRUE(result.has_value());
    for (const Snippet& snippet : result->snippets) {
      const int length =
          static_cast<int>(fragments[static_cast<std::size_t>(snippet.fragment)].cols());
      EXPECT_LE(snippet.end - snippet.begin, length * limit);
      EXPECT_GE((snippet.end - snippet.begin) * limit, length);
    }
  }
}

TEST(Segment, ReportsThatNoPathExists) {
  base::Rng rng(7);
  const Fragments fragments(2, random_features(2, 10, rng));
  EXPECT_FALSE(segment(random_features(2, 4, rng), fragments, {.slope_limit = 2}).has_value());
  EXPECT_TRUE(segment(random_features(2, 5, rng), fragments, {.slope_limit = 2}).has_value());
}

std::string message_of(base::ErrorKind kind, const Eigen::MatrixXd& input,
                       const Fragments& fragments, const SegmentOptions& options = {}) {
  try {
    (void)segment(input, fragments, options);
  } catch (const base::Error& error) {
    EXPECT_EQ(error.kind(), kind);
    return error.what();
  }
  return "nothing was thrown";
}

TEST(Segment, RefusesWhatItCannotSegment) {
  const Eigen::MatrixXd input = Eigen::MatrixXd::Zero(2, 3);
  using base::ErrorKind;
  EXPECT_EQ(message_of(ErrorKind::kData, input, {}),
            "segment: no fragment, at least one is needed");
  EXPECT_EQ(message_of(ErrorKind::kData, input, {input, Eigen::MatrixXd::Zero(3, 3)}),
            "segment: fragment 1: 3 dimensions, must be the other's 2");
  EXPECT_EQ(message_of(ErrorKind::kData, Eigen::MatrixXd(2, 0), {input}),
            "segment: input: 2 dimensions x 0 frames, at least 1 x 1 is needed");
  EXPECT_THAT(message_of(ErrorKind::kUsage, input, {input}, {.snippet_cost = -1.0}),
              testing::StartsWith("SegmentOptions::snippet_cost = -1"));
  EXPECT_EQ(message_of(ErrorKind::kUsage, input, {input}, {.slope_limit = 1}),
            "SegmentOptions::slope_limit = 1 (must be >= 2)");
}

// Issue figure: T 10 000 x S 50 000 in under 200 MB. Its own high-water mark where each case is
// a process of its own (not with LABAN_TEST_PROGRAMS_WHOLE); the 63-dimensional case runs in the
// benchmarks.
TEST(Segment, LongInputAgainstALargeDatabaseStaysUnder200Megabytes) {
  base::Rng rng(8);
  Fragments fragments;
  for (int i = 0; i < 250; ++i) fragments.push_back(random_features(12, 200, rng));
  const auto input = random_features(12, 10000, rng);
  const auto result = segment(input, fragments);
  ASSERT_TRUE(result.has_value());
  expect_cover(*result, 10000);
#ifndef LABAN_KEEPS_FREED_MEMORY
  rusage usage{};
  ASSERT_EQ(getrusage(RUSAGE_SELF, &usage), 0);
  RecordProperty("peak_megabytes", static_cast<int>(usage.ru_maxrss / 1024));
  EXPECT_LT(usage.ru_maxrss, 200 * 1024);  // kilobytes
#endif
}

}  // namespace
}  // namespace laban::align
