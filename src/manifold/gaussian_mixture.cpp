#include "laban/manifold/gaussian_mixture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "laban/base/error.h"
#include "laban/manifold/cluster_figures.h"
#include "laban/manifold/k_means.h"
#include "laban/math/constants.h"

#include "manifold/samples.h"

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
  check_samples("gaussian_mixture", x);
  if (std::ssize(labels) != x.cols() || *std::min_element(labels.begin(), labels.end()) < 0) {
    throw Error(ErrorKind::kData, "gaussian_mixture: " + std::to_string(x.cols()) +
                                      " samples and " + std::to_string(labels.size()) +
                                      " labels (must be as many, and >= 0)");
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

/// Labels in which component `left` is given up, its samples going to their next likeliest one, and
/// the samples of component `cut` are cut into two along their longest axis.
std::vector<int> swapped_labels(const Eigen::Ref<const MatrixXd>& x, const GaussianMixture& mixture,
                                Index left, Index cut) {
  MatrixXd shares = mixture.responsibilities;
  shares.row(left).setConstant(-1.0);
  std::vector<int> labels = hard_labels(shares);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(
      mixture.covariances[static_cast<std::size_t>(cut)]);
  const Eigen::VectorXd along = axes.eigenvectors().rightCols<1>();
  for (Index n = 0; n < x.cols(); ++n) {
    int& label = labels[static_cast<std::size_t>(n)];
    if (label == cut && along.dot(x.col(n) - mixture.means.col(cut)) > 0.0) {
      label = static_cast<int>(left);
    }
  }
  return labels;
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

std::vector<std::string> MixtureSearchOptions::problems() const {
  std::vector<std::string> found = em.problems();
  const auto rule = [&found](int value, int least, const std::string& name) {
    if (value >= least) return;
    found.push_back("MixtureSearchOptions::" + name + " = " + std::to_string(value) +
                    " (must be >= " + std::to_string(least) + ")");
  };
  rule(beginnings, 1, "beginnings");
  rule(swaps, 0, "swaps");
  rule(brief_iterations, 1, "brief_iterations");
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
  iterate(mixture, options.max_iterations, [&] {
    maximize(x, options.floor, mixture);
    const double likelihood = expect(x, mixture);
    const double rise = likelihood - mixture.mean_log_likelihood;
    mixture.mean_log_likelihood = likelihood;
    return rise < options.tolerance;
  });
  return mixture;
}

GaussianMixture best_gaussian_mixture(const Eigen::Ref<const MatrixXd>& x,
                                      const std::vector<int>& labels,
                                      const MixtureSearchOptions& search, base::Rng& rng) {
  if (const auto problems = search.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  GaussianMixtureOptions brief = search.em;
  brief.max_iterations = std::min(brief.max_iterations, search.brief_iterations);
  GaussianMixture best = gaussian_mixture(x, labels, brief);
  const auto components = static_cast<int>(best.weights.size());
  std::vector<int> best_labels = labels;
  const auto attempt = [&](std::vector<int> from) {
    GaussianMixture found = gaussian_mixture(x, from, brief);
    // Fewer labels than components make a smaller mixture, which is not what was asked for.
    if (found.weights.size() != components) return;
    if (found.mean_log_likelihood <= best.mean_log_likelihood) return;
    best = std::move(found);
    best_labels = std::move(from);
  };
  const KMeansOptions once{.clusters = components, .restarts = 1, .swaps = 0};
  for (int n = 1; n < search.beginnings; ++n) attempt(k_means(x, once, rng).labels);
  for (int n = 0; n < search.swaps && components > 1; ++n) {
    const int left = rng.index(components);
    const int cut = (left + 1 + rng.index(components - 1)) % components;
    attempt(swapped_labels(x, best, left, cut));
  }
  // What is best after a few rounds need not be so in the end.
  GaussianMixture first = gaussian_mixture(x, labels, search.em);
  GaussianMixture last = gaussian_mixture(x, best_labels, search.em);
  return last.mean_log_likelihood > first.mean_log_likelihood ? last : first;
}

}  // namespace laban::manifold
