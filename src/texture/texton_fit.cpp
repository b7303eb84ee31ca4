#include "laban/texture/texton_fit.h"

#include <algorithm>
#include <cmath>

#include "laban/base/error.h"
#include "laban/math/constants.h"

#include "texture/floored_covariance.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kFramesAState = 4;

void check(const Eigen::Ref<const MatrixXd>& observations, std::span<const Segment> segments,
           const TextonFit& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  if (segments.empty()) throw Error(ErrorKind::kData, "fit_texton: there is no segment");
  for (const Segment& segment : segments) {
    const std::string place = "fit_texton: frames [" + std::to_string(segment.begin) + ", " +
                              std::to_string(segment.begin + segment.length) + ")";
    if (segment.begin < 0 || segment.length < 3 ||
        segment.begin > observations.cols() - segment.length) {
      throw Error(ErrorKind::kData, place + " are fewer than three or not among the " +
                                        std::to_string(observations.cols()));
    }
    if (!observations.middleCols(segment.begin, segment.length).allFinite()) {
      throw Error(ErrorKind::kData, place + " are not finite");
    }
  }
}

MatrixXd pool(const Eigen::Ref<const MatrixXd>& observations, std::span<const Segment> segments) {
  Index frames = 0;
  for (const Segment& segment : segments) frames += segment.length;
  MatrixXd pooled(observations.rows(), frames);
  Index at = 0;
  for (const Segment& segment : segments) {
    pooled.middleCols(at, segment.length) = observations.middleCols(segment.begin, segment.length);
    at += segment.length;
  }
  return pooled;
}

/// States by explained variance. @param variances  of the principal directions, falling.
Index choose_dimension(const VectorXd& variances, Index frames, const TextonFit& options) {
  const double total = variances.sum();
  Index m = options.min_dimension;
  while (m < options.max_dimension && m < variances.size() &&
         variances.head(m).sum() < options.explained_share * total) {
    ++m;
  }
  return std::max<Index>(1, std::min({m, variances.size(), frames / kFramesAState}));
}

/// Principal directions; the largest entry of each is positive, so that they are unique.
MatrixXd principal_basis(const MatrixXd& eigenvectors, Index m) {
  MatrixXd basis = eigenvectors.rowwise().reverse().leftCols(m);
  for (Index k = 0; k < m; ++k) {
    Index largest = 0;
    basis.col(k).cwiseAbs().maxCoeff(&largest);
    if (basis(largest, k) < 0.0) basis.col(k) *= -1.0;
  }
  return basis;
}

/// Moments of (x_t, x_{t+1}) over all pairs inside the segments.
void fit_start(const std::vector<MatrixXd>& states, double floor, Texton& texton) {
  const Index m = states.front().rows();
  Index pairs = 0;
  for (const MatrixXd& x : states) pairs += x.cols() - 1;
  MatrixXd stacked(2 * m, pairs);
  Index at = 0;
  for (const MatrixXd& x : states) {
    const Index n = x.cols() - 1;
    stacked.block(0, at, m, n) = x.leftCols(n);
    stacked.block(m, at, m, n) = x.rightCols(n);
    at += n;
  }
  texton.start_mean = stacked.rowwise().mean();
  stacked.colwise() -= texton.start_mean;
  texton.start_covariance =
      floored_covariance(stacked * stacked.transpose() / static_cast<double>(pairs), floor);
}

Eigen::LLT<MatrixXd> factor(const MatrixXd& covariance) {
  Eigen::LLT<MatrixXd> llt(covariance);
  if (llt.info() != Eigen::Success) {
    throw Error(ErrorKind::kNumeric, "texton: a covariance is not positive definite");
  }
  return llt;
}

double log_determinant(const Eigen::LLT<MatrixXd>& llt) {
  return 2.0 * llt.matrixLLT().diagonal().array().log().sum();
}

/// -1/2 of each column's squared Mahalanobis length.
VectorXd half_squares(const Eigen::LLT<MatrixXd>& llt, const MatrixXd& columns) {
  return -0.5 * llt.matrixL().solve(columns).colwise().squaredNorm().transpose();
}

/// m x (F - 2) prediction errors of the states from frame 2 on.
MatrixXd prediction_errors(const LinearDynamics& dynamics, const MatrixXd& x) {
  const Index n = x.cols() - 2;
  MatrixXd left = x.rightCols(n);
  left.noalias() -= dynamics.a1 * x.middleCols(1, n);
  left.noalias() -= dynamics.a2 * x.leftCols(n);
  left.colwise() -= dynamics.offset;
  return left;
}

}  // namespace

std::vector<std::string> TextonFit::problems() const {
  std::vector<std::string> found;
  const auto require = [&](bool holds, const std::string& what) {
    if (!holds) found.push_back("TextonFit::" + what);
  };
  require(min_dimension >= 1, "min_dimension must be >= 1");
  require(max_dimension >= min_dimension, "max_dimension must be >= min_dimension");
  require(explained_share > 0.0 && explained_share <= 1.0, "explained_share must be in (0, 1]");
  require(ridge >= 0.0 && std::isfinite(ridge), "ridge must be >= 0");
  require(variance_floor > 0.0 && std::isfinite(variance_floor), "variance_floor must be > 0");
  return found;
}

