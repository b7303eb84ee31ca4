#include "laban/texture/constrained_synthesis.h"

#include <algorithm>
#include <string>
#include <utility>

#include "laban/base/error.h"
#include "laban/math/constants.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::MatrixXd;
using Eigen::Ref;
using Eigen::VectorXd;

void check_known(const std::vector<int>& known, int length) {
  const bool good =
      length >= 2 && known.size() >= 2 && known[0] == 0 && known[1] == 1 && known.back() < length &&
      std::adjacent_find(known.begin(), known.end(), std::greater_equal<>()) == known.end();
  if (!good) {
    throw Error(ErrorKind::kUsage,
                "constrained synthesis of " + std::to_string(length) +
                    " frames: known frames must ascend, lie inside and begin with 0 and 1");
  }
}

/// B of B B' = covariance, lower triangular.
Eigen::LLT<MatrixXd> noise_factor(const LinearDynamics& dynamics) {
  Eigen::LLT<MatrixXd> factor(dynamics.covariance);
  if (factor.info() != Eigen::Success) {
    throw Error(ErrorKind::kNumeric,
                "constrained synthesis: the texton's covariance is not positive definite");
  }
  return factor;
}

}  // namespace

ConstrainedStates::ConstrainedStates(const LinearDynamics& dynamics, int length,
                                     std::vector<int> known)
    : length_(length), known_(std::move(known)) {
  check_known(known_, length);
  const Eigen::LLT<MatrixXd> noise = noise_factor(dynamics);
  const int m = dynamics.dimension();
  const auto B = noise.matrixL();
  next_ = B.solve(MatrixXd::Identity(m, m));
  now_ = B.solve(-dynamics.a1);
  before_ = B.solve(-dynamics.a2);
  whitened_offset_ = B.solve(dynamics.offset);
  std::vector<bool> is_known(static_cast<std::size_t>(length), false);
  for (const int frame : known_) is_known[static_cast<std::size_t>(frame)] = true;
  const auto unknown = std::find(is_known.begin(), is_known.end(), false);
  if (unknown == is_known.end()) return;
  first_ = static_cast<int>(unknown - is_known.begin());
  last_ = length - 1;
  while (is_known[static_cast<std::size_t>(last_)]) --last_;
  for (const int frame : known_) {
    if (frame > first_ && frame < last_) pins_.push_back(frame);
  }
  factorize(is_known);
}

// Normal equations of unknown frames only: row t (of x_{t-1}, x_t, x_{t+1}) adds P'P to their
// blocks. A known frame among them keeps its place with the identity, so that all blocks stand in
// one band.
void ConstrainedStates::factorize(const std::vector<bool>& is_known) {
  const int m = dimension();
  const MatrixXd nn = next_.transpose() * next_;
  const MatrixXd oo = now_.transpose() * now_;
  const MatrixXd bb = before_.transpose() * before_;
  const MatrixXd on = next_.transpose() * now_;     // block (t + 1, t) of row t
  const MatrixXd bo = now_.transpose() * before_;   // block (t, t - 1) of row t
  const MatrixXd bn = next_.transpose() * before_;  // block (t + 1, t - 1) of row t
  const auto free = [&](int s) { return s <= last_ && !is_known[static_cast<std::size_t>(s)]; };
  factor_.resize(m, static_cast<Eigen::Index>(3) * m * (last_ + 1));
  for (int s = first_; s <= last_; ++s) {
    auto diagonal = block(s, 0);
    auto below = block(s, 1);
    auto second = block(s, 2);
    below.setZero();
    second.setZero();
    if (!free(s)) {
      diagonal.setIdentity();
      continue;
    }
    diagonal = nn;  // row s - 1 >= 1, for frames 0 and 1 are known
    if (s + 1 < length_) diagonal += oo;
    if (s + 2 < length_) diagonal += bb;
    if (free(s + 1)) {
      below = on;
      if (s + 2 < length_) below += bo;
    }
    if (free(s + 2)) second = bn;
    if (s - 1 >= first_) {
      diagonal.noalias() -= block(s - 1, 1) * block(s - 1, 1).transpose();
      if (free(s + 1)) below.noalias() -= block(s - 1, 2) * block(s - 1, 1).transpose();
    }
    if (s - 2 >= first_) diagonal.noalias() -= block(s - 2, 2) * block(s - 2, 2).transpose();
    Ref<MatrixXd> in_place(diagonal);
    const Eigen::LLT<Ref<MatrixXd>> cholesky(in_place);
    if (cholesky.info() != Eigen::Success) {
      throw Error(ErrorKind::kNumeric, "constrained synthesis: the system of " +
                                           std::to_string(length_) +
                                           " frames is singular to working precision");
    }
    const auto lower = diagonal.triangularView<Eigen::Lower>();
    if (free(s + 1)) lower.transpose().solveInPlace<Eigen::OnTheRight>(below);
    if (free(s + 2)) lower.transpose().solveInPlace<Eigen::OnTheRight>(second);
  }
}

