#include "align/lane_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
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

// The two numbers of 16 bits of each.
Eigen::MatrixXf unpaired(const Eigen::MatrixXi& pairs) {
  Eigen::MatrixXf whole(2 * pairs.rows(), pairs.cols());
  for (Eigen::Index n = 0; n < pairs.size(); ++n) {
    whole.data()[2 * n] = static_cast<std::int16_t>(pairs.data()[n] & 0xFFFF);
    whole.data()[2 * n + 1] = static_cast<std::int16_t>(pairs.data()[n] >> 16);
  }
  return whole;
}

TEST(CoarseGrid, MovesFramesApartByRoundingAtMost) {
  base::Rng rng(7);
  for (int trial = 0; trial < 20; ++trial) {
    const int dimensions = 1 + rng.index(CoarseGrid::kMostDimensions);
    const Eigen::MatrixXf x = random_features(dimensions, 10, rng).cast<float>();
    const float reach = trial % 2 == 0 ? 1.0F : 30.0F;  // beyond the cube, too
    const Eigen::MatrixXf y = reach * random_features(dimensions, 10, rng).cast<float>();
    const CoarseGrid grid(x.colwise().norm().maxCoeff());
    const Eigen::MatrixXf on_grid_x = unpaired(grid.frames(x).values);
    const Eigen::MatrixXf on_grid_y = unpaired(grid.frames(y).values);
    for (Eigen::Index q = 0; q < x.cols(); ++q) {
      const float there = std::sqrt(grid.unit()) * (on_grid_x.col(q) - on_grid_y.col(q)).norm();
      const float distance = (x.col(q) - y.col(q)).norm();
      EXPECT_LE(there, distance * 1.00001F + grid.rounding(dimensions));
      EXPECT_LE((unpaired(grid.lower_bounds(x)) - unpaired(grid.upper_bounds(x))).maxCoeff(), 0);
    }
  }
}

// Squared gaps between the boxes that two columns are, lower bounds first.
float plain_box_distance(const Eigen::VectorXi& a, const Eigen::VectorXi& b) {
  const Eigen::VectorXf x = unpaired(a);
  const Eigen::VectorXf y = unpaired(b);
  const Eigen::Index half = x.size() / 2;
  return (x.head(half) - y.tail(half))
      .cwiseMax(y.head(half) - x.tail(half))
      .cwiseMax(0.0F)
      .squaredNorm();
}

// What paths cost from frame `from` on, one frame at a time, by the box that it is in.
Eigen::RowVectorXf plain_rest(const Eigen::MatrixXf& distances, int from, int frames) {
  Eigen::RowVectorXf rest = Eigen::RowVectorXf::Zero(distances.cols());
  for (int f = frames - 1; f >= from; --f) {
    rest += distances.row(f / kBoxFrames);
    if (f == 0) continue;
    for (Eigen::Index b = rest.size() - 2; b >= 0; --b) rest(b) = std::min(rest(b), rest(b + 1));
  }
  return rest;
}

TEST_P(LaneKernelsTest, BoxPathsAreTheCheapestFrameByFrame) {
  base::Rng rng(8);
  const auto lanes = static_cast<std::size_t>(kernels().lanes);
  constexpr int kDimensions = 5;
  const CoarseGrid grid(10.0F);
  const auto boxes_of = [&](int count) {
    const Eigen::MatrixXf middle = random_features(2 * kDimensions, count, rng).cast<float>();
    Eigen::MatrixXi boxes(2 * kDimensions, count);
    boxes << grid.lower_bounds(middle.array() - 0.2F), grid.upper_bounds(middle.array() + 0.2F);
    return boxes;
  };
  for (int trial = 0; trial < 30; ++trial) {
    SCOPED_TRACE(trial);
    const int frames = 1 + rng.index(50);
    const Eigen::MatrixXi rows = boxes_of((frames + kBoxFrames - 1) / kBoxFrames);
    const auto row_count = static_cast<std::size_t>(rows.cols());
    const auto box_count = static_cast<std::size_t>(1 + rng.index(7));
    std::vector<Eigen::MatrixXi> boxes;
    std::vector<int> packed(2 * kDimensions * box_count * lanes);
    std::vector<int> box_frames(box_count * lanes, kBoxFrames);
    for (std::size_t l = 0; l < lanes; ++l) {
      boxes.push_back(boxes_of(static_cast<int>(box_count)));
      for (Eigen::Index n = 0; n < boxes[l].size(); ++n)
        packed[static_cast<std::size_t>(n) * lanes + l] = boxes[l].data()[n];
      box_frames[(box_count - 1) * lanes + l] = 1 + rng.index(kBoxFrames);
    }
    const std::size_t strips = (static_cast<std::size_t>(frames) + lanes - 1) / lanes;
    std::vector<float> d(row_count * box_count * lanes);
    std::vector<float> row_least(row_count * lanes);
    std::vector<float> box_least(box_count * lanes);
    std::vector<float> rest((strips + 1) * box_count * lanes);
    std::vector<float> path(row_count * lanes);
    std::vector<float> ends(box_count * lanes);
    kernels().box_distances(rows.data(), static_cast<int>(row_count), packed.data(),
                            static_cast<int>(box_count), kDimensions, 1.0F, d.data(),
                            row_least.data(), box_least.data());
    kernels().rest_by_rows(d.data(), frames, static_cast<int>(box_count), rest.data());
    kernels().path_by_boxes(d.data(), box_frames.data(), static_cast<int>(row_count),
                            static_cast<int>(box_count), path.data(), ends.data());
    for (std::size_t l = 0; l < lanes; ++l) {
      Eigen::MatrixXf plain(rows.cols(), boxes[l].cols());
      for (Eigen::Index p = 0; p < plain.rows(); ++p) {
        for (Eigen::Index b = 0; b < plain.cols(); ++b) {
          plain(p, b) = plain_box_distance(rows.col(p), boxes[l].col(b));
          const std::size_t cell = static_cast<std::size_t>(p * plain.cols() + b) * lanes + l;
          ASSERT_NEAR(d[cell], plain(p, b), 1e-5F * plain(p, b));
        }
        EXPECT_NEAR(row_least[static_cast<std::size_t>(p) * lanes + l], plain.row(p).minCoeff(),
                    1e-5F * plain.row(p).minCoeff());
      }
      for (std::size_t n = 0; n <= strips; ++n) {
        const Eigen::RowVectorXf expected = plain_rest(plain, static_cast<int>(n * lanes), frames);
        for (std::size_t b = 0; b < box_count; ++b) {
          const float one = expected(static_cast<Eigen::Index>(b));
          EXPECT_NEAR(rest[(n * box_count + b) * lanes + l], one, 1e-5F * one);
        }
      }
      const int count =
          static_cast<int>(box_count - 1) * kBoxFrames + box_frames[(box_count - 1) * lanes + l];
      Eigen::RowVectorXf cost = Eigen::RowVectorXf::Zero(plain.rows());
      for (int f = 0; f < count; ++f) {
        for (Eigen::Index p = 1; p < cost.size(); ++p) cost(p) = std::min(cost(p), cost(p - 1));
        cost += plain.col(f / kBoxFrames).transpose();
      }
      const float last = cost(cost.size() - 1);
      EXPECT_NEAR(ends[(box_count - 1) * lanes + l], last, 1e-5F * last);
    }
  }
}

}  // namespace
}  // namespace laban::align
