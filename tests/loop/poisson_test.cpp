#include "laban/loop/poisson.h"

#include <random>

#include <gmock/gmock.h>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

const std::vector<int> kTree = {-1, 0, 1, 1, 0, 4, 4};

Eigen::MatrixXd random_values(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd values(rows, columns);
  for (Eigen::Index n = 0; n < values.size(); ++n) values(n) = normal(rng);
  return values;
}

TEST(Poisson, ResidualIsAtRoundOff) {
  for (const double weight : {0.0, 0.01, 1.0, 50.0}) {
    for (const int frames : {1, 2, 17, 100}) {
      SCOPED_TRACE(::testing::Message() << weight << " " << frames);
      const PoissonGrid grid(kTree, frames, weight);
      const Eigen::MatrixXd right = random_values(3 * std::ssize(kTree), frames, 5);
      const Eigen::MatrixXd residual = grid.laplacian(grid.solve(right)) - right;
      // The condition number is at most about 4 (N / pi)^2 (1 + weight).
      EXPECT_LT(residual.cwiseAbs().maxCoeff(), 1e-11 * (1.0 + weight));
    }
  }
}

/// Oracle: the matrix of the operator, column by column, solved densely.
TEST(Poisson, EqualsADenseSolve) {
  const int frames = 6;
  const PoissonGrid grid(kTree, frames, 0.7);
  const Eigen::Index size = std::ssize(kTree) * frames;
  Eigen::MatrixXd matrix(size, size);
  for (Eigen::Index n = 0; n < size; ++n) {
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(std::ssize(kTree), frames);
    unit(n) = 1.0;
    const Eigen::MatrixXd column = grid.laplacian(unit);
    matrix.col(n) = Eigen::Map<const Eigen::VectorXd>(column.data(), size);
  }
  EXPECT_LT((matrix - matrix.transpose()).cwiseAbs().maxCoeff(), 1e-15);
  const Eigen::MatrixXd right = random_values(std::ssize(kTree), frames, 6);
  const Eigen::VectorXd dense =
      matrix.ldlt().solve(Eigen::Map<const Eigen::VectorXd>(right.data(), size));
  const Eigen::MatrixXd solved = grid.solve(right);
  EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(solved.data(), size) - dense).norm(), 1e-12);
}

/// Rebuilds a signal from its own gradients: what is held at both ends plus what is solved for.
Eigen::MatrixXd rebuilt(const Eigen::MatrixXd& signal, double weight) {
  const Eigen::Index N = signal.cols();
  const PoissonGrid grid(kTree, static_cast<int>(N - 2), weight);
  Eigen::MatrixXd held = Eigen::MatrixXd::Zero(signal.rows(), N);  // zero inside, given at the ends
  held.col(0) = signal.col(0);
  held.col(N - 1) = signal.col(N - 1);
  const Eigen::MatrixXd inside = signal.middleCols(1, N - 2);
  Eigen::MatrixXd across = inside;
  for (Eigen::Index r = 0; r < across.rows(); ++r) {
    const int parent = kTree[static_cast<std::size_t>(r) % kTree.size()];
    if (parent >= 0) across.row(r) -= inside.row(r - r % std::ssize(kTree) + parent);
  }
  const Eigen::MatrixXd gradient = signal.rightCols(N - 1) - signal.leftCols(N - 1);
  const Eigen::MatrixXd held_gradient = held.rightCols(N - 1) - held.leftCols(N - 1);
  return grid.solve(grid.divergence(gradient - held_gradient, across));
}

TEST(Poisson, UnmodifiedGradientsGiveTheMotionBack) {
  const Eigen::MatrixXd signal = random_values(2 * std::ssize(kTree), 40, 9);
  for (const double weight : {0.0, 0.01, 1.0}) {
    EXPECT_LT((rebuilt(signal, weight) - signal.middleCols(1, 38)).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(Poisson, ConstantAndLinearSignalsPassThrough) {
  const Eigen::Index rows = std::ssize(kTree);
  Eigen::MatrixXd linear(rows, 30);
  for (Eigen::Index t = 0; t < 30; ++t) {
    for (Eigen::Index r = 0; r < rows; ++r) {
      linear(r, t) = static_cast<double>(r) + 0.25 * static_cast<double>(t * (r + 1));
    }
  }
  EXPECT_LT((rebuilt(linear, 1.0) - linear.middleCols(1, 28)).cwiseAbs().maxCoeff(), 1e-11);
  const Eigen::MatrixXd constant = Eigen::MatrixXd::Constant(rows, 30, 1.5);
  EXPECT_LT((rebuilt(constant, 1.0).array() - 1.5).abs().maxCoeff(), 1e-12);
}

// By hand: one joint, a jump of 1 on the middle one of three edges is spread as a line, 1/3 an
// edge.
TEST(Poisson, SpreadsAJumpEvenlyOverTime) {
  const PoissonGrid grid({-1}, 2, 0.0);
  Eigen::MatrixXd time = Eigen::MatrixXd::Zero(1, 3);
  time(0, 1) = -1.0;
  const Eigen::MatrixXd u = grid.solve(grid.divergence(time, Eigen::MatrixXd::Zero(1, 2)));
  EXPECT_NEAR(u(0, 0), 1.0 / 3.0, 1e-15);
  EXPECT_NEAR(u(0, 1), -1.0 / 3.0, 1e-15);
}

TEST(Poisson, RefusesWhatIsNoGrid) {
  EXPECT_THROW(PoissonGrid({}, 3, 0.0), base::Error);
  EXPECT_THROW(PoissonGrid({-1, 1}, 3, 0.0), base::Error);
  EXPECT_THROW(PoissonGrid({-1}, 0, 0.0), base::Error);
  EXPECT_THROW(PoissonGrid({-1}, 3, -1.0), base::Error);
  const PoissonGrid grid({-1, 0}, 3, 1.0);
  EXPECT_THROW((void)grid.solve(Eigen::MatrixXd::Zero(3, 3)), base::Error);
  EXPECT_THROW((void)grid.solve(Eigen::MatrixXd::Zero(2, 4)), base::Error);
}

}  // namespace
}  // namespace laban::loop
