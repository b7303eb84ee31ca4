#include "laban/manifold/fuzzy_k_means.h"

#include <cmath>

#include "laban/base/error.h"

#include "manifold/samples.h"

namespace laban::manifold {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd squared_distances(const Eigen::Ref<const MatrixXd>& x, const MatrixXd& centers) {
  MatrixXd distances(centers.cols(), x.cols());
  for (Index k = 0; k < centers.cols(); ++k) {
    distances.row(k) = (x.colwise() - centers.col(k)).colwise().squaredNorm();
  }
  return distances;
}

MatrixXd memberships_of(const MatrixXd& squared, double fuzzifier) {
  MatrixXd memberships(squared.rows(), squared.cols());
  for (Index n = 0; n < squared.cols(); ++n) {
    const double least = squared.col(n).minCoeff();
    // Relative to the nearest, so that no power overflows.
    if (least > 0.0) {
      memberships.col(n) = (squared.col(n).array() / least).pow(-1.0 / (fuzzifier - 1.0));
    } else {
      memberships.col(n) = (squared.col(n).array() == 0.0).cast<double>();
    }
    memberships.col(n) /= memberships.col(n).sum();
  }
  return memberships;
}

}  // namespace

std::vector<std::string> FuzzyKMeansOptions::problems() const {
  std::vector<std::string> found;
  const auto rule = [&found](bool holds, const std::string& text) {
    if (!holds) found.push_back("FuzzyKMeansOptions::" + text);
  };
  rule(fuzzifier > 1.0 && std::isfinite(fuzzifier), "fuzzifier (must be > 1)");
  rule(max_iterations >= 1, "max_iterations (must be >= 1)");
  rule(tolerance > 0.0, "tolerance (must be > 0)");
  return found;
}

FuzzyKMeans fuzzy_k_means(const Eigen::Ref<const MatrixXd>& x,
                          const Eigen::Ref<const MatrixXd>& centers,
                          const FuzzyKMeansOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  check_samples("fuzzy_k_means", x);
  check_samples("fuzzy_k_means", centers);
  if (centers.rows() != x.rows()) {
    throw Error(ErrorKind::kData, "fuzzy_k_means: centres of " + std::to_string(centers.rows()) +
                                      " values for samples of " + std::to_string(x.rows()));
  }
  FuzzyKMeans result;
  result.centers = centers;
  MatrixXd squared = squared_distances(x, result.centers);
  result.memberships = memberships_of(squared, options.fuzzifier);
  const auto objective = [&] {
    return (result.memberships.array().pow(options.fuzzifier) * squared.array()).sum();
  };
  result.first_objective = objective();
  iterate(result, options.max_iterations, [&] {
    const MatrixXd weights = result.memberships.array().pow(options.fuzzifier);
    for (Index k = 0; k < result.centers.cols(); ++k) {
      const double total = weights.row(k).sum();
      if (total > 0.0) result.centers.col(k) = x * weights.row(k).transpose() / total;
    }
    squared = squared_distances(x, result.centers);
    MatrixXd next = memberships_of(squared, options.fuzzifier);
    const double change = (next - result.memberships).cwiseAbs().maxCoeff();
    result.memberships = std::move(next);
    return change <= options.tolerance;
  });
  result.objective = objective();
  return result;
}

}  // namespace laban::manifold
