#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/progress.h"
#include "laban/base/rng.h"
#include "laban/manifold/pose_manifold.h"
#include "laban/motion/clip.h"

namespace laban::manifold {

/// A motion on the map: a point for each frame.
struct MapPath {
  Eigen::Matrix2Xd points;      ///< 2 x F, inside the map
  std::vector<int> primitives;  ///< in the order of the walk; empty for a path through points
  std::vector<int> passed;      ///< frame at which each waypoint is passed (the nearest one)
  /// Frames, ascending, at which the path goes on elsewhere on the map, at a pose that is alike: a
  /// map of a cycle has folds, and the way around one passes through other poses.
  std::vector<int> cuts;
  int jumps = 0;  ///< times a walk stood where nothing is known to follow
};

/// Frames along the spline through points of the map [Manifold 5.1].
///
/// The curve is timed so that the body moves as fast as the captures do at each place of the map
/// (their mean joint speed there, kept within a third and three times its median), then stretched
/// to `frames`; nullopt leaves it as it is. Between two points whose poses are alike, but which lie
/// on two sides of a fold of the map, it is cut.
///
/// @param waypoints  2 x N map units, N >= 1; clamped to the map.
/// @throws Error{kUsage} if frames < 1; Error{kData} if there is no point or one is not finite.
[[nodiscard]] MapPath path_through(const PoseManifold& manifold,
                                   const Eigen::Ref<const Eigen::Matrix2Xd>& waypoints,
                                   std::optional<int> frames = std::nullopt);

/// The path that is at one of these points at each frame, such as the captures' own
/// (PoseManifold::points), with its cuts.
///
/// @param points  2 x F map units; clamped to the map.
[[nodiscard]] MapPath path_along(const PoseManifold& manifold,
                                 const Eigen::Ref<const Eigen::Matrix2Xd>& points);

struct WalkOptions {
  double seconds = 10.0;  ///< > 0, at most an hour
  /// Noise on the transitions away from each primitive, in shares of all that leaves it, >= 0.
  double perturb = 0.0;

  /// Broken rules; empty when valid.
  [[nodiscard]] std::vector<std::string> problems() const;
};

/// A walk over primitives from a point of the map [Manifold 4.2, 5.2]: walk_states from the point's
/// primitive, again from where it ended, each time on freshly perturbed transitions, until the time
/// is filled. From one primitive to the next the spline follows frames of a capture that went
/// there, to the frame nearest to the next one's centre, and where none did, the way over the map
/// to the centre on which poses change least (ours: the paper's line between centres cuts strides
/// short, and may cross a fold of the map).
///
/// What follows a primitive is counted among the captures that came to it from the same one, if any
/// did (ours; first order otherwise): a primitive may hold both steps of a walk.
///
/// The noise is on the transitions between different primitives, which alone choose the walk: on
/// all entries, as printed, a scale of 0.1 would drown them (a primitive lasts for tens of frames,
/// so each is a few hundredths). Where nothing is known to follow, the walk goes on to the
/// primitive of nearest pose not just left, and counts a jump.
///
/// @throws Error{kUsage} if `options` has problems, or "interrupted" if progress asks.
[[nodiscard]] MapPath markov_path(const PoseManifold& manifold, const Eigen::Vector2d& start,
                                  const WalkOptions& options, base::Rng& rng,
                                  base::Progress* progress = nullptr);

/// How travel over the ground is rebuilt, which poses on the map do not hold.
enum class Travel {
  kContacts,    ///< feet that the captures have on the ground at that place of the map stand still
  kPrimitives,  ///< as far as the captures travel at that place of the map
  kNone,        ///< stay above the origin, facing +Z
};

struct PlayOptions {
  Travel travel = Travel::kContacts;
  /// Hold the feet by motion::lock_feet afterwards; never with kNone.
  bool lock_feet = true;
};

/// Plays a path as a clip on the manifold's rig, at its rate, begun over the origin, facing +Z.
///
/// Rotations come by inverse kinematics from the positions at each point (pose_at); a bone turns
/// about itself, head, hands and toes against the joint above, and joints that play no standard
/// one, by at most 12 radians a second, any other joint by at most 48, so that flips of the
/// captures' angles do not come through. Turns of the body, and travel where no foot stands, are
/// those of the captures at each place of the map, times how far the body moves along with them
/// there: 1 as captured, -1 played backwards, at most twice as fast.
///
/// @throws Error{kData} if the path has no frame; Error{kUsage} "interrupted" if progress asks.
[[nodiscard]] motion::Clip play(const PoseManifold& manifold, const MapPath& path,
                                const PlayOptions& options = {},
                                base::Progress* progress = nullptr);

}  // namespace laban::manifold
