#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Dense>

namespace laban::loop {

/// What is compared of two frames.
enum class FrameDistance {
  kMahalanobis,  ///< [Graphcut, eq. 2], the paper's choice
  kL2,           ///< 1 - the similarity of [Graphcut, eq. 1], its baseline
};

struct TurningPointOptions {
  FrameDistance distance = FrameDistance::kMahalanobis;
  /// How many frames before and after a frame are compared (n of eq. 3), seconds, > 0.
  double window_s = 0.5;
  /// How fast the weight of frames falls with their distance (s of eq. 3), >= 1.
  int falloff = 1;
  /// A turning point is the largest of the frames within so many seconds, >= 0.
  double apart_s = 0.25;
  /// Least symmetry of a turning point, in [0, 1].
  double threshold = 0.9;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// w_r = C(2n, n - r s) for r = 1 .. n, 0 where n - r s < 0, normalised to sum 1
/// [Graphcut, eq. 3], by lgamma. @param window, falloff  >= 1.
[[nodiscard]] Eigen::VectorXd symmetry_weights(int window, int falloff);

/// How well the motion after each frame is the motion before it played backwards
/// [Graphcut, eq. 3-4]: 1 - sym_i / max(sym), sym_i = sum_r w_r D_{i-r,i+r}.
///
/// Near the ends the r that fit count, weights renormalised; with less than half the weights'
/// window a frame has no symmetry, -1. All -1 if no two frames differ.
/// @param distance  of two frames, called with i < j.
[[nodiscard]] Eigen::VectorXd symmetry(int frame_count, const Eigen::VectorXd& weights,
                                       const std::function<double(int, int)>& distance);

struct TurningPoint {
  int frame = 0;
  double symmetry = 0.0;  ///< in [0, 1]
  /// P_max = symmetry / 2 [Graphcut, eq. 5].
  [[nodiscard]] double most_probability() const noexcept { return 0.5 * symmetry; }
};

struct Turning {
  Eigen::VectorXd symmetry;          ///< a value a frame; -1 where there is none
  std::vector<TurningPoint> points;  ///< by frame
  /// How still the first and the last frame are, on the scale of `symmetry`: what it would be if
  /// the motion went on beyond the end as it came, x(i + r) = 2 x(i) - x(i - r).
  double first_symmetry = 0.0;
  double last_symmetry = 0.0;
};

/// Frames from which the motion can be played backwards: local maxima of the symmetry above the
/// threshold. Joint angles alone count, not where the body is or faces.
///
/// @param angles  3K x F exponential maps, radians.
/// @throws Error{kUsage} if `options` has problems; Error{kData} as the distance maps.
/// O(F n K): the maps themselves are not built.
[[nodiscard]] Turning find_turning_points(const Eigen::Ref<const Eigen::MatrixXd>& angles,
                                          double frame_rate_hz,
                                          const TurningPointOptions& options = {});

}  // namespace laban::loop
