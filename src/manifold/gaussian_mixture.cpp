#include "laban/manifold/gaussian_mixture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

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

// A sample of which a component has less is none of its own: less than round-off of the sums.
constexpr double kNoShare = 1e-15;
// A rise of the mean log-likelihood for which the search goes on.
constexpr double kWorthwhile = 1e-3;

/// Means, covariances and weights from responsibilities.
void maximize(const Eigen::Ref<const MatrixXd>& x, double floor, GaussianMixture& mixture) {
  // A component that has lost all samples keeps a weight above 0, as in scikit-learn.
  constexpr double kLeastMass = 10.0 * std::numeric_limits<double>::epsilon();
  const Index clusters = mixture.responsibilities.rows();
  // Most samples are nearly wholly one component's: the others leave them out.
  MatrixXd own(x.rows(), x.cols());
  Eigen::VectorXd shares(x.cols());
  for (Index k = 0; k < clusters; ++k) {
    Index count = 0;
    for (Index n = 0; n < x.cols(); ++n) {
      const double share = mixture.responsibilities(k, n);
      if (share < kNoShare) continue;
      own.col(count) = x.col(n);
      shares[count++] = share;
    }
    auto samples = own.leftCols(count);
    const double mass = shares.head(count).sum() + kLeastMass;
    mixture.means.col(k) = samples * shares.head(count) / mass;
    samples.colwise() -= mixture.means.col(k);
    samples.array().rowwise() *= (shares.head(count).array() / mass).sqrt().transpose();
    MatrixXd& covariance = mixture.covariances[static_cast<std::size_t>(k)];
    covariance.noalias() = samples * samples.transpose();
    covariance.diagonal().array() += floor;
    mixture.weights[k] = mass;
  }
  mixture.weights /= mixture.weights.sum();
}

/// Responsibilities under the mixture. @returns the mean log-likelihood.
double expect(const Eigen::Ref<const MatrixXd>& x, GaussianMixture& mixture) {
  const auto dimensions = static_cast<double>(x.rows());
  MatrixXd& log_density = mixture.responsibilities;
  MatrixXd centered(x.rows(), x.cols());
  MatrixXd white(x.rows(), x.cols());
  for (Index k = 0; k < log_density.rows(); ++k) {
    const Eigen::LLT<MatrixXd> factor(mixture.covariances[static_cast<std::size_t>(k)]);
    if (factor.info() != Eigen::Success) {
      throw Error(ErrorKind::kNumeric,
                  "gaussian_mixture: the covariance of component " + std::to_string(k) +
                      " is not positive definite; raise GaussianMixtureOptions::floor");
    }
    const MatrixXd whitening = factor.matrixL().solve(MatrixXd::Identity(x.rows(), x.rows()));
    centered = x.colwise() - mixture.means.col(k);
    white.noalias() = whitening * centered;
    const double log_root = -whitening.diagonal().array().log().sum();
    const double constant =
        std::log(mixture.weights[k]) - log_root - 0.5 * dimensions * math::kLogTwoPi;
    log_density.row(k) = (constant - 0.5 * white.colwise().squaredNorm().array()).matrix();
  }
  double sum = 0.0;
  for (Index n = 0; n < log_density.cols(); ++n) {
    auto column = log_density.col(n).array();
    const double greatest = column.maxCoeff();
    // One exponential a share: those of the sum are those of the shares.
    column = (column - greatest).exp();
    const double total = column.sum();
    column /= total;
    sum += greatest + std::log(total);
  }
  return sum / static_cast<double>(x.cols());
}

GaussianMixture sized(Index dimensions, Index components) {
  GaussianMixture mixture;
  mixture.weights.resize(components);
  mixture.means.resize(dimensions, components);
  mixture.covariances.resize(static_cast<std::size_t>(components));
  return mixture;
}

GaussianMixture begin(const Eigen::Ref<const MatrixXd>& x, const std::vector<int>& labels) {
  check_samples("gaussian_mixture", x);
  if (std::ssize(labels) != x.cols() || *std::min_element(labels.begin(), labels.end()) < 0) {
    throw Error(ErrorKind::kData, "gaussian_mixture: " + std::to_string(x.cols()) +
                                      " samples and " + std::to_string(labels.size()) +
                                      " labels (must be as many, and >= 0)");
  }
  const Index clusters = *std::max_element(labels.begin(), labels.end()) + 1;
  GaussianMixture mixture = sized(x.rows(), clusters);
  mixture.responsibilities = MatrixXd::Zero(clusters, x.cols());
  for (Index n = 0; n < x.cols(); ++n) {
    mixture.responsibilities(labels[static_cast<std::size_t>(n)], n) = 1.0;
  }
  return mixture;
}

