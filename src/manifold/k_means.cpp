#include "laban/manifold/k_means.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "laban/base/error.h"

#include "manifold/samples.h"

namespace laban::manifold {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;

// Where the error curve counts as flat: a further cluster lowers it by less than this share of the
// error of one cluster, in the mean over so many further ones.
constexpr double kFlat = 0.01;
constexpr int kAhead = 3;
constexpr int kElbowRestarts = 3;

void check_input(const Eigen::Ref<const MatrixXd>& x, const KMeansOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  check_samples("k_means", x);
}

RowVectorXd squared_distances_to(const Eigen::Ref<const MatrixXd>& x,
                                 const Eigen::VectorXd& center) {
  return (x.colwise() - center).colwise().squaredNorm();
}

/// A sample drawn with probability proportional to `weights`; any if all are 0.
Index draw(const RowVectorXd& weights, base::Rng& rng) {
  const double total = weights.sum();
  if (!(total > 0.0)) return rng.index(static_cast<int>(weights.size()));
  double left = rng.uniform() * total;
  for (Index n = 0; n < weights.size(); ++n) {
    left -= weights[n];
    if (left < 0.0) return n;
  }
  return weights.size() - 1;
}

MatrixXd first_centers(const Eigen::Ref<const MatrixXd>& x, int clusters, base::Rng& rng) {
  MatrixXd centers(x.rows(), clusters);
  centers.col(0) = x.col(rng.index(static_cast<int>(x.cols())));
  RowVectorXd nearest = squared_distances_to(x, centers.col(0));
  const int trials = 2 + static_cast<int>(std::log(clusters));
  for (int k = 1; k < clusters; ++k) {
    RowVectorXd best;
    for (int trial = 0; trial < trials; ++trial) {
      const Index sample = draw(nearest, rng);
      RowVectorXd with = nearest.cwiseMin(squared_distances_to(x, x.col(sample)));
      if (best.size() > 0 && with.sum() >= best.sum()) continue;
      best = std::move(with);
      centers.col(k) = x.col(sample);
    }
    nearest = std::move(best);
  }
  return centers;
}

/// Labels each sample by its nearest centre. @returns whether a label changed.
bool assign(const Eigen::Ref<const MatrixXd>& x, const MatrixXd& centers, std::vector<int>& labels,
            RowVectorXd& distances) {
  // |x - c|^2 = |x|^2 + 2 (|c|^2 / 2 - c'x): the best is found by a product, its distance exactly.
  const Eigen::VectorXd half_norms = 0.5 * centers.colwise().squaredNorm().transpose();
  constexpr Index kBlock = 256;
  bool changed = false;
  for (Index begin = 0; begin < x.cols(); begin += kBlock) {
    const Index count = std::min(kBlock, x.cols() - begin);
    const MatrixXd scores =
        (centers.transpose() * x.middleCols(begin, count) * -1.0).colwise() + half_norms;
    for (Index n = 0; n < count; ++n) {
      Index nearest = 0;
      scores.col(n).minCoeff(&nearest);
      auto& label = labels[static_cast<std::size_t>(begin + n)];
      changed = changed || label != static_cast<int>(nearest);
      label = static_cast<int>(nearest);
      distances[begin + n] = (x.col(begin + n) - centers.col(nearest)).squaredNorm();
    }
  }
  return changed;
}

void move_centers(const Eigen::Ref<const MatrixXd>& x, const std::vector<int>& labels,
                  RowVectorXd& distances, MatrixXd& centers) {
  MatrixXd sums = MatrixXd::Zero(centers.rows(), centers.cols());
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(centers.cols());
  for (Index n = 0; n < x.cols(); ++n) {
    const int label = labels[static_cast<std::size_t>(n)];
    sums.col(label) += x.col(n);
    counts[label] += 1.0;
  }
  for (Index k = 0; k < centers.cols(); ++k) {
    if (counts[k] > 0.0) {
      centers.col(k) = sums.col(k) / counts[k];
      continue;
    }
    Index farthest = 0;
    distances.maxCoeff(&farthest);
    centers.col(k) = x.col(farthest);
    distances[farthest] = 0.0;  // the next empty cluster takes another
  }
}

/// Lloyd's iterations from these centres.
KMeans run_from(const Eigen::Ref<const MatrixXd>& x, MatrixXd centers, int max_iterations) {
  KMeans result;
  result.centers = std::move(centers);
  result.labels.assign(static_cast<std::size_t>(x.cols()), -1);
  RowVectorXd distances(x.cols());
  static_cast<void>(assign(x, result.centers, result.labels, distances));
  iterate(result, max_iterations, [&] {
    move_centers(x, result.labels, distances, result.centers);
    return !assign(x, result.centers, result.labels, distances);
  });
  result.inertia = distances.sum();
  return result;
}

RowVectorXd squared_distances_to_own(const Eigen::Ref<const MatrixXd>& x, const KMeans& at) {
  RowVectorXd distances(x.cols());
  for (Index n = 0; n < x.cols(); ++n) {
    distances[n] =
        (x.col(n) - at.centers.col(at.labels[static_cast<std::size_t>(n)])).squaredNorm();
  }
  return distances;
}

/// The centres, and beside each of the `more` of largest error one more [Fritzke20].
MatrixXd breathed_in(const Eigen::Ref<const MatrixXd>& x, const KMeans& at, int more,
                     base::Rng& rng) {
  // Of the cluster's root mean squared distance: Lloyd's iterations part the two.
  constexpr double kApart = 0.01;
  const auto count = static_cast<int>(at.centers.cols());
  const RowVectorXd distances = squared_distances_to_own(x, at);
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(count);
  for (Index n = 0; n < x.cols(); ++n)
    errors[at.labels[static_cast<std::size_t>(n)]] += distances[n];
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return errors[a] > errors[b]; });
  MatrixXd centers(x.rows(), count + more);
  centers.leftCols(count) = at.centers;
  for (int m = 0; m < more; ++m) {
    const int k = order[static_cast<std::size_t>(m)];
    const double apart = kApart * std::sqrt(errors[k] / static_cast<double>(x.cols()));
    for (Index d = 0; d < x.rows(); ++d) {
      centers(d, count + m) = at.centers(d, k) + apart * rng.uniform(-0.5, 0.5);
    }
  }
  return centers;
}

