#include "laban/manifold/gaussian_mixture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "laban/base/error.h"
#include "laban/math/constants.h"

namespace laban::manifold {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;

/// Means, covariances and weights from responsibilities.
void maximize(const Eigen::Ref<const MatrixXd>& x, double floor, GaussianMixture& mixture) {
  // A component that has lost all samples keeps a weight above 0, as in scikit-learn.
  constexpr double kLeastMass = 10.0 * std::numeric_limits<double>::epsilon();
  const Index clusters = mixture.responsibilities.rows();
  for (Index k = 0; k < clusters; ++k) {
    const auto shares = mixture.responsibilities.row(k);
    const double mass = shares.sum() + kLeastMass;
    mixture.means.col(k) = x * shares.transpose() / mass;
    const MatrixXd weighted =
        ((x.colwise() - mixture.means.col(k)).array().rowwise() * (shares.array() / mass).sqrt())
            .matrix();
    MatrixXd& covariance = mixture.covariances[static_cast<std::size_t>(k)];
    covariance.noalias() = weighted * weighted.transpose();
    covariance.diagonal().array() += floor;
    mixture.weights[k] = mass;
  }
  mixture.weights /= mixture.weights.sum();
}

/// Responsibilities under the mixture. @returns the mean log-likelihood.
double expect(const Eigen::Ref<const MatrixXd>& x, GaussianMixture& mixture) {
  const auto dimensions = static_cast<double>(x.rows());
  MatrixXd& log_density = mixture.responsibilities;
  for (Index k = 0; k < log_density.rows(); ++k) {
    const Eigen::LLT<MatrixXd> factor(mixture.covariances[static_cast<std::size_t>(k)]);
    if (factor.info() != Eigen::Success) {
      throw Error(ErrorKind::kNumeric,
                  "gaussian_mixture: the covariance of component " + std::to_string(k) +
                      " is not positive definite; raise GaussianMixtureOptions::floor");
    }
    const MatrixXd white = factor.matrixL().solve(x.colwise() - mixture.means.col(k));
    const double log_root = MatrixXd(factor.matrixL()).diagonal().array().log().sum();
    const double constant =
        std::log(mixture.weights[k]) - log_root - 0.5 * dimensions * math::kLogTwoPi;
    log_density.row(k) = (constant - 0.5 * white.colwise().squaredNorm().array()).matrix();
  }
  double sum = 0.0;
  for (Index n = 0; n < log_density.cols(); ++n) {
    auto column = log_density.col(n).array();
    const double greatest = column.maxCoeff();
    const double log_sum = greatest + std::log((column - greatest).exp().sum());
    column = (column - log_sum).exp();
    sum += log_sum;
  }
  return sum / static_cast<double>(x.cols());
}

GaussianMixture begin(const Eigen::Ref<const MatrixXd>& x, const std::vector<int>& labels) {
  if (x.cols() < 1 || x.rows() < 1 || std::ssize(labels) != x.cols() || !x.allFinite() ||
      *std::min_element(labels.begin(), labels.end()) < 0) {
    throw Error(ErrorKind::kData, "gaussian_mixture: " + std::to_string(x.cols()) +
                                      " samples and " + std::to_string(labels.size()) +
                                      " labels (must be as many, at least one, "
                                      "labels >= 0, samples finite)");
  }
  const Index clusters = *std::max_element(labels.begin(), labels.end()) + 1;
  GaussianMixture mixture;
  mixture.weights.resize(clusters);
  mixture.means.resize(x.rows(), clusters);
  mixture.covariances.resize(static_cast<std::size_t>(clusters));
  mixture.responsibilities = MatrixXd::Zero(clusters, x.cols());
  for (Index n = 0; n < x.cols(); ++n) {
    mixture.responsibilities(labels[static_cast<std::size_t>(n)], n) = 1.0;
  }
  return mixture;
}

}  // namespace

std::vector<std::string> GaussianMixtureOptions::problems() const {
  std::vector<std::string> found;
  const auto rule = [&found](bool holds, const std::string& text) {
    if (!holds) found.push_back("GaussianMixtureOptions::" + text);
  };
  rule(max_iterations >= 1, "max_iterations (must be >= 1)");
  rule(tolerance > 0.0, "tolerance (must be > 0)");
  rule(floor >= 0.0 && std::isfinite(floor), "floor (must be >= 0)");
  return found;
}

GaussianMixture gaussian_mixture(const Eigen::Ref<const MatrixXd>& x,
                                 const std::vector<int>& labels,
                                 const GaussianMixtureOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  GaussianMixture mixture = begin(x, labels);
  maximize(x, options.floor, mixture);
  mixture.mean_log_likelihood = expect(x, mixture);
  mixture.first_mean_log_likelihood = mixture.mean_log_likelihood;
  while (mixture.iterations < options.max_iterations && !mixture.converged) {
    maximize(x, options.floor, mixture);
    const double likelihood = expect(x, mixture);
    mixture.converged = likelihood - mixture.mean_log_likelihood < options.tolerance;
    mixture.mean_log_likelihood = likelihood;
    ++mixture.iterations;
  }
  return mixture;
}

}  // namespace laban::manifold
