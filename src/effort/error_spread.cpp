#include "effort/error_spread.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "laban/base/error.h"
#include "laban/learn/gaussian_kernel.h"

namespace laban::effort {
namespace {

constexpr double kNoise = 1.0;  ///< of the process behind v(z), in units of its signal
constexpr double kCoverage = 0.6827;

/// Kernel N x M of both orders between the centers and samples: (k(z, w) + k(z, twin of w)) / 2.
Eigen::MatrixXd symmetric_kernel(const Eigen::MatrixXd& centers, const Eigen::MatrixXd& z,
                                 double width) {
  const Eigen::Index N = centers.cols() / 2;
  const Eigen::MatrixXd k = learn::gaussian_kernel(learn::squared_distances(centers, z), width);
  return 0.5 * (k.topRows(N) + k.bottomRows(N));
}

Eigen::LLT<Eigen::MatrixXd> factorize(Eigen::MatrixXd kernel) {
  kernel.diagonal().array() += kNoise;
  Eigen::LLT<Eigen::MatrixXd> factor(kernel);
  if (factor.info() != Eigen::Success) {
    throw base::Error(base::ErrorKind::kNumeric,
                      "style regressor: the kernel of standard errors is not positive definite");
  }
  return factor;
}

}  // namespace

Eigen::VectorXd unexplained_share(const Eigen::MatrixXd& centers, const Eigen::MatrixXd& z,
                                  const Eigen::MatrixXd& twins, double width) {
  const Eigen::Index N = centers.cols() / 2;
  const auto factor = factorize(symmetric_kernel(centers, centers.leftCols(N), width));
  const Eigen::MatrixXd k = symmetric_kernel(centers, z, width);
  const Eigen::VectorXd squared = (z - twins).colwise().squaredNorm().transpose();
  const Eigen::VectorXd prior = 0.5 * (1.0 + learn::gaussian_kernel(squared, width).array());
  const Eigen::VectorXd explained = factor.matrixL().solve(k).colwise().squaredNorm().transpose();
  return (prior - explained).cwiseMax(0.0);
}

Eigen::ArrayXd held_out_novelty(const Eigen::MatrixXd& centers, double width,
                                std::span<const int> folds) {
  const Eigen::Index N = centers.cols() / 2;
  const auto factor = factorize(symmetric_kernel(centers, centers.leftCols(N), width));
  const Eigen::MatrixXd G = factor.solve(Eigen::MatrixXd::Identity(N, N));
  std::map<int, std::vector<int>> samples;
  for (std::size_t n = 0; n < folds.size(); ++n) samples[folds[n]].push_back(static_cast<int>(n));
  Eigen::VectorXd novelty(N);
  for (const auto& [fold, S] : samples) {
    // (G_SS)^-1 is the covariance of the fold's noisy values given the others'.
    const Eigen::MatrixXd G_SS = G(S, S);
    const auto count = static_cast<Eigen::Index>(S.size());
    novelty(S) = G_SS.llt().solve(Eigen::MatrixXd::Identity(count, count)).diagonal();
  }
  return novelty.array();
}

Eigen::ArrayXd spread_shape(const Eigen::ArrayXd& bulge, const Eigen::ArrayXd& novelty,
                            double bulge_share, double bulge_mean_square) {
  return ((1.0 - bulge_share + bulge_share * bulge.square() / bulge_mean_square) * 0.5 * novelty)
      .sqrt();
}

void fit_spread(const Eigen::ArrayXd& bulge, const Eigen::ArrayXd& novelty,
                const Eigen::VectorXd& held_out, int factor, ErrorSpread& spread) {
  const double count = static_cast<double>(held_out.size());
  double greatest = 0.0;
  Eigen::ArrayXd standardized;
  for (const double share : {0.0, 0.5, 0.9}) {
    const Eigen::ArrayXd shape = spread_shape(bulge, novelty, share, spread.bulge_mean_square);
    const Eigen::ArrayXd scaled = held_out.array().abs() / shape;
    // Laplace's likelihood at its best scale: residuals have heavier tails than Gauss's.
    const double likelihood =
        -count * std::log(std::max(scaled.mean(), 1e-300)) - shape.log().sum();
    if (standardized.size() > 0 && !(likelihood > greatest)) continue;
    greatest = likelihood;
    standardized = scaled;
    spread.bulge_share[factor] = share;
  }
  std::sort(standardized.begin(), standardized.end());
  // The rank that covers a new exchangeable residual with at least this probability.
  const auto rank = static_cast<Eigen::Index>(std::ceil(kCoverage * (count + 1.0)));
  spread.unit[factor] = standardized[std::min(rank, held_out.size()) - 1];
}

}  // namespace laban::effort
