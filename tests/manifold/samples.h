#pragma once

#include <cmath>

#include <Eigen/Dense>

#include "laban/motion/humanoid.h"
#include "laban/motion/standard_body.h"
#include "support/clips.h"

namespace laban::test {

/// The samples of reference_values.py: 6 x 150.
inline Eigen::MatrixXd reference_samples() {
  Eigen::MatrixXd x(6, 150);
  for (int d = 0; d < x.rows(); ++d) {
    for (int n = 0; n < x.cols(); ++n) {
      x(d, n) = std::sin(0.7 * (d + 1) * n / 10.0) + 0.3 * std::cos(1.3 * (d + 2) * n / 7.0);
    }
  }
  return x;
}

/// A capture of the standard body: a smooth random dance.
inline motion::Capture random_capture(const ClipShape& shape) {
  const motion::Clip clip = motion::to_standard_clip(random_pose_matrix(shape));
  return motion::find_capture(clip);
}

}  // namespace laban::test
