#pragma once

#include <Eigen/Dense>

#include "laban/base/rng.h"
#include "laban/texture/constrained_synthesis.h"
#include "laban/texture/linear_dynamics.h"

namespace laban::test {

/// A stable system whose states swing slowly, as those of motion do.
inline texture::LinearDynamics known_dynamics(int m, base::Rng& rng) {
  const Eigen::MatrixXd turn = texture::draw_noise(m, m, 1.0, rng).householderQr().householderQ();
  texture::LinearDynamics dynamics;
  Eigen::VectorXd now(m);
  Eigen::VectorXd before(m);
  for (int d = 0; d < m; ++d) {
    const double radius = rng.uniform(0.95, 0.99);
    now[d] = 2.0 * radius * std::cos(rng.uniform(0.03, 0.3));
    before[d] = -radius * radius;
  }
  dynamics.a1 = turn * now.asDiagonal() * turn.transpose();
  dynamics.a2 = turn * before.asDiagonal() * turn.transpose();
  dynamics.offset = texture::draw_noise(m, 1, 0.1, rng);
  const Eigen::MatrixXd b = texture::draw_noise(m, m, 0.05, rng);
  dynamics.covariance = b * b.transpose() + 1e-4 * Eigen::MatrixXd::Identity(m, m);
  return dynamics;
}

}  // namespace laban::test
