#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/texture/motion_texture.h"

namespace laban::texture {

/// How one texton is fitted to its segments.
struct TextonFit {
  /// States: as many as hold `explained_share` of the variance of the texton's observations, at
  /// least min_dimension, at most max_dimension ([Li02, 3.2]: 12 to 15); fewer where there are
  /// fewer than four frames for each.
  int min_dimension = 12;
  int max_dimension = 15;
  double explained_share = 0.99;
  /// Of the dynamics, see fit_dynamics; a texton seen once has hardly two rows a regressor.
  double ridge = 1e-3;
  /// Least variance of anything, observation units squared: (0.2 degrees)^2, what captures of joint
  /// angles do not resolve.
  double variance_floor = 1.2e-5;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// Fits a texton to frames [begin, begin + length) of each segment together, in closed form
/// (METHODS 2.2, M-step): mean and basis by the singular values of the pooled observations,
/// dynamics by least squares on the states, start moments over all pairs of frames. Deterministic.
/// @param observations  d x N. @param segments  within it, each at least three frames.
/// @throws Error{kUsage} if `options` has problems; Error{kData} if there is no segment or one is
///         too short, out of range or not finite.
[[nodiscard]] Texton fit_texton(const Eigen::Ref<const Eigen::MatrixXd>& observations,
                                std::span<const Segment> segments, const TextonFit& options = {});

/// Free parameters of a texton, for BIC: mean, basis, dynamics, noise and start moments.
[[nodiscard]] int parameter_count(const Texton& texton);

/// Log-likelihood of observations under one texton (METHODS 2.2): all d directions are charged, so
/// textons of different basis and dimension compare.
class TextonLikelihood {
 public:
  /// @throws Error{kNumeric} if a covariance is not positive definite.
  explicit TextonLikelihood(const Texton& texton);

  /// F terms log N(x_t; A1 x_{t-1} + A2 x_{t-2} + D, B B') + log N(r_t; 0, s^2 I); the first two
  /// are 0. @param y  d x F.
  [[nodiscard]] Eigen::VectorXd step_terms(const Eigen::Ref<const Eigen::MatrixXd>& y) const;
  /// F terms for a segment that begins at t: the joint log density of states t and t + 1 under the
  /// start moments, and of both residuals; the last is 0.
  [[nodiscard]] Eigen::VectorXd start_terms(const Eigen::Ref<const Eigen::MatrixXd>& y) const;
  /// Of one whole segment, F >= 3: its first start term and all step terms.
  [[nodiscard]] double segment(const Eigen::Ref<const Eigen::MatrixXd>& y) const;

 private:
  [[nodiscard]] Eigen::VectorXd residual_terms(const Eigen::MatrixXd& centered,
                                               const Eigen::MatrixXd& x) const;

  Texton texton_;
  Eigen::LLT<Eigen::MatrixXd> noise_;
  Eigen::LLT<Eigen::MatrixXd> start_;
  double noise_constant_ = 0.0;  // log of the normal density at its mode
  double start_constant_ = 0.0;
  double residual_constant_ = 0.0;
};

/// Sum of TextonLikelihood::segment over segments of the d x N observations.
[[nodiscard]] double segments_log_likelihood(const Eigen::MatrixXd& observations,
                                             const Texton& texton,
                                             const std::vector<Segment>& segments);

/// d x F one-step predictions of frame t from frames t - 1 and t - 2, mean + C (A1 x + A2 x' + D);
/// the first two columns are copies of the observations.
[[nodiscard]] Eigen::MatrixXd one_step_predictions(const Texton& texton,
                                                   const Eigen::Ref<const Eigen::MatrixXd>& y);

}  // namespace laban::texture
