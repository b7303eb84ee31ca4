#include "align/lane_kernels.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/align/content_groups.h"
#include "laban/align/dtw.h"
#include "laban/align/one_stage_dp.h"
#include "laban/base/rng.h"

#include "align/lane_frames.h"
#include "features.h"

namespace laban::align {
namespace {

using test::random_features;
using test::tied_features;

// On a machine without AVX2 and FMA both are the baseline.
class LaneKernelsTest : public testing::TestWithParam<const LaneKernels*> {
 protected:
  [[nodiscard]] static const LaneKernels& kernels() { return *GetParam(); }
  LaneKernelsForTest use_{kernels()};
};

INSTANTIATE_TEST_SUITE_P(All, LaneKernelsTest,
                         testing::Values(&baseline_lane_kernels(), &best_lane_kernels()),
                         [](const auto& kind) {
                           return kind.index == 0 ? std::string("Baseline") : std::string("Best");
                         });

PackedLanes pack(const std::vector<Eigen::MatrixXf>& fragments, const LaneKernels& kernels) {
  std::vector<const Eigen::MatrixXf*> lanes;
  for (const Eigen::MatrixXf& fragment : fragments) lanes.push_back(&fragment);
  return {lanes, kernels};
}

TEST_P(LaneKernelsTest, DistancesAreThoseOfTheDefinition) {
  base::Rng rng(1);
  for (int trial = 0; trial < 30; ++trial) {
    SCOPED_TRACE(trial);
    const int dimensions = 1 + rng.index(70);
    const Eigen::MatrixXf x = random_features(dimensions, 1 + rng.index(20), rng).cast<float>();
    std::vector<Eigen::MatrixXf> fragments;
    for (int l = 0; l < kernels().lanes - trial % 2; ++l) {
      fragments.push_back(random_features(dimensions, 1 + rng.index(12), rng).cast<float>());
    }
    const PackedRows rows(x, kernels());
    const PackedLanes lanes = pack(fragments, kernels());
    const auto stride = static_cast<std::size_t>(lanes.frame_count() * kernels().lanes);
    std::vector<float> d(stride * static_cast<std::size_t>(x.cols()));
    kernels().distances(rows.view(0, rows.frame_count()), lanes.view(), d.data(), stride);
    for (std::size_t l = 0; l < fragments.size(); ++l) {
      for (Eigen::Index p = 0; p < x.cols(); ++p) {
        for (Eigen::Index q = 0; q < fragments[l].cols(); ++q) {
          const float expected = (x.col(p) - fragments[l].col(q)).squaredNorm();
          const float norms = x.col(p).squaredNorm() + fragments[l].col(q).squaredNorm();
          EXPECT_NEAR(
              d[static_cast<std::size_t>(p) * stride +
                static_cast<std::size_t>(q) * static_cast<std::size_t>(kernels().lanes) + l],
              expected, 2e-6F * norms);  // some 70 roundings of 6e-8
        }
      }
    }
  }
}

TEST_P(LaneKernelsTest, EqualFramesAreExactlyNothingApart) {
  base::Rng rng(2);
  const Eigen::MatrixXf x = random_features(63, 40, rng).cast<float>();
  const PackedRows rows(x, kernels());
  const PackedLanes lanes = pack({x, x, x}, kernels());
  const auto stride = static_cast<std::size_t>(lanes.frame_count() * kernels().lanes);
  std::vector<float> d(stride * 40);
  kernels().distances(rows.view(0, 40), lanes.view(), d.data(), stride);
  for (std::size_t p = 0; p < 40; ++p) {
    for (std::size_t l = 0; l < 3; ++l) {
      EXPECT_EQ(d[p * stride + p * static_cast<std::size_t>(kernels().lanes) + l], 0.0F);
    }
  }
}

// Whole numbers whose mean is one too: single precision rounds nothing, so ties are ties.
std::vector<Eigen::MatrixXd> balanced_tied_features(int count, base::Rng& rng) {
  std::vector<Eigen::MatrixXd> features;
  for (int i = 0; i < count; ++i) {
    const Eigen::MatrixXd some = tied_features(2, 1 + rng.index(30), rng);
    Eigen::MatrixXd both(2, 2 * some.cols());
    both << some, (2.0 - some.array()).matrix();
    features.push_back(both);
  }
  return features;
}

TEST_P(LaneKernelsTest, AllPairsAreThePlainAlignmentsWithTheirTies) {
  base::Rng rng(3);
  for (const int count : {2, 3, 9, 30}) {
    SCOPED_TRACE(count);
    const auto features = balanced_tied_features(count, rng);
    const PairCosts costs = all_pair_costs(features);
    for (int i = 0; i < count; ++i) {
      for (int j = i + 1; j < count; ++j) {
        const DtwCost expected =
            dtw_cost(features[static_cast<std::size_t>(i)], features[static_cast<std::size_t>(j)]);
        EXPECT_EQ(costs.cost(i, j), expected.cost) << i << ' ' << j;
        EXPECT_NEAR(costs.mean_cost(i, j), expected.mean_cost(), 1e-12) << i << ' ' << j;
      }
    }
  }
}

TEST_P(LaneKernelsTest, AllPairsAreWithinAHundredThousandthOfTheMeanCell) {
  base::Rng rng(4);
  std::vector<Eigen::MatrixXd> features;
  for (int i = 0; i < 12; ++i) {
    features.push_back(random_features(51, 20 + rng.index(150), rng).array() + 100.0);
  }
  const PairCosts costs = all_pair_costs(features);
  for (int i = 0; i < 12; ++i) {
    for (int j = i + 1; j < 12; ++j) {
      const DtwCost expected =
          dtw_cost(features[static_cast<std::size_t>(i)], features[static_cast<std::size_t>(j)]);
      EXPECT_NEAR(costs.mean_cost(i, j), expected.mean_cost(), 1e-5 * expected.mean_cost());
    }
  }
  EXPECT_EQ(all_pair_costs(features, 2).mean_cost, costs.mean_cost);
}

TEST_P(LaneKernelsTest, HoldWhateverTheScaleOfTheFeatures) {
  base::Rng rng(5);
  std::vector<Eigen::MatrixXd> features;
  for (int i = 0; i < 4; ++i) features.push_back(random_features(5, 30, rng));
  const PairCosts costs = all_pair_costs(features);
  for (const double scale : {std::ldexp(1.0, -300), std::ldexp(1.0, 300)}) {
    std::vector<Eigen::MatrixXd> scaled = features;
    for (Eigen::MatrixXd& fragment : scaled) fragment *= scale;
    EXPECT_EQ(all_pair_costs(scaled).cost, costs.cost * scale * scale);
    Eigen::MatrixXd input(5, 60);
    input << scaled[2], scaled[0];
    const auto cut = segment(input, scaled);
    ASSERT_EQ(cut->snippets.size(), 2U);
    EXPECT_EQ(cut->snippets[0].fragment, 2);
    EXPECT_EQ(cut->snippets[1].begin, 30);
  }
}

// The recursion of METHODS 1.5 in double precision, one cell after the other: total cost only.
double plain_one_stage_cost(const Eigen::MatrixXd& input,
                            const std::vector<Eigen::MatrixXd>& fragments, double snippet_cost) {
  const double infinity = std::numeric_limits<double>::infinity();
  std::vector<Eigen::VectorXd> cells;
  for (const auto& fragment : fragments) {
    cells.push_back(Eigen::VectorXd::Constant(fragment.cols(), infinity));
  }
  double before = 0.0;
  for (Eigen::Index p = 0; p < input.cols(); ++p) {
    double best = infinity;
    for (std::size_t i = 0; i < fragments.size(); ++i) {
      double diagonal = infinity;
      double left = before + snippet_cost;
      for (Eigen::Index q = 0; q < fragments[i].cols(); ++q) {
        const double above = cells[i](q);
        left = std::min(std::min(diagonal, above), left) +
               (input.col(p) - fragments[i].col(q)).squaredNorm();
        cells[i](q) = left;
        diagonal = above;
      }
      best = std::min(best, left);
    }
    before = best;
  }
  return before;
}

TEST_P(LaneKernelsTest, SegmentationIsTheCheapestOfALongInput) {
  base::Rng rng(6);
  for (int trial = 0; trial < 10; ++trial) {
    SCOPED_TRACE(trial);
    std::vector<Eigen::MatrixXd> fragments;
    for (int i = 0; i < 19; ++i) fragments.push_back(random_features(6, 1 + rng.index(25), rng));
    const auto input = random_features(6, 300, rng);
    const double snippet_cost = trial % 2 == 0 ? 0.0 : 20.0;
    const double expected = plain_one_stage_cost(input, fragments, snippet_cost);
    const auto found = segment(input, fragments, {.snippet_cost = snippet_cost});
    EXPECT_NEAR(found->cost, expected, 1e-9 * expected);
  }
}

}  // namespace
}  // namespace laban::align
