#include "laban/texture/constrained_synthesis.h"

#include <gtest/gtest.h>

#include "laban/base/error.h"

#include "known_dynamics.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::known_dynamics;

const MatrixXd kNoNoise;

/// The rows of METHODS' Fig. 5, whitened, over all frames, and their right side for no noise.
struct DenseRows {
  MatrixXd a;
  VectorXd b;
};

DenseRows dense_rows(const LinearDynamics& dynamics, int length) {
  const Index m = dynamics.dimension();
  const MatrixXd whiten = MatrixXd(Eigen::LLT<MatrixXd>(dynamics.covariance).matrixL()).inverse();
  DenseRows rows{MatrixXd::Zero(m * (length - 2), m * length), VectorXd(m * (length - 2))};
  for (Index t = 0; t < length - 2; ++t) {
    rows.a.block(m * t, m * t, m, m) = -whiten * dynamics.a2;
    rows.a.block(m * t, m * (t + 1), m, m) = -whiten * dynamics.a1;
    rows.a.block(m * t, m * (t + 2), m, m) = whiten;
    rows.b.segment(m * t, m) = whiten * dynamics.offset;
  }
  return rows;
}

/// Columns of the unknown frames.
MatrixXd unknown_columns(const MatrixXd& a, Index m, const std::vector<int>& known) {
  std::vector<Index> kept;
  for (Index t = 0; t < a.cols() / m; ++t) {
    if (std::find(known.begin(), known.end(), static_cast<int>(t)) != known.end()) continue;
    for (Index d = 0; d < m; ++d) kept.push_back(m * t + d);
  }
  return a(Eigen::all, kept);
}

// Oracle: QR of the dense system.
VectorXd dense_solution(const LinearDynamics& dynamics, const MatrixXd& states,
                        const MatrixXd& noise, const std::vector<int>& known) {
  const auto length = static_cast<int>(states.cols());
  const DenseRows rows = dense_rows(dynamics, length);
  MatrixXd given = MatrixXd::Zero(states.rows(), length);
  for (const int frame : known) given.col(frame) = states.col(frame);
  const VectorXd right = rows.b + noise.reshaped() - rows.a * given.reshaped();
  return unknown_columns(rows.a, states.rows(), known).colPivHouseholderQr().solve(right);
}

std::vector<int> ends(int length) {
  return {0, 1, length - 2, length - 1};
}

TEST(ConstrainedStates, EqualTheDenseLeastSquaresSolution) {
  base::Rng rng(3);
  for (const int m : {1, 3, 15}) {
    for (const int length : {5, 6, 7, 12, 40}) {
      SCOPED_TRACE(testing::Message() << m << " dimensions, " << length << " frames");
      const LinearDynamics dynamics = known_dynamics(m, rng);
      const MatrixXd states = draw_noise(m, length, 1.0, rng);
      const MatrixXd noise = draw_noise(m, length - 2, 1.0, rng);
      std::vector<int> known = ends(length);
      if (length >= 12) known = {0, 1, 4, 5, 8, length - 2, length - 1};
      const MatrixXd x = ConstrainedStates(dynamics, length, known).solve(states, noise);
      const VectorXd expected = dense_solution(dynamics, states, noise, known);
      Index n = 0;
      for (int t = 0; t < length; ++t) {
        if (std::find(known.begin(), known.end(), t) != known.end()) {
          EXPECT_EQ(x.col(t), states.col(t));
          continue;
        }
        EXPECT_LE((x.col(t) - expected.segment(n, m)).norm(), 1e-8 * expected.norm());
        n += m;
      }
    }
  }
}

TEST(ConstrainedStates, EqualTheDenseSolutionWhereTheMotionIsLongAndNearlyFree) {
  base::Rng rng(4);
  // A double integrator of small noise: the worst conditioned of what motion is like.
  LinearDynamics dynamics = known_dynamics(4, rng);
  dynamics.a1 = 2.0 * MatrixXd::Identity(4, 4);
  dynamics.a2 = -MatrixXd::Identity(4, 4);
  dynamics.covariance = 1e-6 * MatrixXd::Identity(4, 4);
  dynamics.covariance(3, 3) = 1e-2;
  const int length = 172;
  const MatrixXd states = draw_noise(4, length, 1.0, rng);
  const MatrixXd noise = draw_noise(4, length - 2, 1.0, rng);
  const MatrixXd x = ConstrainedStates(dynamics, length, ends(length)).solve(states, noise);
  const VectorXd expected = dense_solution(dynamics, states, noise, ends(length));
  EXPECT_LE((x.middleCols(2, length - 4).reshaped() - expected).norm(), 1e-8 * expected.norm());
}

