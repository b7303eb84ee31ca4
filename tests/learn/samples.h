#pragma once

#include <cmath>

#include <Eigen/Dense>

namespace laban::learn {

/// The samples and targets of reference_values.py: 24 to learn from, 4 queries.
struct ReferenceSamples {
  Eigen::MatrixXd x;        // 3 x 24
  Eigen::VectorXd y;        // 24
  Eigen::MatrixXd queries;  // 3 x 4
};

inline ReferenceSamples reference_samples() {
  Eigen::MatrixXd all(3, 28);
  Eigen::VectorXd y(28);
  for (int n = 0; n < 28; ++n) {
    for (int d = 0; d < 3; ++d) all(d, n) = std::sin(0.7 * (d + 1) * (n + 1)) + 0.1 * d;
    y[n] = std::sin(2.0 * all(0, n)) + 0.5 * all(1, n) * all(2, n) + 0.3 * std::cos(5.0 * n);
  }
  return {all.leftCols(24), y.head(24), all.rightCols(4)};
}

}  // namespace laban::learn