/// The centre without which the inertia rises least before the others move.
Index least_missed(const Eigen::Ref<const MatrixXd>& x, const MatrixXd& centers) {
  RowVectorXd first = squared_distances_to(x, centers.col(0));
  RowVectorXd second = RowVectorXd::Constant(x.cols(), std::numeric_limits<double>::infinity());
  std::vector<Index> nearest(static_cast<std::size_t>(x.cols()), 0);
  for (Index k = 1; k < centers.cols(); ++k) {
    const RowVectorXd distances = squared_distances_to(x, centers.col(k));
    for (Index n = 0; n < x.cols(); ++n) {
      if (distances[n] < first[n]) {
        second[n] = first[n];
        first[n] = distances[n];
        nearest[static_cast<std::size_t>(n)] = k;
      } else {
        second[n] = std::min(second[n], distances[n]);
      }
    }
  }
  Eigen::VectorXd rises = Eigen::VectorXd::Zero(centers.cols());
  for (Index n = 0; n < x.cols(); ++n) {
    rises[nearest[static_cast<std::size_t>(n)]] += second[n] - first[n];
  }
  Index least = 0;
  rises.minCoeff(&least);
  return least;
}

MatrixXd without(const MatrixXd& centers, Index k) {
  MatrixXd rest(centers.rows(), centers.cols() - 1);
  rest << centers.leftCols(k), centers.rightCols(centers.cols() - 1 - k);
  return rest;
}

