#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/align/dtw.h"

namespace laban::align {

/// The steepest a time warp may be: 1/4 <= dq/dp <= 4 (METHODS 1.2). Then
/// tau_alpha = (1 - alpha) p + alpha q runs strictly forward for every alpha in [-0.25, 1.25].
inline constexpr double kMaxWarpSlope = 4.0;

/// True if two fragments of these frame counts (>= 1) have any time warp within kMaxWarpSlope:
/// (frames_j - 1) / (frames_i - 1) lies in [1/4, 4], or both have one frame.
[[nodiscard]] bool blendable(int frames_i, int frames_j);

/// Source times that belong together, in frames.
struct WarpPoint {
  double p = 0.0;  ///< time in clip i, in [0, T_i - 1]
  double q = 0.0;  ///< time in clip j, in [0, T_j - 1]
};

/// A strictly increasing curve (p(n), q(n)) from (0, 0) to (T_i - 1, T_j - 1), piecewise linear in
/// n: which time of clip i corresponds to which time of clip j, once a pair, whatever the blend
/// weight (METHODS 1.2). Immutable.
///
/// Invariant: at least one knot; the first is (0, 0), the last whole frames; between knots both
/// times increase and 1/4 <= dq/dp <= 4 (to round-off).
class TimeWarp {
 public:
  /// @param p, q  knots, as many of one as of the other.
  /// @throws Error{kData} naming the first knot that breaks the invariant.
  TimeWarp(Eigen::VectorXd p, Eigen::VectorXd q);

  [[nodiscard]] const Eigen::VectorXd& p() const noexcept { return p_; }
  [[nodiscard]] const Eigen::VectorXd& q() const noexcept { return q_; }
  [[nodiscard]] int knot_count() const noexcept { return static_cast<int>(p_.size()); }
  /// Frames of the two clips, T_i and T_j.
  [[nodiscard]] int frames_i() const noexcept;
  [[nodiscard]] int frames_j() const noexcept;

  /// Frames of the blend at `alpha`: max(2, floor(Tbar + 1/2)), Tbar = (1 - alpha) T_i + alpha T_j;
  /// 1 if both clips have one frame (so that alpha = 0 gives clip i back there too).
  /// @throws Error{kUsage} unless -0.25 <= alpha <= 1.25.
  [[nodiscard]] int frame_count(double alpha) const;

  /// The point of the curve where (1 - alpha) p + alpha q = tau; tau is clamped to [0, Tbar - 1].
  /// @throws Error{kUsage} unless -0.25 <= alpha <= 1.25.
  [[nodiscard]] WarpPoint solve(double alpha, double tau) const;

  /// The frame_count(alpha) points of the blend's frames: tau_k = k (Tbar - 1) / (T_alpha - 1), the
  /// rounding of its length spread evenly, both ends exact. p and q strictly increase.
  /// @throws Error{kUsage} unless -0.25 <= alpha <= 1.25.
  [[nodiscard]] std::vector<WarpPoint> sample(double alpha) const;

  /// The same curve with the clips exchanged.
  [[nodiscard]] TimeWarp swapped() const { return {q_, p_}; }

 private:
  Eigen::VectorXd p_;  // increasing, from 0
  Eigen::VectorXd q_;  // increasing, from 0, as many as p_
};

struct TimeWarpOptions {
  /// Half-width of the smoothing of the warp's slope, in frames, >= 0; 0 leaves the projection as
  /// it is. A path of whole cells is a staircase, whose corners would show as jitter in a blend's
  /// velocity.
  double smoothing_frames = 4.0;
  /// Steepest slope of the projection, in (1, 4]: 1 / max_slope <= dq/dp <= max_slope, widened to a
  /// pair's own overall slope where that is steeper. Less than 4 gives up a little of the match for
  /// calmer extrapolation: at alpha = 1.25 a clip at slope 1/4 plays 16 times as fast as the blend.
  double max_slope = kMaxWarpSlope;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// The time warp nearest to a path of DTW (METHODS 1.2).
///
/// In the coordinates u = p + q, v = q - p a path is a function v(u) that changes by at most 1 a
/// unit, and 1/4 <= dq/dp <= 4 says |dv/du| <= 3/5. The warp is the least-squares projection of
/// v(0), v(1), .., v(T_i + T_j - 2) onto the functions with that slope and the same ends: one
/// convex problem, solved exactly by dynamic programming over piecewise quadratic functions. Its
/// slope is then smoothed by a symmetric non-negative kernel (mirrored at the ends, so that the
/// ends stay and the limit holds). Exchanging the clips exchanges p and q; reversing the path
/// reverses the warp.
///
/// @param path  cells from (0, 0) to (T_i - 1, T_j - 1), steps (1,0), (0,1) or (1,1).
/// @throws Error{kUsage} if `options` has problems; Error{kData} if the path is none of that kind,
/// or
///         if its ends are not blendable().
/// Time O(T^2) at worst for T = T_i + T_j (milliseconds for thousands of frames).
[[nodiscard]] TimeWarp warp_of_path(std::span<const FramePair> path,
                                    const TimeWarpOptions& options = {});

}  // namespace laban::align
