#include "laban/transfer/measured_misses.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

namespace laban::transfer {
namespace {

BlendChoice choice_of(int i, int j, double alpha) {
  BlendChoice choice;
  choice.fragment_i = i;
  choice.fragment_j = j;
  choice.alpha = alpha;
  return choice;
}

constexpr std::array kPairs = {FragmentPair{0, 1}, FragmentPair{0, 2}, FragmentPair{4, 7}};

TEST(MeasuredMisses, KnowNothingAtFirst) {
  EXPECT_TRUE(MeasuredMisses().of_pairs(kPairs).empty());
  EXPECT_FALSE(MeasuredMisses().has(choice_of(0, 1, 0.5)));
}

TEST(MeasuredMisses, OneMissIsSharedByAllAndMostlyItsOwnPairs) {
  MeasuredMisses misses;
  const Eigen::Vector3d miss(0.5, -1.0, 0.25);
  misses.add(choice_of(0, 2, 0.5), miss);
  const std::vector<Correction> found = misses.of_pairs(kPairs);
  // One observation at the middle: mean cov / (1 + noise), variance 1 - cov^2 / (1 + noise).
  const double total = 1.0 + MeasuredMisses::kNoise;
  const double common = MeasuredMisses::kCommon;
  EXPECT_TRUE(found[1].miss.isApprox(miss / total));
  EXPECT_NEAR(found[1].error_share, std::sqrt(0.05), 1e-12);  // what is left at least
  for (const std::size_t other : {0U, 2U}) {
    EXPECT_TRUE(found[other].miss.isApprox(common / total * miss));
    EXPECT_NEAR(found[other].error_share, std::sqrt(1.0 - common * common / total), 1e-12);
  }
}

TEST(MeasuredMisses, AreNothingAtTheFragmentsAndTurnBeyondThem) {
  MeasuredMisses misses;
  misses.add(choice_of(0, 1, 0.25), Eigen::Vector3d(0.3, 0.2, 0.1));
  const Correction own = misses.of_pairs(kPairs)[0];
  EXPECT_EQ(own.at(0.0), Eigen::Vector3d::Zero());
  EXPECT_EQ(own.at(1.0), Eigen::Vector3d::Zero());
  EXPECT_GT(own.at(0.25)[0], 0.25);
  EXPECT_LT(own.at(0.25)[0], 0.3);
  EXPECT_GT(own.at(0.5)[0], 0.3);
  EXPECT_LT(own.at(-0.2)[0], 0.0);
}

TEST(MeasuredMisses, AreTheMeanOfAGaussianProcess) {
  MeasuredMisses misses;
  const std::array tried = {choice_of(0, 1, 0.3), choice_of(4, 7, 0.8), choice_of(0, 1, 1.2),
                            choice_of(5, 5, 0.0)};
  Eigen::MatrixXd miss(3, 4);
  miss << 0.4, -0.2, 0.3, 0.9, 0.1, 0.5, -0.6, 0.2, -0.3, 0.2, 0.7, 0.1;
  for (std::size_t n = 0; n < tried.size(); ++n)
    misses.add(tried[n], miss.col(static_cast<Eigen::Index>(n)));
  const auto covariance = [](const BlendChoice& a, const BlendChoice& b) {
    const auto middle = [](double alpha) { return 4.0 * alpha * (1.0 - alpha); };
    const bool same = a.fragment_i == b.fragment_i && a.fragment_j == b.fragment_j;
    return middle(a.alpha) * middle(b.alpha) * (same ? 1.0 : MeasuredMisses::kCommon);
  };
  Eigen::MatrixXd known(4, 4);
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) {
      known(r, c) =
          covariance(tried[static_cast<std::size_t>(r)], tried[static_cast<std::size_t>(c)]) +
          (r == c ? MeasuredMisses::kNoise : 0.0);
    }
  }
  const std::vector<Correction> found = misses.of_pairs(kPairs);
  for (std::size_t p = 0; p < kPairs.size(); ++p) {
    const BlendChoice wanted = choice_of(kPairs[p].i, kPairs[p].j, 0.4);
    Eigen::VectorXd beside(4);
    for (int r = 0; r < 4; ++r) beside[r] = covariance(wanted, tried[static_cast<std::size_t>(r)]);
    const Eigen::VectorXd weights = known.ldlt().solve(beside);
    EXPECT_TRUE(found[p].at(0.4).isApprox(miss * weights, 1e-9)) << p;
    const double left = (1.0 - beside.dot(weights) / covariance(wanted, wanted));
    EXPECT_NEAR(found[p].error_share, std::sqrt(std::max(0.05, left)), 1e-9) << p;
  }
}

TEST(MeasuredMisses, KnowWhatWasTriedAndWhatIsSettled) {
  MeasuredMisses misses;
  misses.add(choice_of(0, 1, 0.5), Eigen::Vector3d::Zero());
  EXPECT_TRUE(misses.has(choice_of(0, 1, 0.505)));
  EXPECT_FALSE(misses.has(choice_of(0, 1, 0.6)));
  EXPECT_FALSE(misses.has(choice_of(0, 2, 0.5)));
  BlendChoice of_three = choice_of(0, 1, 0.5);
  of_three.further.push_back({9, 0.3});
  EXPECT_FALSE(misses.has(of_three));
  misses.settle({0, 2});
  const std::vector<Correction> found = misses.of_pairs(kPairs);
  EXPECT_FALSE(found[0].settled);
  EXPECT_TRUE(found[1].settled);
}

}  // namespace
}  // namespace laban::transfer
