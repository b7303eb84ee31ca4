#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/manifold/cluster_figures.h"
#include "laban/manifold/fuzzy_k_means.h"
#include "laban/manifold/gaussian_mixture.h"
#include "laban/manifold/k_means.h"

#include "samples.h"

namespace laban::manifold {
namespace {

using Eigen::MatrixXd;
using test::reference_samples;

/// Three clouds far apart.
MatrixXd clouds(int a_cloud, unsigned seed = 3) {
  base::Rng rng(seed);
  MatrixXd x(2, 3 * a_cloud);
  for (int n = 0; n < x.cols(); ++n) {
    const int cloud = n / a_cloud;
    x.col(n) << 10.0 * cloud + 0.3 * rng.normal(), 5.0 * (cloud % 2) + 0.3 * rng.normal();
  }
  return x;
}

TEST(KMeans, ReachesTheObjectiveOfScikitLearn) {
  const MatrixXd x = reference_samples();
  base::Rng rng(1);
  KMeansOptions options;
  options.restarts = 100;  // there are many optima; scikit-learn is given as many
  // reference_values.py: the best of 100 beginnings, 10 printed digits.
  options.clusters = 3;
  EXPECT_LE(k_means(x, options, rng).inertia, 362.0184218153 * (1.0 + 1e-9));
  options.clusters = 8;
  EXPECT_LE(k_means(x, options, rng).inertia, 186.8818323101 * (1.0 + 1e-9));
}

TEST(KMeans, EndsWhereCentersAreMeansAndLabelsNearest) {
  const MatrixXd x = reference_samples();
  base::Rng rng(2);
  const KMeans found = k_means(x, {.clusters = 6}, rng);
  ASSERT_TRUE(found.converged);
  double inertia = 0.0;
  MatrixXd sums = MatrixXd::Zero(6, 6);
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(6);
  for (int n = 0; n < x.cols(); ++n) {
    const int label = found.labels[static_cast<std::size_t>(n)];
    const Eigen::RowVectorXd distances = (found.centers.colwise() - x.col(n)).colwise().norm();
    EXPECT_DOUBLE_EQ(distances[label], distances.minCoeff());
    inertia += distances[label] * distances[label];
    sums.col(label) += x.col(n);
    counts[label] += 1.0;
  }
  EXPECT_NEAR(found.inertia, inertia, 1e-9);
  for (int k = 0; k < 6; ++k) {
    EXPECT_LT((sums.col(k) / counts[k] - found.centers.col(k)).norm(), 1e-12);
  }
}

TEST(KMeans, AsManyClustersAsSamplesLeaveNoError) {
  const MatrixXd x = reference_samples().leftCols(7);
  base::Rng rng(3);
  const KMeans found = k_means(x, {.clusters = 20}, rng);
  EXPECT_EQ(found.centers.cols(), 7);
  EXPECT_NEAR(found.inertia, 0.0, 1e-20);
  EXPECT_EQ(k_means(MatrixXd::Ones(2, 5), {.clusters = 2}, rng).inertia, 0.0);
}

TEST(KMeans, TheElbowIsAtTheNumberOfClouds) {
  base::Rng rng(4);
  const ElbowCurve curve = find_elbow(clouds(30), 12, {}, rng);
  EXPECT_EQ(curve.clusters, 3);
  ASSERT_EQ(curve.errors.size(), 12U);
  for (std::size_t k = 1; k < curve.errors.size(); ++k) {
    EXPECT_LE(curve.errors[k], curve.errors[k - 1] * 1.02) << k;
  }
  EXPECT_EQ(find_elbow(MatrixXd::Ones(2, 9), 5, {}, rng).clusters, 1);
}

/// Mean over seeds of what a single beginning ends at in eight clusters.
double mean_inertia(int breath, int swaps) {
  double sum = 0.0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    base::Rng rng(seed);
    sum += k_means(reference_samples(),
                   {.clusters = 8, .restarts = 1, .breath = breath, .swaps = swaps}, rng)
               .inertia;
  }
  return sum / 10.0;
}

// A single beginning ends in a poor optimum here for most seeds; reference_values.py: 186.88 is the
// best of 100.
TEST(KMeans, BreathingAndSwapsEachLeadOutOfAPoorOptimum) {
  const double without = mean_inertia(0, 0);
  EXPECT_GT(without, 1.03 * 186.8818);
  EXPECT_LT(mean_inertia(5, 0), 1.02 * 186.8818);
  EXPECT_LT(mean_inertia(0, 1000), 1.02 * 186.8818);
}

// By less than what decides where it bends, 1 % of the error of one cluster.
TEST(KMeans, TheElbowCurveHardlyHangsOnTheSeed) {
  const MatrixXd x = reference_samples();
  base::Rng rng(1);
  const ElbowCurve first = find_elbow(x, 20, {}, rng);
  for (unsigned seed = 2; seed <= 5; ++seed) {
    base::Rng other(seed);
    const ElbowCurve curve = find_elbow(x, 20, {}, other);
    ASSERT_EQ(curve.errors.size(), first.errors.size());
    for (std::size_t k = 0; k < curve.errors.size(); ++k) {
      EXPECT_NEAR(curve.errors[k], first.errors[k], 0.01 * first.errors[0]) << seed << ' ' << k;
    }
  }
}

TEST(FuzzyKMeans, NeverRaisesItsObjectiveAndEndsAtAFixedPoint) {
  const MatrixXd x = reference_samples();
  base::Rng rng(5);
  const KMeans hard = k_means(x, {.clusters = 4}, rng);
  double last = std::numeric_limits<double>::infinity();
  for (int iterations = 1; iterations <= 20; ++iterations) {
    const FuzzyKMeans fuzzy =
        fuzzy_k_means(x, hard.centers, {.max_iterations = iterations, .tolerance = 1e-15});
    EXPECT_LE(fuzzy.objective, last * (1.0 + 1e-12)) << iterations;
    last = fuzzy.objective;
  }
  const FuzzyKMeans fuzzy = fuzzy_k_means(x, hard.centers, {.tolerance = 1e-10});
  ASSERT_TRUE(fuzzy.converged);
  EXPECT_LE(fuzzy.objective, fuzzy.first_objective);
  const MatrixXd weights = fuzzy.memberships.array().square();
  for (int k = 0; k < 4; ++k) {
    const Eigen::VectorXd mean = x * weights.row(k).transpose() / weights.row(k).sum();
    EXPECT_LT((mean - fuzzy.centers.col(k)).norm(), 1e-7);
  }
  EXPECT_LT((fuzzy.memberships.colwise().sum().array() - 1.0).abs().maxCoeff(), 1e-12);
}

TEST(FuzzyKMeans, ASampleOnACenterBelongsToIt) {
  MatrixXd x(1, 3);
  x << 0.0, 1.0, 4.0;
  MatrixXd centers(1, 2);
  centers << 0.0, 4.0;
  // By hand: u of the middle one is 1 / (1 + 1/9) = .9, with u^2 as weights the first centre moves.
  const FuzzyKMeans fuzzy = fuzzy_k_means(x, centers, {.max_iterations = 1});
  EXPECT_NEAR(fuzzy.first_objective, 0.81 * 1.0 + 0.01 * 9.0, 1e-12);
  EXPECT_NEAR(fuzzy.centers(0, 0), 0.81 / 1.81, 1e-12);
}

TEST(GaussianMixture, ReachesTheLikelihoodOfScikitLearn) {
  const MatrixXd x = reference_samples().topRows(2);
  // reference_values.py; the best of several beginnings, as there.
  const GaussianMixture one =
      gaussian_mixture(x, std::vector<int>(static_cast<std::size_t>(x.cols()), 0));
  EXPECT_NEAR(one.mean_log_likelihood, -2.1964359016, 1e-8);
  double best = -std::numeric_limits<double>::infinity();
  for (unsigned seed = 1; seed <= 10; ++seed) {
    base::Rng rng(seed);
    const KMeans hard = k_means(x, {.clusters = 3, .restarts = 1, .breath = 0, .swaps = 0}, rng);
    best =
        std::max(best, gaussian_mixture(x, hard.labels, {.max_iterations = 5000, .tolerance = 1e-9})
                           .mean_log_likelihood);
  }
  EXPECT_GE(best, -1.8015741314 - 1e-6);
}

TEST(GaussianMixture, SearchIsNeverWorseThanItsFirstBeginningAndKeepsItsSize) {
  const MatrixXd x = reference_samples();
  bool better = false;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    base::Rng rng(seed);
    const KMeans hard = k_means(x, {.clusters = 5, .restarts = 1, .swaps = 0}, rng);
    const double first = gaussian_mixture(x, hard.labels).mean_log_likelihood;
    const GaussianMixture best = best_gaussian_mixture(x, hard.labels, {}, rng);
    EXPECT_EQ(best.weights.size(), 5);
    EXPECT_GE(best.mean_log_likelihood, first - 1e-4);  // EM's tolerance, over some hundred rounds
    better = better || best.mean_log_likelihood > first + 0.01;
  }
  EXPECT_TRUE(better);
}