/// Breathing k-means [Fritzke20]: some centres more where the error is largest, then as many fewer
/// where they are missed least, while that ends better; then with one fewer.
KMeans breathed(const Eigen::Ref<const MatrixXd>& x, KMeans at, const KMeansOptions& options,
                base::Rng& rng) {
  // Less is round-off, not another optimum.
  constexpr double kLeastGain = 1e-9;
  const auto count = static_cast<int>(at.centers.cols());
  for (int more = std::min(options.breath, count); more > 0 && at.inertia > 0.0;) {
    MatrixXd centers = breathed_in(x, at, more, rng);
    centers = run_from(x, std::move(centers), options.max_iterations).centers;
    while (centers.cols() > count) centers = without(centers, least_missed(x, centers));
    KMeans result = run_from(x, std::move(centers), options.max_iterations);
    if (result.inertia < at.inertia * (1.0 - kLeastGain)) {
      at = std::move(result);
    } else {
      --more;
    }
  }
  return at;
}

/// Random swaps of a centre for a sample [Franti18], which two iterations judge.
KMeans swapped(const Eigen::Ref<const MatrixXd>& x, KMeans at, const KMeansOptions& options,
               base::Rng& rng) {
  constexpr int kBrief = 2;
  const auto count = static_cast<int>(at.centers.cols());
  bool any = false;
  for (int swap = 0; swap < options.swaps && count > 1 && at.inertia > 0.0; ++swap) {
    MatrixXd centers = at.centers;
    centers.col(rng.index(count)) = x.col(rng.index(static_cast<int>(x.cols())));
    KMeans result = run_from(x, std::move(centers), std::min(kBrief, options.max_iterations));
    if (result.inertia >= at.inertia) continue;
    at = std::move(result);
    any = true;
  }
  return any ? run_from(x, std::move(at.centers), options.max_iterations) : at;
}

}  // namespace

std::vector<std::string> KMeansOptions::problems() const {
  std::vector<std::string> found;
  const auto rule = [&found](int value, int least, const std::string& name) {
    if (value >= least) return;
    found.push_back("KMeansOptions::" + name + " = " + std::to_string(value) +
                    " (must be >= " + std::to_string(least) + ")");
  };
  rule(clusters, 1, "clusters");
  rule(restarts, 1, "restarts");
  rule(breath, 0, "breath");
  rule(swaps, 0, "swaps");
  rule(max_iterations, 1, "max_iterations");
  return found;
}

KMeans k_means(const Eigen::Ref<const MatrixXd>& x, const KMeansOptions& options, base::Rng& rng) {
  check_input(x, options);
  const int clusters = static_cast<int>(std::min<Index>(options.clusters, x.cols()));
  KMeans best;
  best.inertia = std::numeric_limits<double>::infinity();
  for (int restart = 0; restart < options.restarts; ++restart) {
    KMeans result = breathed(
        x, run_from(x, first_centers(x, clusters, rng), options.max_iterations), options, rng);
    if (result.inertia < best.inertia) best = std::move(result);
  }
  if (options.swaps == 0) return best;
  return breathed(x, swapped(x, std::move(best), options, rng), options, rng);
}

ElbowCurve find_elbow(const Eigen::Ref<const MatrixXd>& x, int most, const KMeansOptions& options,
                      base::Rng& rng) {
  if (most < 1) {
    throw Error(ErrorKind::kUsage,
                "find_elbow: most = " + std::to_string(most) + " (must be >= 1)");
  }
  check_input(x, options);
  const int last = static_cast<int>(std::min<Index>(most, x.cols()));
  ElbowCurve curve;
  for (int k = 1; k <= last; ++k) {
    KMeansOptions with = options;
    with.clusters = k;
    // A bend of 1 % does not ask for the last hundredth.
    with.restarts = std::min(options.restarts, kElbowRestarts);
    with.swaps = 0;
    const double inertia = k_means(x, with, rng).inertia;
    curve.errors.push_back(std::sqrt(inertia / static_cast<double>(x.cols())));
  }
  const auto error = [&](int k) { return curve.errors[static_cast<std::size_t>(k - 1)]; };
  for (curve.clusters = 1; curve.clusters < last; ++curve.clusters) {
    const int ahead = std::min(kAhead, last - curve.clusters);
    const double fall = (error(curve.clusters) - error(curve.clusters + ahead)) / ahead;
    if (fall <= kFlat * error(1)) break;
  }
  return curve;
}

}  // namespace laban::manifold
