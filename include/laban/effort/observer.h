#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

#include "laban/effort/effort.h"
#include "laban/motion/pose_matrix.h"

namespace laban::effort {

/// What the kinematic observer sees in a movement before it is compared with others of its kind
/// (DESIGN 6): one number a factor, larger towards the condensing pole (Bound, Strong, Sudden).
/// Always finite.
struct Descriptors {
  double flow = 0.0;    ///< hesitation: rest and unevenness, logs of shares of time
  double weight = 0.0;  ///< log of kinetic energy over quickness per body mass, log(m^2/s)
  double time = 0.0;    ///< log of quickness: speed over reach, log(1/s)

  friend bool operator==(const Descriptors&, const Descriptors&) = default;
};

/// Measures a movement as played on the standard body, so that the performer's size plays no part;
/// the formulas, and why they are so, stand in observer.cpp. Where a movement begins and which way
/// it faces do not matter; its frame rate (30 Hz and more), a millimetre of noise and single frames
/// in which a capture jumps hardly do.
///
/// Played s times as fast, a movement gains log s of Time and of Weight, up to what the frame rate
/// takes. A hold of half a second or more raises Flow (0.2 s nearly always), by about -log(1 - h)
/// to -3 log(1 - h) as a share h of the time. (tests/effort/observer_laws_test.cpp holds both.)
///
/// A clip that does not move, or has a single frame, gets the least Weight there is (log 1e-4), a
/// Time of 0 (speed and reach at their floors) and the Flow of complete stillness (log 1000).
/// @throws Error{kData} if the pose matrix has no frame or a value that is not finite;
/// Error{kUsage}
///         if its frame rate is not positive and finite.
[[nodiscard]] Descriptors describe(const motion::PoseMatrix& pose);
/// The same of a motion that is played already.
/// @param joint_positions  motion::standard_joint_positions of it, metres. @throws as above.
[[nodiscard]] Descriptors describe(const Eigen::MatrixXd& joint_positions, double frame_rate_hz);

/// The same in a window that slides over the movement: 3 x F, rows flow, weight, time as in
/// Descriptors, a column a frame; the window is centred on the frame and cut at the clip's ends.
/// @param window_s  length of the window, > 0; shorter than 5 frames counts as 5 frames.
/// @throws Error{kUsage} for a window that is not positive and finite; as describe.
[[nodiscard]] Eigen::Matrix3Xd describe_over_time(const motion::PoseMatrix& pose,
                                                  double window_s = 1.0);

/// What is usual: robust centre and scale of the descriptors inside each content group and over all
/// fragments. Part of a table's and a model's training record; plain values, to be stored as they
/// are.
struct ObserverReference {
  std::vector<std::string> groups;  ///< G names
  /// 3 x (G + 1): median of flow, weight, time (rows) in each group (columns); the last column is
  /// the pooled reference of all fragments.
  Eigen::Matrix3Xd center;
  /// 3 x (G + 1): robust deviation (1.4826 MAD), > 0.
  Eigen::Matrix3Xd scale;

  /// Column of a group; nullopt if it is not among them.
  [[nodiscard]] std::optional<int> find(std::string_view group) const;
};

/// Fits a reference to N >= 1 fragments.
///
/// A group's squared scale is (1 - b) own^2 + b within^2: `own` the robust deviation inside it,
/// `within` that of the deviations inside all groups together, b = max(1/4, 4 / (N_g + 3)). So a
/// group of few fragments borrows its spread, and one in which a factor hardly varies does not blow
/// nuances up to the ends of the scale. No scale is below 0.05.
/// @param groups  N names; an empty name counts to the pooled reference only.
/// @throws Error{kData} if there is no fragment or the lengths differ.
[[nodiscard]] ObserverReference fit_observer_reference(std::span<const Descriptors> descriptors,
                                                       std::span<const std::string> groups);

/// What the observer says of a movement.
struct Observation {
  Effort effort;     ///< in [-3, 3]
  Effort unclipped;  ///< before clipping
  /// The group was not in the reference, so that the pooled one was used.
  bool pooled = false;
};

/// Effort points per robust deviation: two deviations (95 % of normal values) reach the ends of
/// [-3, 3].
inline constexpr double kEffortPerDeviation = 1.5;

/// Compares descriptors with what is usual in a content group:
/// effort = kEffortPerDeviation * (descriptor - center) / scale, clipped to [-3, 3].
[[nodiscard]] Observation observe(const Descriptors& descriptors,
                                  const ObserverReference& reference, std::string_view group);

/// describe_over_time compared with the reference as observe does; 3 x F in [-3, 3].
[[nodiscard]] Eigen::Matrix3Xd observe_over_time(const motion::PoseMatrix& pose,
                                                 const ObserverReference& reference,
                                                 std::string_view group, double window_s = 1.0);

}  // namespace laban::effort
