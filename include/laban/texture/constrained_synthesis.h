#pragma once

#include <vector>

#include <Eigen/Dense>

#include "laban/base/rng.h"
#include "laban/texture/linear_dynamics.h"

namespace laban::texture {

/// Frames of a texton between given ends, two at either side, at least [Li02, 5.2].
inline constexpr int kFewestConstrained = 5;

/// States of a linear dynamic system given some of them ([Li02, eq. 6-9] with pins as further known
/// frames): of all others, what least squares makes of the rows
///
///     B^-1 (x_{t+1} - A1 x_t - A2 x_{t-1} - D) = n_t,     t = 1 .. length - 2 (from 0), B B' =
///     covariance.
///
/// The rows are whitened, so that for standard normal n_t the solution is an exact draw from the
/// system conditioned on the known frames, and for n_t = 0 the likeliest one. With frames 0 and 1
/// alone known it is the system run forwards.
///
/// The factor is made once and solves for any known states and noise: keep it.
class ConstrainedStates {
 public:
  /// @param known  frames whose states are given, ascending, 0 and 1 among them.
  /// @throws Error{kUsage} if `known` is not so, or length < 2; Error{kNumeric} if the covariance
  /// is
  ///         not positive definite.
  /// Time O(length m^3), memory O(length m^2).
  ConstrainedStates(const LinearDynamics& dynamics, int length, std::vector<int> known);

  [[nodiscard]] int length() const noexcept { return length_; }
  [[nodiscard]] int dimension() const noexcept { return static_cast<int>(whitened_offset_.size()); }
  [[nodiscard]] const std::vector<int>& known() const noexcept { return known_; }

  /// @param states  m x length, of which the known columns count.
  /// @param noise   m x (length - 2), column t - 1 is n_t; none (no column): 0.
  /// @returns m x length; known columns as given.
  /// @throws Error{kUsage} if a size does not fit.
  /// Time O(length m^2).
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::Ref<const Eigen::MatrixXd>& states,
                                      const Eigen::Ref<const Eigen::MatrixXd>& noise) const;

  /// Log density of the known frames after the first two given the first two: how likely the system
  /// is to come from the one to the others. `likeliest` is solve() of them without noise.
  [[nodiscard]] double log_density(const Eigen::Ref<const Eigen::MatrixXd>& likeliest) const;

 private:
  [[nodiscard]] auto block(int frame, int below) {
    return factor_.middleCols((3 * frame + below) * dimension(), dimension());
  }
  [[nodiscard]] auto block(int frame, int below) const {
    return factor_.middleCols((3 * frame + below) * dimension(), dimension());
  }
  void factorize(const std::vector<bool>& is_known);
  [[nodiscard]] Eigen::MatrixXd rows_left(const Eigen::Ref<const Eigen::MatrixXd>& x,
                                          const Eigen::Ref<const Eigen::MatrixXd>& noise) const;
  void step(Eigen::MatrixXd& x, const Eigen::Ref<const Eigen::MatrixXd>& noise) const;

  int length_;
  std::vector<int> known_;
  std::vector<int> pins_;  // known frames between first_ and last_
  int first_ = 0;          // first frame that is not known
  int last_ = -1;          // last one
  // The whitened rows: next_ x_{t+1} + now_ x_t + before_ x_{t-1} = whitened_offset_ + n_t.
  Eigen::MatrixXd next_;
  Eigen::MatrixXd now_;
  Eigen::MatrixXd before_;
  Eigen::VectorXd whitened_offset_;
  // Blocks (s, s), (s + 1, s), (s + 2, s) of the Cholesky factor of the normal equations, for each
  // frame s, side by side.
  Eigen::MatrixXd factor_;
};

/// What drove a motion: the n_t of ConstrainedStates with which its states solve every row, m x
/// (frames - 2). @throws as ConstrainedStates; Error{kUsage} for fewer than two frames.
[[nodiscard]] Eigen::MatrixXd innovations(const LinearDynamics& dynamics,
                                          const Eigen::Ref<const Eigen::MatrixXd>& states);

/// m x count normal numbers of deviation `level`.
[[nodiscard]] Eigen::MatrixXd draw_noise(int dimension, int count, double level, base::Rng& rng);

}  // namespace laban::texture