Texton fit_texton(const Eigen::Ref<const MatrixXd>& observations, std::span<const Segment> segments,
                  const TextonFit& options) {
  check(observations, segments, options);
  MatrixXd y = pool(observations, segments);
  const auto frames = static_cast<double>(y.cols());
  Texton texton;
  texton.mean = y.rowwise().mean();
  y.colwise() -= texton.mean;
  MatrixXd covariance = MatrixXd::Zero(y.rows(), y.rows());
  covariance.selfadjointView<Eigen::Lower>().rankUpdate(y, 1.0 / frames);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(covariance);
  const VectorXd variances = solver.eigenvalues().reverse().cwiseMax(0.0);
  const Index m = choose_dimension(variances, y.cols(), options);
  texton.basis = principal_basis(solver.eigenvectors(), m);
  const Index outside = y.rows() - m;
  texton.residual_variance =
      outside == 0 ? options.variance_floor
                   : std::max(options.variance_floor,
                              variances.tail(outside).sum() / static_cast<double>(outside));
  const MatrixXd x = texton.basis.transpose() * y;
  std::vector<MatrixXd> states;
  Index at = 0;
  for (const Segment& segment : segments) {
    states.emplace_back(x.middleCols(at, segment.length));
    at += segment.length;
  }
  texton.dynamics =
      fit_dynamics(states, {.ridge = options.ridge, .variance_floor = options.variance_floor});
  fit_start(states, options.variance_floor, texton);
  return texton;
}

int parameter_count(const Texton& texton) {
  const auto d = static_cast<int>(texton.mean.size());
  const int m = texton.dimension();
  const int basis = d * m - m * (m + 1) / 2;
  const int dynamics = 2 * m * m + m + m * (m + 1) / 2;
  const int start = 2 * m + m * (2 * m + 1);
  return d + basis + 1 + dynamics + start;
}

TextonLikelihood::TextonLikelihood(const Texton& texton)
    : texton_(texton),
      noise_(factor(texton.dynamics.covariance)),
      start_(factor(texton.start_covariance)) {
  const auto m = static_cast<double>(texton.dimension());
  const double outside = static_cast<double>(texton.mean.size()) - m;
  noise_constant_ = -0.5 * (m * math::kLogTwoPi + log_determinant(noise_));
  start_constant_ = -0.5 * (2.0 * m * math::kLogTwoPi + log_determinant(start_));
  residual_constant_ = -0.5 * outside * (math::kLogTwoPi + std::log(texton.residual_variance));
}

VectorXd TextonLikelihood::residual_terms(const MatrixXd& centered, const MatrixXd& x) const {
  const MatrixXd outside = centered - texton_.basis * x;
  return (-0.5 / texton_.residual_variance * outside.colwise().squaredNorm().transpose()).array() +
         residual_constant_;
}

VectorXd TextonLikelihood::step_terms(const Eigen::Ref<const MatrixXd>& y) const {
  VectorXd terms = VectorXd::Zero(y.cols());
  if (y.cols() < 3) return terms;
  const MatrixXd centered = y.colwise() - texton_.mean;
  const MatrixXd x = texton_.basis.transpose() * centered;
  const Index n = y.cols() - 2;
  terms.tail(n) =
      half_squares(noise_, prediction_errors(texton_.dynamics, x)).array() + noise_constant_;
  terms.tail(n) += residual_terms(centered, x).tail(n);
  return terms;
}

VectorXd TextonLikelihood::start_terms(const Eigen::Ref<const MatrixXd>& y) const {
  VectorXd terms = VectorXd::Zero(y.cols());
  if (y.cols() < 2) return terms;
  const MatrixXd centered = y.colwise() - texton_.mean;
  const MatrixXd x = texton_.basis.transpose() * centered;
  const Index n = y.cols() - 1;
  MatrixXd pairs(2 * x.rows(), n);
  pairs << x.leftCols(n), x.rightCols(n);
  pairs.colwise() -= texton_.start_mean;
  const VectorXd residuals = residual_terms(centered, x);
  terms.head(n) = half_squares(start_, pairs).array() + start_constant_;
  terms.head(n) += residuals.head(n) + residuals.tail(n);
  return terms;
}

double TextonLikelihood::segment(const Eigen::Ref<const MatrixXd>& y) const {
  return start_terms(y.leftCols(2))[0] + step_terms(y).sum();
}

double segments_log_likelihood(const MatrixXd& observations, const Texton& texton,
                               const std::vector<Segment>& segments) {
  const TextonLikelihood likelihood(texton);
  double sum = 0.0;
  for (const Segment& segment : segments)
    sum += likelihood.segment(observations.middleCols(segment.begin, segment.length));
  return sum;
}

MatrixXd one_step_predictions(const Texton& texton, const Eigen::Ref<const MatrixXd>& y) {
  MatrixXd predicted = y;
  if (y.cols() < 3) return predicted;
  const MatrixXd x = texton.basis.transpose() * (y.colwise() - texton.mean);
  const Index n = y.cols() - 2;
  MatrixXd next = texton.dynamics.a1 * x.middleCols(1, n) + texton.dynamics.a2 * x.leftCols(n);
  next.colwise() += texton.dynamics.offset;
  predicted.rightCols(n) = (texton.basis * next).colwise() + texton.mean;
  return predicted;
}

}  // namespace laban::texture
