#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/pose_matrix.h"

namespace laban::motion {

/// The points by which a body stands. The toe is the toe joint; the heel lies behind the foot joint
/// by 0.3 times the foot's length and, while the foot is flat, as high as the toe joint. A rig
/// without toes gets the standard body's, moved with the foot.
enum class FootPoint { kLeftHeel, kLeftToe, kRightHeel, kRightToe };
inline constexpr int kFootPointCount = 4;

[[nodiscard]] constexpr int index_of(FootPoint point) {
  return static_cast<int>(point);
}
[[nodiscard]] constexpr bool is_toe(FootPoint point) {
  return point == FootPoint::kLeftToe || point == FootPoint::kRightToe;
}

/// Where the four points are over time, model space.
struct FootPaths {
  double frame_rate_hz = 0.0;
  std::array<Eigen::Matrix3Xd, kFootPointCount> points;  ///< 3 x F each, metres

  [[nodiscard]] int frame_count() const noexcept { return static_cast<int>(points[0].cols()); }
};

/// Paths of all frames of a clip, a T-pose frame among them.
/// @throws Error{kUsage} if the humanoid was made for a skeleton of another size.
[[nodiscard]] FootPaths foot_paths(const Clip& clip, const Humanoid& humanoid);

/// Which points of the feet are on the ground, frame by frame: 1 on it, 0 off it. What was blended
/// or resampled may lie between; one half and more counts as on the ground. Rig-free, so contacts
/// found on one body hold for the same motion on another.
struct FootContacts {
  double frame_rate_hz = 0.0;
  Eigen::Matrix4Xd share;  ///< 4 x F in [0, 1], rows as in FootPoint

  [[nodiscard]] int frame_count() const noexcept { return static_cast<int>(share.cols()); }
  [[nodiscard]] bool touches(FootPoint point, int frame) const {
    return share(index_of(point), frame) >= 0.5;
  }
  [[nodiscard]] bool any() const { return share.size() > 0 && share.maxCoeff() >= 0.5; }
};

/// Thresholds on a body of kStandardLegLengthM; they scale with the leg where paths are given with
/// one. A point comes to the ground below both `enter` values and leaves it above either `leave`
/// value (hysteresis).
struct FootContactOptions {
  double enter_height_m = 0.03;
  double leave_height_m = 0.05;
  double enter_speed_m_s = 0.4;
  double leave_speed_m_s = 0.6;
  /// Contacts and gaps shorter than this are none.
  double shortest_s = 0.08;
  /// Speed is that of paths without what is faster than this.
  double cutoff_hz = 8.0;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// The height at which heels and toes stand, metres; captures put their floor off by centimetres,
/// and rigs their joints above it.
struct FootFloor {
  double heel_m = 0.0;
  double toe_m = 0.0;

  [[nodiscard]] double of(FootPoint point) const { return is_toe(point) ? toe_m : heel_m; }
};

struct FoundContacts {
  FootContacts contacts;
  /// Median heights of heels and toes in contact; nullopt if nothing ever is.
  std::optional<FootFloor> floor;
};

/// Finds contacts by height above the motion's own floor and by speed, with hysteresis.
///
/// The floor is first taken as the lowest level at which heels (toes) are slow for long enough: the
/// 10th percentile of their heights while slower than enter_speed_m_s. A heel level more than 8 cm
/// above that of the toes is no floor (who stands on his toes has no heel on the ground), nor the
/// other way about. Contacts hardly depend on the frame rate from 30 Hz up: speed is that of
/// smoothed paths.
///
/// @param leg_length_m  of the body: lengths and speeds in `options` scale with it.
/// @throws Error{kUsage} if `options` has problems, or rate or leg length is not positive;
///         Error{kData} if the paths have no frame, differ in length or are not finite.
[[nodiscard]] FoundContacts find_foot_contacts(const FootPaths& paths, double leg_length_m,
                                               const FootContactOptions& options = {});
[[nodiscard]] FoundContacts find_foot_contacts(const Clip& clip, const Humanoid& humanoid,
                                               const FootContactOptions& options = {});
/// The same for a pose matrix, as played on the standard body.
[[nodiscard]] FoundContacts find_foot_contacts(const PoseMatrix& pose,
                                               const FootContactOptions& options = {});

/// Contacts at fractional frames (linear, clamped to the ends): carries contacts through a time
/// warp or to another rate.
/// @throws Error{kUsage} if a frame is not finite; Error{kData} if there is no contact frame.
[[nodiscard]] FootContacts sample(const FootContacts& contacts, std::span<const double> frames,
                                  double frame_rate_hz);

/// At another frame rate; frames as motion::resample gives them.
[[nodiscard]] FootContacts resample(const FootContacts& contacts, double frame_rate_hz);

/// (1 - alpha) a + alpha b with alpha clamped to [0, 1]: a blend beyond one of its clips touches
/// the ground where that clip does. @throws Error{kData} if rates or frame counts differ.
[[nodiscard]] FootContacts mix(const FootContacts& a, const FootContacts& b, double alpha);

/// One after the other, as motion::concatenate joins the poses.
/// @throws Error{kUsage} if there is no part; Error{kData} if rates differ.
[[nodiscard]] FootContacts concatenate(std::span<const FootContacts> parts);

}  // namespace laban::motion