TEST(GaussianMixture, SwapsFindLikelierMixturesThanBeginningsAlone) {
  const MatrixXd x = reference_samples().topRows(3);
  double without = 0.0;
  double with = 0.0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    base::Rng rng(seed), other(seed);
    const KMeans hard = k_means(x, {.clusters = 6}, rng);
    const GaussianMixtureOptions em{.floor = 1e-4};
    without +=
        best_gaussian_mixture(x, hard.labels, {.em = em, .swaps = 0}, rng).mean_log_likelihood;
    with += best_gaussian_mixture(x, hard.labels, {.em = em}, other).mean_log_likelihood;
  }
  EXPECT_GT(with / 3.0, without / 3.0 + 0.05);
}

TEST(GaussianMixture, NeverLowersItsLikelihood) {
  const MatrixXd x = reference_samples();
  base::Rng rng(6);
  const KMeans hard = k_means(x, {.clusters = 4}, rng);
  double last = -std::numeric_limits<double>::infinity();
  for (int iterations = 1; iterations <= 25; ++iterations) {
    const double now =
        gaussian_mixture(x, hard.labels, {.max_iterations = iterations, .tolerance = 1e-300})
            .mean_log_likelihood;
    EXPECT_GE(now, last - 1e-9) << iterations;  // the floor on covariances may cost round-off
    last = now;
  }
}

