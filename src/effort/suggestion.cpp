#include "laban/effort/suggestion.h"

#include <algorithm>
#include <cmath>

#include "laban/base/error.h"
#include "laban/effort/style_regressor.h"
#include "laban/learn/gaussian_kernel.h"

#include "effort/averaged_process.h"
#include "effort/balanced_scale.h"

namespace laban::effort {
namespace {

void append_unless_positive(const char* name, double value, std::vector<std::string>& problems) {
  if (value > 0.0 && std::isfinite(value)) return;
  problems.push_back(std::string("SuggestionOptions::") + name + " = " + std::to_string(value) +
                     " (must be > 0 and finite)");
}

/// How much interpolation may miss, relative: in proportion to how far apart the parents are in
/// `scaled` z; nothing at the seeds, whose labels are known.
/// @param twins  of `scaled`, told from the other end.
Eigen::VectorXd prior_sizes(const Eigen::MatrixXd& scaled, const Eigen::MatrixXd& twins,
                            const Eigen::ArrayXd& bulge) {
  const Eigen::VectorXd apart =
      (scaled - twins).topRows(scaled.rows() - 1).colwise().norm().transpose();
  const Eigen::VectorXd sizes = (bulge == 0.0).select(0.0, apart.array());
  const double size = std::sqrt(sizes.squaredNorm() / static_cast<double>(sizes.size()));
  return size > 0.0 ? Eigen::VectorXd(sizes / size) : sizes;
}

/// Prior covariance of what interpolation misses at the blends.
Eigen::MatrixXd prior_covariance(const Eigen::MatrixXd& z, int factors, double relative_width) {
  const Eigen::Index N = z.cols();
  Eigen::MatrixXd both(z.rows(), 2 * N);
  both << z, swap_order(z, factors);
  const Eigen::MatrixXd scaled = fit_balanced_scale(both, factors).apply(both);
  const Eigen::MatrixXd k =
      learn::gaussian_kernel(learn::squared_distances(scaled.leftCols(N), scaled),
                             relative_width * learn::median_distance(scaled));
  const Eigen::VectorXd sizes =
      prior_sizes(scaled.leftCols(N), scaled.rightCols(N), bulge_of(z.bottomRows(1)));
  return sizes.asDiagonal() * (0.5 * (k.leftCols(N) + k.rightCols(N))) * sizes.asDiagonal();
}

/// Lowers the covariance by what a noisy value at `column` tells.
void condition_on(Eigen::Index column, double noise, Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd c = covariance.col(column);
  covariance.noalias() -= c * (c.transpose() / (c[column] + noise));
}

}  // namespace

std::vector<std::string> SuggestionOptions::problems() const {
  std::vector<std::string> problems;
  if (count < 1) {
    problems.push_back("SuggestionOptions::count = " + std::to_string(count) + " (must be >= 1)");
  }
  append_unless_positive("relative_width", relative_width, problems);
  append_unless_positive("noise_ratio", noise_ratio, problems);
  return problems;
}

std::vector<Suggestion> suggest_blends(const Eigen::Ref<const Eigen::MatrixXd>& labelled,
                                       const Eigen::Ref<const Eigen::MatrixXd>& pool,
                                       const SuggestionOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw base::Error(base::ErrorKind::kUsage, problems.front());
  }
  if (pool.cols() < 1 || (labelled.cols() > 0 && labelled.rows() != pool.rows()) ||
      !pool.allFinite() || !labelled.allFinite()) {
    throw base::Error(base::ErrorKind::kData,
                      "suggest: " + std::to_string(pool.cols()) + " blends of " +
                          std::to_string(pool.rows()) + " features to choose from and " +
                          std::to_string(labelled.cols()) + " labelled of " +
                          std::to_string(labelled.rows()) +
                          "; the same finite features, at least one to choose from");
  }
  const Eigen::Index P = pool.cols(), L = labelled.cols();
  Eigen::MatrixXd all(pool.rows(), P + L);
  all.leftCols(P) = pool;
  if (L > 0) all.rightCols(L) = labelled;
  Eigen::MatrixXd C = prior_covariance(all, options.factor_count, options.relative_width);
  for (Eigen::Index n = 0; n < L; ++n) condition_on(P + n, options.noise_ratio, C);
  C = C.topLeftCorner(P, P).eval();

  const double before = C.trace();
  std::vector<bool> is_taken(static_cast<std::size_t>(P), false);
  std::vector<Suggestion> result;
  while (std::ssize(result) < std::min<Eigen::Index>(options.count, P)) {
    Eigen::Index best = -1;
    double most = -1.0;
    for (Eigen::Index n = 0; n < P; ++n) {
      if (is_taken[static_cast<std::size_t>(n)]) continue;
      const double drop = C.col(n).squaredNorm() / (C(n, n) + options.noise_ratio);
      if (!(drop > most)) continue;
      most = drop;
      best = n;
    }
    is_taken[static_cast<std::size_t>(best)] = true;
    condition_on(best, options.noise_ratio, C);
    result.push_back({static_cast<int>(best), before > 0.0 ? most / before : 0.0});
  }
  return result;
}

}  // namespace laban::effort
