#pragma once

#include <cmath>
#include <functional>

#include "laban/base/rng.h"
#include "laban/effort/style_regressor.h"

namespace laban::effort {

/// Labelled blends with a known truth, in the shape of the paper's: content coordinates of three
/// numbers in five groups, seed Efforts uniform in [-3, 3], alpha in [-0.25, 1.25].
struct InventedBlends {
  int count = 105;
  double noise = 0.3;
  int factors = kFactorCount;
  /// Effort over linear interpolation, from z; give a function that is the same for both orders.
  std::function<EffortVector(const Eigen::VectorXd&)> beyond_interpolation;
};

inline StyleSamples invent_blends(const InventedBlends& recipe, base::Rng& rng) {
  const auto effort = [&] {
    EffortVector e(recipe.factors);
    for (double& value : e) value = rng.uniform(-3.0, 3.0);
    return e;
  };
  const auto near = [&](const Eigen::VectorXd& center) {
    Eigen::VectorXd c = center;
    for (double& value : c) value += 0.3 * rng.normal();
    return c;
  };
  StyleSamples samples;
  samples.features.resize(feature_count(3, recipe.factors), recipe.count);
  samples.labels.resize(recipe.factors, recipe.count);
  for (int n = 0; n < recipe.count; ++n) {
    const int group = rng.index(5);
    const Eigen::Vector3d center(std::cos(1.26 * group), std::sin(1.26 * group), 0.2 * group);
    // One draw a statement: the order in which arguments are evaluated differs between compilers.
    const EffortVector e_i = effort();
    const EffortVector e_j = effort();
    const Eigen::VectorXd c_i = near(center);
    const Eigen::VectorXd c_j = near(center);
    const Eigen::VectorXd z = style_features(c_i, c_j, e_i, e_j, rng.uniform(-0.25, 1.25));
    EffortVector label = linear_interpolation(z, recipe.factors).col(0);
    if (recipe.beyond_interpolation) label += recipe.beyond_interpolation(z);
    for (double& value : label) value += recipe.noise * rng.normal();
    samples.features.col(n) = z;
    samples.labels.col(n) = label;
  }
  return samples;
}

/// A smooth symmetric departure from interpolation: it grows with alpha (1 - alpha), with how far
/// the seeds' efforts are apart, and with what is done.
inline EffortVector bulge(const Eigen::VectorXd& z) {
  const double alpha = z[12], content = z[0] + z[3];
  EffortVector result(kFactorCount);
  for (int f = 0; f < kFactorCount; ++f) {
    const double apart = z[6 + f] - z[9 + f];
    result[f] = 2.0 * alpha * (1.0 - alpha) * (std::abs(apart) + content);
  }
  return result;
}

}  // namespace laban::effort
