#include "laban/texture/semi_markov_search.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/rng.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kNever = -std::numeric_limits<double>::infinity();

/// Terms and transitions of a small take.
struct Problem {
  MatrixXd step;   // Nt x T, the first two columns 0
  MatrixXd start;  // Nt x T
  MatrixXd matrix;
  int min_frames = 3;

  [[nodiscard]] int frames() const { return static_cast<int>(step.cols()); }
  [[nodiscard]] int textons() const { return static_cast<int>(step.rows()); }
  [[nodiscard]] TermSource source() const {
    return [this](int begin, int end, TermBlock& block) {
      block.step = step.middleCols(begin, end - begin);
      block.start = start.middleCols(begin, end - begin);
    };
  }
  /// Of frames [begin, end) under texton i.
  [[nodiscard]] double segment(int i, int begin, int end) const {
    double sum = start(i, begin);
    for (int t = begin + 2; t < end; ++t) sum += step(i, t);
    return sum;
  }
  [[nodiscard]] double transition(int from, int to) const {
    return matrix(from, to) > 0.0 ? std::log(matrix(from, to)) : kNever;
  }
  [[nodiscard]] double value(const SegmentPath& path) const {
    double sum = 0.0;
    for (std::size_t s = 0; s < path.segments.size(); ++s) {
      const bool last = s + 1 == path.segments.size();
      const int end = last ? frames() : path.segments[s + 1].begin;
      EXPECT_GE(end - path.segments[s].begin, std::min(min_frames, frames()));
      sum += segment(path.segments[s].texton, path.segments[s].begin, end);
      if (!last) sum += transition(path.segments[s].texton, path.segments[s + 1].texton);
    }
    return sum;
  }
};

Problem random_problem(int textons, int frames, int min_frames, base::Rng& rng) {
  Problem problem;
  problem.min_frames = min_frames;
  problem.step = MatrixXd::Zero(textons, frames);
  problem.start = MatrixXd::Zero(textons, frames);
  problem.matrix = MatrixXd::Zero(textons, textons);
  for (double& value : problem.step.rightCols(frames - 2).reshaped()) value = 2.0 * rng.normal();
  for (double& value : problem.start.reshaped()) value = 2.0 * rng.normal();
  for (double& value : problem.matrix.reshaped())
    value = rng.uniform() < 0.4 ? 0.0 : rng.uniform(0.05, 1.0);
  for (Index row = 0; row < textons; ++row) {
    const double sum = problem.matrix.row(row).sum();
    if (sum > 0.0) problem.matrix.row(row) /= sum;
  }
  return problem;
}

/// Oracle: every segmentation and labelling of the frames from `begin` on, after a label (-1:
/// none).
double best_by_enumeration(const Problem& problem, int begin, int before) {
  double best = kNever;
  for (int i = 0; i < problem.textons(); ++i) {
    const double arrival = before < 0 ? 0.0 : problem.transition(before, i);
    if (arrival == kNever) continue;
    for (int end = begin + problem.min_frames; end <= problem.frames(); ++end) {
      const double rest = end == problem.frames() ? 0.0 : best_by_enumeration(problem, end, i);
      best = std::max(best, arrival + problem.segment(i, begin, end) + rest);
    }
  }
  return best;
}

/// [Li02, App. A] with its slip mended (b <= t - T_min + 1): only the best label is kept at each
/// number of segments n and frame t.
double best_of_appendix_a(const Problem& problem) {
  const int frames = problem.frames();
  const int most = frames / problem.min_frames;
  MatrixXd g = MatrixXd::Constant(most + 1, frames + 1, kNever);  // frames [0, t)
  Eigen::MatrixXi label = Eigen::MatrixXi::Constant(most + 1, frames + 1, -1);
  g(0, 0) = 0.0;
  for (int n = 1; n <= most; ++n) {
    for (int t = n * problem.min_frames; t <= frames; ++t) {
      for (int b = (n - 1) * problem.min_frames; b <= t - problem.min_frames; ++b) {
        if (g(n - 1, b) == kNever) continue;
        for (int i = 0; i < problem.textons(); ++i) {
          const double arrival = n == 1 ? 0.0 : problem.transition(label(n - 1, b), i);
          const double value = g(n - 1, b) + arrival + problem.segment(i, b, t);
          if (value > g(n, t)) {
            g(n, t) = value;
            label(n, t) = i;
          }
        }
      }
    }
  }
  return g.col(frames).maxCoeff();
}

SegmentPath solve(const Problem& problem) {
  return search_segments(problem.frames(), problem.min_frames, LogTransitions(problem.matrix),
                         problem.source());
}

TEST(SemiMarkovSearch, IsTheBestOfAllSegmentationsAndNeverBelowAppendixA) {
  base::Rng rng(1);
  int better_than_the_paper = 0;
  for (int textons = 1; textons <= 4; ++textons) {
    for (int min_frames = 3; min_frames <= 5; ++min_frames) {
      for (int frames = 3; frames <= 15; ++frames) {
        for (int trial = 0; trial < 3; ++trial) {
          const Problem problem = random_problem(textons, frames, min_frames, rng);
          SCOPED_TRACE(::testing::Message() << textons << " textons, " << frames << " frames, "
                                            << min_frames << " at least, trial " << trial);
          const SegmentPath path = solve(problem);
          EXPECT_NEAR(problem.value(path), path.log_likelihood, 1e-9);
          if (frames < min_frames) {
            EXPECT_EQ(path.segments.size(), 1U);
            continue;
          }
          EXPECT_NEAR(path.log_likelihood, best_by_enumeration(problem, 0, -1), 1e-9);
          const double paper = best_of_appendix_a(problem);
          EXPECT_GE(path.log_likelihood, paper - 1e-9);
          better_than_the_paper += path.log_likelihood > paper + 1e-9 ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(better_than_the_paper, 0);  // or the oracle would be the same recursion
}

// Enough frames for the tree of open paths to be pruned many times.
TEST(SemiMarkovSearch, ALongTakeKeepsItsPath) {
  base::Rng rng(2);
  const Problem problem = random_problem(40, 30000, 3, rng);
  const SegmentPath path = solve(problem);
  EXPECT_GT(path.segments.size(), 3000U);
  EXPECT_NEAR(problem.value(path), path.log_likelihood, 1e-6 * std::abs(path.log_likelihood));
}

TEST(SemiMarkovSearch, TiesGoToTheEarlierCutAndTheLowerLabel) {
  Problem problem;
  problem.step = MatrixXd::Zero(2, 8);
  problem.start = MatrixXd::Zero(2, 8);
  problem.matrix = MatrixXd::Identity(2, 2);
  const SegmentPath path = solve(problem);
  ASSERT_EQ(path.segments.size(), 1U);
  EXPECT_EQ(path.segments[0].texton, 0);
}

TEST(SemiMarkovSearch, RefusesWhatItCannotSegment) {
  const Problem problem = [] {
    base::Rng rng(3);
    return random_problem(2, 8, 3, rng);
  }();
  const LogTransitions transitions(problem.matrix);
  EXPECT_THROW((void)search_segments(2, 3, transitions, problem.source()), base::Error);
  EXPECT_THROW((void)search_segments(8, 2, transitions, problem.source()), base::Error);
  EXPECT_THROW((void)LogTransitions(MatrixXd::Constant(2, 2, 1.5)), base::Error);
  EXPECT_THROW((void)LogTransitions(MatrixXd::Zero(2, 3)), base::Error);
}

}  // namespace
}  // namespace laban::texture