// With n_t standard normal the solution's covariance is (A' W A)^-1, W of the rows before
// whitening.
TEST(ConstrainedStates, AreExactDrawsGivenTheEnds) {
  base::Rng rng(5);
  const int m = 2;
  const int length = 7;
  const LinearDynamics dynamics = known_dynamics(m, rng);
  const MatrixXd states = draw_noise(m, length, 1.0, rng);
  const ConstrainedStates system(dynamics, length, ends(length));
  const MatrixXd a = unknown_columns(dense_rows(dynamics, length).a, m, ends(length));
  const MatrixXd expected = (a.transpose() * a).inverse();
  const VectorXd mean = system.solve(states, kNoNoise).middleCols(2, length - 4).reshaped();
  const Index unknown = m * (length - 4);
  MatrixXd sum = MatrixXd::Zero(unknown, unknown);
  constexpr int kDraws = 40000;
  for (int n = 0; n < kDraws; ++n) {
    const MatrixXd x = system.solve(states, draw_noise(m, length - 2, 1.0, rng));
    const VectorXd away = x.middleCols(2, length - 4).reshaped() - mean;
    sum += away * away.transpose();
  }
  // A variance of 40 000 draws is off by 0.7 %; four times that and more.
  for (Index i = 0; i < unknown; ++i) {
    for (Index j = 0; j < unknown; ++j) {
      const double scale = std::sqrt(expected(i, i) * expected(j, j));
      EXPECT_NEAR(sum(i, j) / kDraws, expected(i, j), 0.03 * scale) << i << ", " << j;
    }
  }
}

TEST(ConstrainedStates, RunTheSystemForwardsWhereOnlyItsStartIsKnown) {
  base::Rng rng(6);
  const LinearDynamics dynamics = known_dynamics(3, rng);
  const MatrixXd states = draw_noise(3, 30, 1.0, rng);
  const MatrixXd noise = draw_noise(3, 28, 1.0, rng);
  const MatrixXd x = ConstrainedStates(dynamics, 30, {0, 1}).solve(states, noise);
  const MatrixXd B = Eigen::LLT<MatrixXd>(dynamics.covariance).matrixL();
  for (Index t = 2; t < 30; ++t) {
    const VectorXd expected = dynamics.a1 * x.col(t - 1) + dynamics.a2 * x.col(t - 2) +
                              dynamics.offset + B * noise.col(t - 2);
    EXPECT_LE((x.col(t) - expected).norm(), 1e-9) << t;
  }
}

// Oracle: the normal density of the ends, propagated frame by frame from the start.
TEST(ConstrainedStates, TellHowLikelyTheSystemIsToComeToItsEnds) {
  base::Rng rng(10);
  const int m = 3;
  const LinearDynamics dynamics = known_dynamics(m, rng);
  const MatrixXd states = draw_noise(m, 9, 1.0, rng);
  VectorXd mean(2 * m);
  mean << states.col(0), states.col(1);
  MatrixXd covariance = MatrixXd::Zero(2 * m, 2 * m);
  MatrixXd forwards = MatrixXd::Zero(2 * m, 2 * m);
  forwards.topRightCorner(m, m).setIdentity();
  forwards.bottomLeftCorner(m, m) = dynamics.a2;
  forwards.bottomRightCorner(m, m) = dynamics.a1;
  for (int t = 2; t < 9; ++t) {
    mean = forwards * mean;
    mean.tail(m) += dynamics.offset;
    covariance = forwards * covariance * forwards.transpose();
    covariance.bottomRightCorner(m, m) += dynamics.covariance;
  }
  VectorXd away(2 * m);
  away << states.col(7), states.col(8);
  away -= mean;
  const Eigen::LLT<MatrixXd> factor(covariance);
  const double expected =
      -0.5 * (factor.matrixL().solve(away).squaredNorm() + 2.0 * m * 1.8378770664093453) -
      factor.matrixLLT().diagonal().array().log().sum();
  const ConstrainedStates system(dynamics, 9, ends(9));
  EXPECT_NEAR(system.log_density(system.solve(states, kNoNoise)), expected,
              1e-9 * std::abs(expected));
}

TEST(ConstrainedStates, AreWhatTheyWereUnderTheirOwnInnovations) {
  base::Rng rng(7);
  const LinearDynamics dynamics = known_dynamics(5, rng);
  const MatrixXd states = draw_noise(5, 68, 1.0, rng);
  const MatrixXd noise = innovations(dynamics, states);
  const std::vector<int> known{0, 1, 40, 66, 67};
  const MatrixXd x = ConstrainedStates(dynamics, 68, known).solve(states, noise);
  EXPECT_LE((x - states).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(ConstrainedStates, RefuseKnownFramesOutOfOrderAndSizesThatDoNotFit) {
  base::Rng rng(8);
  const LinearDynamics dynamics = known_dynamics(2, rng);
  EXPECT_THROW(ConstrainedStates(dynamics, 8, {0, 2}), base::Error);
  EXPECT_THROW(ConstrainedStates(dynamics, 8, {0, 1, 5, 5}), base::Error);
  EXPECT_THROW(ConstrainedStates(dynamics, 8, {0, 1, 8}), base::Error);
  const ConstrainedStates system(dynamics, 8, {0, 1});
  EXPECT_THROW(static_cast<void>(system.solve(MatrixXd::Zero(2, 7), kNoNoise)), base::Error);
  EXPECT_THROW(static_cast<void>(system.solve(MatrixXd::Zero(2, 8), MatrixXd::Zero(2, 7))),
               base::Error);
  LinearDynamics flat = dynamics;
  flat.covariance.setZero();
  EXPECT_THROW(ConstrainedStates(flat, 8, {0, 1}), base::Error);
}

TEST(ConstrainedStates, AreAsGivenWhereAllFramesAreKnown) {
  base::Rng rng(9);
  const MatrixXd states = draw_noise(2, 3, 1.0, rng);
  EXPECT_EQ(ConstrainedStates(known_dynamics(2, rng), 3, {0, 1, 2}).solve(states, kNoNoise),
            states);
}

}  // namespace
}  // namespace laban::texture
