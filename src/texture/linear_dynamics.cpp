#include "laban/texture/linear_dynamics.h"

#include "laban/base/error.h"

#include "texture/floored_covariance.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void check_segments(std::span<const MatrixXd> segments) {
  if (segments.empty()) throw Error(ErrorKind::kData, "fit_dynamics: there is no segment");
  const Index m = segments.front().rows();
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const std::string place = "fit_dynamics: segment " + std::to_string(s);
    if (segments[s].rows() != m || m == 0) {
      throw Error(ErrorKind::kData, place + " has " + std::to_string(segments[s].rows()) +
                                        " rows, the first " + std::to_string(m) +
                                        "; all need as many, at least one");
    }
    if (segments[s].cols() < 3) {
      throw Error(ErrorKind::kData, place + " has " + std::to_string(segments[s].cols()) +
                                        " frames, a step needs three");
    }
    if (!segments[s].allFinite()) throw Error(ErrorKind::kData, place + " is not finite");
  }
}

/// Rows of the regression, stacked: 2 m regressors (state, velocity) and m targets a step.
struct Stacked {
  MatrixXd regressors;  ///< 2 m x N
  MatrixXd targets;     ///< m x N: what is left of the next state after going on as before
};

Stacked stack(std::span<const MatrixXd> segments) {
  const Index m = segments.front().rows();
  Index rows = 0;
  for (const MatrixXd& x : segments) rows += x.cols() - 2;
  Stacked stacked{MatrixXd(2 * m, rows), MatrixXd(m, rows)};
  Index at = 0;
  for (const MatrixXd& x : segments) {
    const Index n = x.cols() - 2;
    const auto now = x.middleCols(1, n);
    const auto velocity = now - x.leftCols(n);
    stacked.regressors.block(0, at, m, n) = now;
    stacked.regressors.block(m, at, m, n) = velocity;
    stacked.targets.middleCols(at, n) = x.rightCols(n) - now - velocity;
    at += n;
  }
  return stacked;
}

}  // namespace

// Notation [Li02, App. B]          here
//   x_{t-1}, x_{t-2}  regressors   x = now, v = now - before: the same space, better conditioned
//   A1, A2            dynamics     I + I + K_x + K_v, -I - K_v
//   R_ij, Q_i         moments      of the stacked rows, about their means
// Without ridge this is the paper's closed form (METHODS 2.2, with its slips mended). With one, the
// fit shrinks towards going on at constant velocity, x_{t+1} = 2 x_t - x_{t-1}, not towards zero:
// of a second of motion, 31 regressors of 58 rows, a ridge towards zero would take the speed away,
// whose variance is a thousandth of the state's.
LinearDynamics fit_dynamics(std::span<const MatrixXd> segments, const DynamicsFit& options) {
  if (!(options.ridge >= 0.0) || !(options.variance_floor >= 0.0)) {
    throw Error(ErrorKind::kUsage, "fit_dynamics: ridge and variance floor must be >= 0");
  }
  check_segments(segments);
  Stacked rows = stack(segments);
  const Index m = rows.targets.rows();
  const auto n = static_cast<double>(rows.targets.cols());
  const VectorXd regressor_mean = rows.regressors.rowwise().mean();
  const VectorXd target_mean = rows.targets.rowwise().mean();
  rows.regressors.colwise() -= regressor_mean;
  rows.targets.colwise() -= target_mean;

  MatrixXd moments = rows.regressors * rows.regressors.transpose() / n;
  for (const Index part : {Index{0}, m}) {
    auto diagonal = moments.diagonal().segment(part, m);
    diagonal.array() += options.ridge * diagonal.mean();
  }
  const MatrixXd cross = rows.targets * rows.regressors.transpose() / n;
  // A basis that shows less than 2 m + 1 rows, or still states, leaves directions without moment:
  // the complete decomposition gives them no gain.
  const MatrixXd gain =
      moments.completeOrthogonalDecomposition().solve(cross.transpose()).transpose();
  const MatrixXd left = rows.targets - gain * rows.regressors;

  LinearDynamics dynamics;
  const MatrixXd identity = MatrixXd::Identity(m, m);
  dynamics.a1 = 2.0 * identity + gain.leftCols(m) + gain.rightCols(m);
  dynamics.a2 = -identity - gain.rightCols(m);
  dynamics.offset = target_mean - gain * regressor_mean;
  dynamics.covariance = floored_covariance(left * left.transpose() / n, options.variance_floor);
  return dynamics;
}

}  // namespace laban::texture
