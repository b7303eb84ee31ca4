#include "laban/manifold/som.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "support/listener.h"

#include "samples.h"

namespace laban::manifold {
namespace {

using test::reference_samples;

/// The rule of one epoch as it is written, node by node and sample by sample.
Eigen::MatrixXd plain_epoch(const SelfOrganizingMap& before, const Eigen::MatrixXd& x,
                            double radius) {
  const std::vector<int> units = best_matching_units(before, x).first;
  Eigen::MatrixXd codebook = before.codebook;
  for (int node = 0; node < codebook.cols(); ++node) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(x.rows());
    double weight = 0.0;
    for (int n = 0; n < x.cols(); ++n) {
      const Eigen::Vector2d apart =
          before.position(node) - before.position(units[static_cast<std::size_t>(n)]);
      const auto side = [radius](double d) {
        const double u = d / radius;
        return std::exp(-0.5 * u * u) + 1e-4 * std::exp(-0.5 * u * u / 64.0);
      };
      const double h = side(apart.x()) * side(apart.y());
      sum += h * x.col(n);
      weight += h;
    }
    codebook.col(node) = sum / weight;
  }
  return codebook;
}

// Oracle: one more epoch than a map that is there, by the plain rule.
TEST(Som, AnEpochIsTheBatchRule) {
  const Eigen::MatrixXd x = reference_samples();
  SomOptions options;
  options.rows = 5;
  options.columns = 7;
  options.first_radius = 2.0;
  options.last_radius = 2.0;
  options.mending_rounds = 0;
  options.epochs = 3;
  const SelfOrganizingMap three = fit_som(x, options);
  options.epochs = 4;
  const SelfOrganizingMap four = fit_som(x, options);
  EXPECT_LT((four.codebook - plain_epoch(three, x, 2.0)).cwiseAbs().maxCoeff(), 1e-12);
}

// reference_values.py: MiniSom with its own width of 1 reaches .033195 and .046667 in 30 epochs. As
// on captures, there are about four nodes a sample. Where samples are as many as nodes, a last
// radius of .5 quantizes less finely than MiniSom does, at fewer topographic errors.
TEST(Som, IsNoWorseThanMiniSomOnTheSameSamplesAndEpochs) {
  SomOptions options;
  options.rows = 24;
  options.columns = 24;
  options.epochs = 30;
  const Eigen::MatrixXd x = reference_samples();
  const MapErrors errors = map_errors(fit_som(x, options), x);
  EXPECT_LE(errors.quantization, 0.033195);
  EXPECT_LE(errors.topographic, 0.046667);
}

// A hundred units in twice as many nodes leave some sample's second best elsewhere.
TEST(Som, MendingLowersTopographicErrorsAndSamplesKeepTheirUnits) {
  SomOptions options{.rows = 14, .columns = 14, .epochs = 20};
  const Eigen::MatrixXd x = reference_samples();
  options.mending_rounds = 0;
  const MapErrors before = map_errors(fit_som(x, options), x);
  options.mending_rounds = 10;
  const MapErrors after = map_errors(fit_som(x, options), x);
  EXPECT_GT(before.topographic, 0.0);
  EXPECT_LE(after.topographic, 0.2 * before.topographic);
  EXPECT_LE(after.quantization, 1.01 * before.quantization);
}

// As many samples as nodes: hardly a node is free, and units give way.
TEST(Som, MendingLowersTopographicErrorsInACrowd) {
  SomOptions options{.rows = 11, .columns = 11, .epochs = 20};
  const Eigen::MatrixXd x = reference_samples();
  options.mending_rounds = 0;
  const MapErrors before = map_errors(fit_som(x, options), x);
  options.mending_rounds = 20;
  const MapErrors after = map_errors(fit_som(x, options), x);
  EXPECT_GT(before.topographic, 0.05);
  EXPECT_EQ(after.topographic, 0.0);
  EXPECT_LE(after.quantization, 1.01 * before.quantization);
}

TEST(Som, UnitsAreTheNearestByEnumeration) {
  const Eigen::MatrixXd x = reference_samples();
  const SelfOrganizingMap map = fit_som(x, {.rows = 6, .columns = 4, .epochs = 5});
  const BestUnits best = best_matching_units(map, x);
  for (int n = 0; n < x.cols(); ++n) {
    const auto cell = static_cast<std::size_t>(n);
    const Eigen::RowVectorXd distances = (map.codebook.colwise() - x.col(n)).colwise().norm();
    EXPECT_DOUBLE_EQ(distances[best.first[cell]], distances.minCoeff());
    int nearer = 0;
    for (int node = 0; node < distances.size(); ++node) {
      nearer += distances[node] < distances[best.second[cell]] - 1e-12 ? 1 : 0;
    }
    EXPECT_EQ(nearer, 1);
    EXPECT_NE(best.first[cell], best.second[cell]);
  }
}

TEST(Som, DoesNotDependOnThreads) {
  const Eigen::MatrixXd x = reference_samples();
  SomOptions options{.rows = 9, .columns = 9, .epochs = 6};
  const SelfOrganizingMap one = fit_som(x, options);
  options.threads = 3;
  EXPECT_EQ(one.codebook, fit_som(x, options).codebook);
}

TEST(Som, OnePoseIsTheWholeMap) {
  const Eigen::MatrixXd x = Eigen::MatrixXd::Constant(4, 1, 2.5);
  const SelfOrganizingMap map = fit_som(x, {.rows = 3, .columns = 3, .epochs = 2});
  EXPECT_LT((map.codebook.array() - 2.5).abs().maxCoeff(), 1e-12);
  EXPECT_EQ(map_errors(map, x).quantization, 0.0);
}

TEST(Som, ErrorsAreWorkedByHand) {
  // Four nodes on a line of two rows; a sample between the diagonal ones.
  SelfOrganizingMap map{1, 4, Eigen::MatrixXd(1, 4)};
  map.codebook << 0.0, 10.0, 20.0, 1.0;
  Eigen::MatrixXd x(1, 2);
  x << 0.4, 12.0;
  const MapErrors errors = map_errors(map, x);
  EXPECT_DOUBLE_EQ(errors.quantization, (0.4 + 2.0) / 2.0);
  EXPECT_DOUBLE_EQ(errors.topographic, 0.5);  // 0.4 lies between nodes 0 and 3, which are far apart
  EXPECT_DOUBLE_EQ(unit_distances(map)(0, 3), 19.0);
  EXPECT_DOUBLE_EQ(unit_distances(map)(0, 1), 10.0);
}

TEST(Som, RefusesWhatItCannotMap) {
  const Eigen::MatrixXd x = reference_samples();
  EXPECT_THROW((void)fit_som(x, {.rows = 1}), base::Error);
  EXPECT_THROW((void)fit_som(x, {.epochs = 0}), base::Error);
  EXPECT_THROW((void)fit_som(x, {.mending_rounds = -1}), base::Error);
  EXPECT_THROW((void)fit_som(Eigen::MatrixXd(3, 0)), base::Error);
  EXPECT_THROW((void)fit_som(Eigen::MatrixXd::Constant(3, 2, std::nan(""))), base::Error);
  const SelfOrganizingMap map = fit_som(x, {.rows = 2, .columns = 2, .epochs = 1});
  EXPECT_THROW((void)best_matching_units(map, x.topRows(2)), base::Error);
}

TEST(Som, TellsProgressAndCanBeStopped) {
  const Eigen::MatrixXd x = reference_samples();
  test::expect_told_and_stopped(4, [&](base::Progress* progress) {
    (void)fit_som(x, {.rows = 2, .columns = 2, .epochs = 4}, progress);
  });
}

}  // namespace
}  // namespace laban::manifold
