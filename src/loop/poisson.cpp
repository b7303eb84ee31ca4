#include "laban/loop/poisson.h"

#include <cmath>
#include <numbers>
#include <string>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

using base::Error;
using base::ErrorKind;

/// sqrt(2 / (N + 1)) sin(pi k t / (N + 1)), k, t = 1 .. N; sines are looked up, not computed N^2
/// times.
Eigen::MatrixXd sine_matrix(int frame_count) {
  const Eigen::Index n = frame_count;
  const Eigen::Index period = 2 * (n + 1);
  const double scale = std::sqrt(2.0 / static_cast<double>(n + 1));
  Eigen::VectorXd sine(period);
  for (Eigen::Index k = 0; k < period; ++k) {
    sine[k] =
        scale * std::sin(std::numbers::pi * static_cast<double>(k) / static_cast<double>(n + 1));
  }
  Eigen::MatrixXd sines(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::Index at = 0;
    for (Eigen::Index t = 0; t < n; ++t) {
      at += k + 1;
      if (at >= period) at -= period;
      sines(t, k) = sine[at];
    }
  }
  return sines;
}

}  // namespace

PoissonGrid::PoissonGrid(std::vector<int> parents, int frame_count, double joint_weight,
                         double screening)
    : parents_(std::move(parents)), joint_weight_(joint_weight), screening_(screening) {
  if (parents_.empty() || frame_count < 1 || !(joint_weight >= 0.0) ||
      !std::isfinite(joint_weight) || !(screening >= 0.0) || !std::isfinite(screening)) {
    throw Error(ErrorKind::kUsage,
                "a Poisson grid needs a joint, a frame and finite joint weight and screening of at "
                "least 0");
  }
  for (std::size_t r = 0; r < parents_.size(); ++r) {
    if (parents_[r] < -1 || parents_[r] >= static_cast<int>(r)) {
      throw Error(ErrorKind::kData,
                  "row " + std::to_string(r) + " of a Poisson grid does not come after its parent");
    }
  }
  sines_ = sine_matrix(frame_count);
  // Eigenvalue of the second difference in time for each frequency, then the tree's on top.
  Eigen::VectorXd lambda(frame_count);
  for (int k = 0; k < frame_count; ++k) {
    const double half = std::sin(0.5 * std::numbers::pi * (k + 1) / (frame_count + 1));
    lambda[k] = 4.0 * half * half + screening_;
  }
  pivots_ = lambda.replicate(1, row_count());
  for (Eigen::Index r = row_count() - 1; r >= 0; --r) {
    const int parent = parents_[static_cast<std::size_t>(r)];
    if (parent < 0) continue;
    pivots_.col(r).array() += joint_weight_;
    pivots_.col(parent).array() +=
        joint_weight_ - joint_weight_ * joint_weight_ / pivots_.col(r).array();
  }
}

void PoissonGrid::check_size(const Eigen::MatrixXd& values, Eigen::Index columns) const {
  if (values.rows() == 0 || values.rows() % row_count() != 0 || values.cols() != columns) {
    throw Error(ErrorKind::kData, "a Poisson grid of " + std::to_string(row_count()) +
                                      " joints does not fit " + std::to_string(values.rows()) +
                                      " x " + std::to_string(values.cols()) + " values");
  }
}

Eigen::MatrixXd PoissonGrid::laplacian(const Eigen::MatrixXd& values) const {
  const Eigen::Index n = frame_count();
  check_size(values, n);
  Eigen::MatrixXd time(values.rows(), n + 1);
  time.col(0) = values.col(0);
  time.col(n) = -values.col(n - 1);
  time.middleCols(1, n - 1) = values.rightCols(n - 1) - values.leftCols(n - 1);
  Eigen::MatrixXd joints = values;
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    const int parent = parents_[static_cast<std::size_t>(row % row_count())];
    if (parent >= 0) joints.row(row) -= values.row(row - row % row_count() + parent);
  }
  return divergence(time, joints) + screening_ * values;
}

Eigen::MatrixXd PoissonGrid::divergence(const Eigen::MatrixXd& along_time,
                                        const Eigen::MatrixXd& to_parent) const {
  const Eigen::Index n = frame_count();
  check_size(along_time, n + 1);
  check_size(to_parent, n);
  Eigen::MatrixXd sum = along_time.leftCols(n) - along_time.rightCols(n);
  for (Eigen::Index row = 0; row < sum.rows(); ++row) {
    const int parent = parents_[static_cast<std::size_t>(row % row_count())];
    if (parent < 0) continue;
    sum.row(row) += joint_weight_ * to_parent.row(row);
    sum.row(row - row % row_count() + parent) -= joint_weight_ * to_parent.row(row);
  }
  return sum;
}

Eigen::MatrixXd PoissonGrid::solve(const Eigen::MatrixXd& right) const {
  check_size(right, frame_count());
  // A column is a row of the grid: frequencies lie side by side in memory.
  Eigen::MatrixXd y = sines_ * right.transpose();
  for (Eigen::Index first = 0; first < y.cols(); first += row_count()) {
    for (Eigen::Index r = row_count() - 1; r >= 0; --r) {
      const int parent = parents_[static_cast<std::size_t>(r)];
      y.col(first + r).array() /= pivots_.col(r).array();
      if (parent >= 0) y.col(first + parent) += joint_weight_ * y.col(first + r);
    }
    for (Eigen::Index r = 0; r < row_count(); ++r) {
      const int parent = parents_[static_cast<std::size_t>(r)];
      if (parent < 0) continue;
      y.col(first + r).array() +=
          joint_weight_ * y.col(first + parent).array() / pivots_.col(r).array();
    }
  }
  return (sines_ * y).transpose();
}

}  // namespace laban::loop
