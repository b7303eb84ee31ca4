#pragma once

#include <array>
#include <vector>

#include <Eigen/Dense>

#include "laban/align/time_warp.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/pose_matrix.h"

namespace laban::blend {

/// Blend weights that are allowed: a quarter beyond either clip (METHODS 1.2).
inline constexpr double kMinAlpha = -0.25;
inline constexpr double kMaxAlpha = 1.25;

/// Two clips of one content and the time warp between them, ready to be blended at any weight.
/// Immutable; safe to use from many threads.
class BlendPair {
 public:
  /// Exponential maps are compared along the warp, joint by joint; where one of the two clips comes
  /// nearer to the other on another branch (and stays a continuous curve there), it is moved to it,
  /// whole: a branch shift a joint, never a choice per frame (METHODS 0).
  ///
  /// @throws Error{kData} if the frame rates differ, a pose matrix's parts disagree in size, or the
  ///         warp is not between clips of these frame counts.
  BlendPair(const motion::PoseMatrix& clip_i, const motion::PoseMatrix& clip_j,
            align::TimeWarp warp);

  [[nodiscard]] const align::TimeWarp& warp() const noexcept { return warp_; }
  [[nodiscard]] double frame_rate_hz() const noexcept { return frame_rate_hz_; }

  /// What is sampled of one clip at fractional frames.
  struct Source {
    /// 67 x F: 63 angles (branch-shifted), height, then the planar root path x, z, yaw from 0.
    Eigen::MatrixXd rows;
    double leg_length_m = 0.0;
  };
  /// Clip i and clip j.
  [[nodiscard]] const std::array<Source, 2>& sources() const noexcept { return sources_; }

 private:
  align::TimeWarp warp_;
  double frame_rate_hz_;
  std::array<Source, 2> sources_;
};

/// A blend and where its frames were taken from: frame k is made of clip i at times_i[k] and of
/// clip j at times_j[k], in (fractional) frames. Contacts and joints beyond the standard ones
/// follow the same times.
struct Blend {
  motion::PoseMatrix pose;
  std::vector<double> times_i;
  std::vector<double> times_j;
};

/// Space-time interpolation [Torresani06, 5], METHODS 1.2: (1 - alpha) clip i + alpha clip j, in
/// time, pose and root travel.
///
/// - Frame k shows (1 - alpha) X_i(p_k) + alpha X_j(q_k) of angles and height, (p_k, q_k) from
///   TimeWarp::sample. Leg length blends alike.
/// - Step k is the blend of the two rigid planar motions from p_(k-1) to p_k and from q_(k-1) to
///   q_k, each in its clip's heading frame at its beginning.
/// - alpha = 0 gives clip i: its frame count, poses, height and steps to round-off; alpha = 1 clip
/// j.
///   (Of a joint that the pair holds on another branch, the same rotation.) The result is
///   continuous in alpha but for the frame count, and X_ij(alpha) = X_ji(1 - alpha).
///
/// @param alpha  in [kMinAlpha, kMaxAlpha]. @throws Error{kUsage} otherwise.
[[nodiscard]] Blend blend(const BlendPair& pair, double alpha);

/// Contacts of a blend, from those of its clips at the times its frames were taken from: mixed by
/// alpha, which counts as 0 or 1 where it lies beyond them (motion::mix).
[[nodiscard]] motion::FootContacts blend_contacts(const Blend& blend, double alpha,
                                                  const motion::FootContacts& contacts_i,
                                                  const motion::FootContacts& contacts_j);

}  // namespace laban::blend