/// What is left of each whitened row, m x (length - 2).
MatrixXd ConstrainedStates::rows_left(const Ref<const MatrixXd>& x,
                                      const Ref<const MatrixXd>& noise) const {
  const Eigen::Index rows = length_ - 2;
  MatrixXd r = noise.cols() > 0 ? MatrixXd(noise) : MatrixXd::Zero(dimension(), rows);
  r.colwise() += whitened_offset_;
  r.noalias() -= next_.triangularView<Eigen::Lower>() * x.rightCols(rows);
  r.noalias() -= now_ * x.middleCols(1, rows);
  r.noalias() -= before_ * x.leftCols(rows);
  return r;
}

/// x += the correction of its unknown columns that makes the rows least squares.
void ConstrainedStates::step(MatrixXd& x, const Ref<const MatrixXd>& noise) const {
  const Eigen::Index rows = length_ - 2;
  const MatrixXd r = rows_left(x, noise);
  MatrixXd g = MatrixXd::Zero(dimension(), length_);
  g.rightCols(rows).noalias() += next_.transpose().triangularView<Eigen::Upper>() * r;
  g.middleCols(1, rows).noalias() += now_.transpose() * r;
  g.leftCols(rows).noalias() += before_.transpose() * r;
  for (const int pin : pins_) g.col(pin).setZero();
  for (int s = first_; s <= last_; ++s) {
    if (s - 1 >= first_) g.col(s).noalias() -= block(s - 1, 1) * g.col(s - 1);
    if (s - 2 >= first_) g.col(s).noalias() -= block(s - 2, 2) * g.col(s - 2);
    auto column = g.col(s);
    block(s, 0).triangularView<Eigen::Lower>().solveInPlace(column);
  }
  for (int s = last_; s >= first_; --s) {
    if (s + 1 <= last_) g.col(s).noalias() -= block(s, 1).transpose() * g.col(s + 1);
    if (s + 2 <= last_) g.col(s).noalias() -= block(s, 2).transpose() * g.col(s + 2);
    auto column = g.col(s);
    block(s, 0).transpose().triangularView<Eigen::Upper>().solveInPlace(column);
  }
  x.middleCols(first_, last_ - first_ + 1) += g.middleCols(first_, last_ - first_ + 1);
}

MatrixXd ConstrainedStates::solve(const Ref<const MatrixXd>& states,
                                  const Ref<const MatrixXd>& noise) const {
  if (states.rows() != dimension() || states.cols() != length_ ||
      (noise.cols() > 0 && (noise.rows() != dimension() || noise.cols() != length_ - 2))) {
    throw Error(ErrorKind::kUsage, "constrained synthesis: states and noise must be " +
                                       std::to_string(dimension()) + " x " +
                                       std::to_string(length_) + " and two columns less");
  }
  MatrixXd x = MatrixXd::Zero(dimension(), length_);
  for (const int frame : known_) x.col(frame) = states.col(frame);
  if (last_ < first_) return x;
  // Normal equations square the condition number (1e9 at 172 frames); a second step, whose
  // residual comes from the rows themselves, takes the digits back.
  step(x, noise);
  step(x, noise);
  return x;
}

// The rows' joint density, integrated over the unknown frames: a normal density of their least
// squares, times (2 pi)^(unknown / 2) |A'A|^(-1/2).
double ConstrainedStates::log_density(const Ref<const MatrixXd>& likeliest) const {
  const double squares = rows_left(likeliest, MatrixXd()).squaredNorm();
  double log_determinant = 0.0;
  for (int s = first_; s <= last_; ++s) {
    log_determinant += 2.0 * block(s, 0).diagonal().array().log().sum();
  }
  const double rows = length_ - 2;
  const auto given = static_cast<double>(known_.size() - 2);
  return -0.5 * (squares + log_determinant + given * dimension() * math::kLogTwoPi) +
         rows * next_.diagonal().array().log().sum();
}

MatrixXd innovations(const LinearDynamics& dynamics, const Ref<const MatrixXd>& states) {
  if (states.rows() != dynamics.dimension() || states.cols() < 2) {
    throw Error(ErrorKind::kUsage, "innovations need at least two frames of " +
                                       std::to_string(dynamics.dimension()) + " states");
  }
  const Eigen::Index rows = states.cols() - 2;
  MatrixXd v = states.rightCols(rows) - dynamics.a1 * states.middleCols(1, rows) -
               dynamics.a2 * states.leftCols(rows);
  v.colwise() -= dynamics.offset;
  noise_factor(dynamics).matrixL().solveInPlace(v);
  return v;
}

MatrixXd draw_noise(int dimension, int count, double level, base::Rng& rng) {
  MatrixXd noise(dimension, count);
  for (double& value : noise.reshaped()) value = level * rng.normal();
  return noise;
}

}  // namespace laban::texture