TEST(GaussianMixture, FindsTheCloudsItWasDrawnFrom) {
  const MatrixXd x = clouds(300);
  base::Rng rng(7);
  const KMeans hard = k_means(x, {.clusters = 3}, rng);
  const GaussianMixture mixture = gaussian_mixture(x, hard.labels);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(mixture.weights[k], 1.0 / 3.0, 1e-6);
    // .09 with 300 samples: a relative error of some sqrt(2 / 300).
    EXPECT_NEAR(mixture.covariances[static_cast<std::size_t>(k)](0, 0), 0.09, 0.03);
  }
}

TEST(ClusterFigures, AreWorkedByHand) {
  MatrixXd x(1, 4);
  x << 0.0, 2.0, 9.0, 11.0;
  MatrixXd centers(1, 2);
  centers << 1.0, 10.0;
  const ClusterFigures figures = cluster_figures(x, centers, {0, 0, 1, 1});
  EXPECT_DOUBLE_EQ(figures.within, 1.0);
  EXPECT_DOUBLE_EQ(figures.separation, 9.0);
  EXPECT_DOUBLE_EQ(figures.davies_bouldin, 2.0 / 9.0);
  MatrixXd memberships(2, 3);
  memberships << 0.2, 0.5, 0.9, 0.8, 0.5, 0.1;
  EXPECT_THAT(hard_labels(memberships), ::testing::ElementsAre(1, 0, 0));
}

TEST(Clustering, RefusesWhatDoesNotFit) {
  base::Rng rng(8);
  const MatrixXd x = reference_samples();
  EXPECT_THROW((void)k_means(x, {.clusters = 0}, rng), base::Error);
  EXPECT_THROW((void)k_means(x, {.swaps = -1}, rng), base::Error);
  EXPECT_THROW((void)k_means(MatrixXd(2, 0), {}, rng), base::Error);
  EXPECT_THROW((void)k_means(x, {.breath = -1}, rng), base::Error);
  EXPECT_THROW((void)best_gaussian_mixture(x, std::vector<int>(150, 0), {.beginnings = 0}, rng),
               base::Error);
  EXPECT_THROW((void)best_gaussian_mixture(x, std::vector<int>(150, 0), {.carried = 0}, rng),
               base::Error);
  EXPECT_THROW((void)best_gaussian_mixture(x, std::vector<int>(150, 0), {.patience = -1}, rng),
               base::Error);
  EXPECT_THROW((void)find_elbow(x, 0, {}, rng), base::Error);
  EXPECT_THROW((void)fuzzy_k_means(x, MatrixXd::Zero(5, 2)), base::Error);
  EXPECT_THROW((void)fuzzy_k_means(x, x.leftCols(2), {.fuzzifier = 1.0}), base::Error);
  EXPECT_THROW((void)gaussian_mixture(x, {0, 1}), base::Error);
  EXPECT_THROW((void)cluster_figures(x, x.leftCols(1), {3}), base::Error);
  // Samples that are all one have no covariance without a floor.
  EXPECT_THROW((void)gaussian_mixture(MatrixXd::Ones(2, 4), {0, 0, 0, 0}, {.floor = 0.0}),
               base::Error);
}

}  // namespace
}  // namespace laban::manifold