/// EM from the responsibilities that `mixture` has.
void run(const Eigen::Ref<const MatrixXd>& x, const GaussianMixtureOptions& options,
         GaussianMixture& mixture) {
  mixture.iterations = 0;
  mixture.converged = false;
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
}

/// Gives up a component, whose samples go to the others by their shares.
void give_up(Index left, MatrixXd& shares) {
  shares.row(left).setZero();
  for (Index n = 0; n < shares.cols(); ++n) {
    const double others = shares.col(n).sum();
    // A sample that nobody else knows is everybody's.
    if (others > std::numeric_limits<double>::min()) {
      shares.col(n) /= others;
    } else {
      shares.col(n).setConstant(1.0 / static_cast<double>(shares.rows()));
    }
  }
}

/// Gives a component the samples nearest to one, any: as many as span a Gaussian, D + 1, up to a
/// fair share. Few in a thin place are how EM finds narrow components, which cuts across long axes
/// do not.
void plant(const Eigen::Ref<const MatrixXd>& x, Index component, base::Rng& rng, MatrixXd& shares) {
  const Eigen::VectorXd seed = x.col(rng.index(static_cast<int>(x.cols())));
  const Eigen::RowVectorXd distances = (x.colwise() - seed).colwise().squaredNorm();
  const double fewest = static_cast<double>(std::min(x.cols(), x.rows() + 1));
  const double most =
      std::max(fewest, static_cast<double>(x.cols()) / static_cast<double>(shares.rows()));
  const auto count = static_cast<Index>(fewest * std::pow(most / fewest, rng.uniform()));
  std::vector<Index> order(static_cast<std::size_t>(x.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::nth_element(order.begin(), order.begin() + (count - 1), order.end(), [&](Index a, Index b) {
    return distances[a] < distances[b] || (distances[a] == distances[b] && a < b);
  });
  for (Index n = 0; n < count; ++n) {
    const Index sample = order[static_cast<std::size_t>(n)];
    shares.col(sample).setZero();
    shares(component, sample) = 1.0;
  }
}

/// `best` with one component, any, put elsewhere, after a round of EM.
GaussianMixture swapped(const Eigen::Ref<const MatrixXd>& x, const GaussianMixture& best,
                        const GaussianMixtureOptions& em, base::Rng& rng) {
  const Index component = rng.index(static_cast<int>(best.weights.size()));
  GaussianMixture found = best;
  give_up(component, found.responsibilities);
  plant(x, component, rng, found.responsibilities);
  GaussianMixtureOptions one = em;
  one.max_iterations = 1;
  run(x, one, found);
  return found;
}

/// The best of some swaps, of which the most promising are carried on.
GaussianMixture best_of_swaps(const Eigen::Ref<const MatrixXd>& x, const GaussianMixture& best,
                              const MixtureSearchOptions& search,
                              const GaussianMixtureOptions& brief, base::Rng& rng) {
  std::vector<GaussianMixture> tried;
  for (int n = 0; n < search.swaps; ++n) tried.push_back(swapped(x, best, brief, rng));
  const auto likelier = [](const GaussianMixture& a, const GaussianMixture& b) {
    return a.mean_log_likelihood > b.mean_log_likelihood;
  };
  std::stable_sort(tried.begin(), tried.end(), likelier);
  tried.resize(std::min<std::size_t>(tried.size(), static_cast<std::size_t>(search.carried)));
  for (GaussianMixture& one : tried) run(x, brief, one);
  return *std::min_element(tried.begin(), tried.end(), likelier);
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
  rule(carried, 1, "carried");
  rule(patience, 0, "patience");
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
  run(x, options, mixture);
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
  const auto keep_if_better = [&](GaussianMixture& found) {
    // Fewer labels than components make a smaller mixture, which is not what was asked for.
    if (found.weights.size() != components) return;
    if (found.mean_log_likelihood > best.mean_log_likelihood) best = std::move(found);
  };
  const KMeansOptions once{.clusters = components, .restarts = 1, .breath = 0, .swaps = 0};
  for (int n = 1; n < search.beginnings; ++n) {
    GaussianMixture found = gaussian_mixture(x, k_means(x, once, rng).labels, brief);
    keep_if_better(found);
  }
  const bool can_swap = components > 1 && search.swaps > 0;
  for (int waited = 0; can_swap && waited < search.patience; ++waited) {
    GaussianMixture found = best_of_swaps(x, best, search, brief, rng);
    const double rise = found.mean_log_likelihood - best.mean_log_likelihood;
    if (rise > kWorthwhile) waited = -1;
    keep_if_better(found);
  }
  run(x, search.em, best);
  // What is best after a few rounds need not be so in the end.
  GaussianMixture first = gaussian_mixture(x, labels, search.em);
  return best.mean_log_likelihood > first.mean_log_likelihood ? best : first;
}

}  // namespace laban::manifold
