#include "laban/manifold/k_means.h"

#include <algorithm>
#include <cmath>
#include <limits>

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
    KMeans result = run_from(x, first_centers(x, clusters, rng), options.max_iterations);
    if (result.inertia < best.inertia) best = std::move(result);
  }
  for (int swap = 0; swap < options.swaps && clusters > 1 && best.inertia > 0.0; ++swap) {
    MatrixXd centers = best.centers;
    centers.col(rng.index(clusters)) = x.col(rng.index(static_cast<int>(x.cols())));
    KMeans result = run_from(x, std::move(centers), options.max_iterations);
    if (result.inertia < best.inertia) best = std::move(result);
  }
  return best;
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
    with.swaps = 0;  // a bend of 1 % does not ask for the last hundredth
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
