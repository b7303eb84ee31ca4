#pragma once

#include <cmath>

#include <Eigen/Dense>

#include "laban/effort/effort.h"
#include "laban/learn/standardizer.h"

namespace laban::effort {

/// Standardizes z so that contents, efforts and alpha, as groups, count alike in distances, instead
/// of each feature by itself: alpha, one feature of 13, is what moves along a blend.
[[nodiscard]] inline learn::Standardizer fit_balanced_scale(
    const Eigen::Ref<const Eigen::MatrixXd>& z, int factors) {
  learn::Standardizer scale = learn::fit_standardizer(z);
  const Eigen::Index contents = z.rows() - 2 * factors - 1;
  scale.inverse_scale.head(contents) /= std::sqrt(static_cast<double>(contents));
  scale.inverse_scale.segment(contents, 2 * factors) /= std::sqrt(2.0 * factors);
  return scale;
}

}  // namespace laban::effort
