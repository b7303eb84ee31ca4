#include "laban/manifold/cluster_figures.h"

#include <algorithm>
#include <limits>

#include "laban/base/error.h"

namespace laban::manifold {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

struct Spread {
  Eigen::VectorXd sums;    // of distances to the centre, a cluster each
  Eigen::VectorXd counts;  // of samples
};

Spread spread_of(const Eigen::Ref<const MatrixXd>& x, const Eigen::Ref<const MatrixXd>& centers,
                 const std::vector<int>& labels) {
  Spread spread{Eigen::VectorXd::Zero(centers.cols()), Eigen::VectorXd::Zero(centers.cols())};
  for (Index n = 0; n < x.cols(); ++n) {
    const int label = labels[static_cast<std::size_t>(n)];
    if (label < 0 || label >= centers.cols()) {
      throw base::Error(base::ErrorKind::kData, "cluster_figures: label " + std::to_string(label) +
                                                    " of sample " + std::to_string(n) +
                                                    " (must be 0 .. " +
                                                    std::to_string(centers.cols() - 1) + ")");
    }
    spread.sums[label] += (x.col(n) - centers.col(label)).norm();
    spread.counts[label] += 1.0;
  }
  return spread;
}

double separation_of(const Eigen::Ref<const MatrixXd>& centers) {
  if (centers.cols() < 2) return 0.0;
  double sum = 0.0;
  for (Index i = 0; i < centers.cols(); ++i) {
    double nearest = std::numeric_limits<double>::infinity();
    for (Index j = 0; j < centers.cols(); ++j) {
      if (j != i) nearest = std::min(nearest, (centers.col(i) - centers.col(j)).norm());
    }
    sum += nearest;
  }
  return sum / static_cast<double>(centers.cols());
}

double davies_bouldin_of(const Eigen::Ref<const MatrixXd>& centers, const Spread& spread) {
  double sum = 0.0;
  int used = 0;
  for (Index i = 0; i < centers.cols(); ++i) {
    if (spread.counts[i] == 0.0) continue;
    double worst = 0.0;
    for (Index j = 0; j < centers.cols(); ++j) {
      const double apart = (centers.col(i) - centers.col(j)).norm();
      if (j == i || spread.counts[j] == 0.0 || apart == 0.0) continue;
      const double both = spread.sums[i] / spread.counts[i] + spread.sums[j] / spread.counts[j];
      worst = std::max(worst, both / apart);
    }
    sum += worst;
    ++used;
  }
  return sum / std::max(1, used);
}

}  // namespace

ClusterFigures cluster_figures(const Eigen::Ref<const MatrixXd>& x,
                               const Eigen::Ref<const MatrixXd>& centers,
                               const std::vector<int>& labels) {
  if (x.cols() < 1 || centers.cols() < 1 || x.rows() != centers.rows() ||
      std::ssize(labels) != x.cols()) {
    throw base::Error(base::ErrorKind::kData, "cluster_figures: " + std::to_string(x.cols()) +
                                                  " samples, " + std::to_string(labels.size()) +
                                                  " labels, " + std::to_string(centers.cols()) +
                                                  " centres do not fit");
  }
  const Spread spread = spread_of(x, centers, labels);
  return {spread.sums.sum() / static_cast<double>(x.cols()), separation_of(centers),
          davies_bouldin_of(centers, spread)};
}

std::vector<int> hard_labels(const Eigen::Ref<const MatrixXd>& memberships) {
  std::vector<int> labels;
  for (Index n = 0; n < memberships.cols(); ++n) {
    Index greatest = 0;
    memberships.col(n).maxCoeff(&greatest);
    labels.push_back(static_cast<int>(greatest));
  }
  return labels;
}

}  // namespace laban::manifold
