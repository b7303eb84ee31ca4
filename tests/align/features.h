#pragma once

#include <Eigen/Dense>

#include "laban/base/rng.h"

namespace laban::align::test {

/// D x F independent normal features.
[[nodiscard]] inline Eigen::MatrixXd random_features(int dimensions, int frames, base::Rng& rng) {
  return Eigen::MatrixXd::NullaryExpr(dimensions, frames, [&] { return rng.normal(); });
}

/// D x F features of whole numbers 0 .. 2: many distances are equal, so that ties are common.
[[nodiscard]] inline Eigen::MatrixXd tied_features(int dimensions, int frames, base::Rng& rng) {
  return Eigen::MatrixXd::NullaryExpr(dimensions, frames,
                                      [&] { return static_cast<double>(rng.index(3)); });
}

}  // namespace laban::align::test
