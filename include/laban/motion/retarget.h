#pragma once

#include <optional>
#include <span>

#include "laban/motion/clip.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/pose_matrix.h"

namespace laban::motion {

/// A clip as a pose matrix (DESIGN 2, METHODS 0): what two rigs say about one pose, in the same
/// numbers. Pose frame t is clip frame t + humanoid.first_motion_frame(), at the clip's rate.
///
/// R_s = G_s(t) G_s(ref)^-1 with G_s the model-space rotation of the rig joint that plays standard
/// joint s; the local rotation is q_s = R_parent(s)^-1 R_s, the identity for a joint that the rig
/// does not have; rotations of rig joints between two standard ones fall to the lower one. The hips
/// split into heading and tilt. Exponential maps begin on the principal branch and are unwrapped
/// along time.
///
/// Forearms and shins are hinges here: their turn about their own bone, which rigs put into the
/// forearm, the hand or extra joints as they like (and one public conversion lets drift in the shin
/// by up to 140 degrees), falls to the hand or foot. It moves no joint.
///
/// @throws Error{kUsage} if the humanoid was made for a skeleton of another size; Error{kData} if
/// no
///         frame is left after the T-pose.
/// Time O(F * J).
[[nodiscard]] PoseMatrix to_pose_matrix(const Clip& clip, const Humanoid& humanoid);

/// Where a clip's root path begins, in leg lengths and radians: the `start` at which planar_path of
/// its pose matrix gives the clip's own path back.
[[nodiscard]] PlanarPose planar_start(const Clip& clip, const Humanoid& humanoid);

/// Where from_pose_matrix takes from the source what the pose matrix does not say.
struct RetargetOptions {
  /// For each pose frame the (fractional) frame of the source at which the rig's other joints are
  /// read, counted as the frames of to_pose_matrix(source, humanoid) are; clamped to the source's
  /// range. Empty: spread evenly from the source's first frame to its last.
  std::span<const double> source_frames;
  /// Where the root path begins; nullopt: where the source's does.
  std::optional<PlanarPose> start;
};

/// Plays a pose matrix on the rig of `source`: the inverse of to_pose_matrix.
///
/// Every mapped joint gets exactly its model-space rotation R_s G_s(ref), and the root path (scaled
/// by the rig's leg length) is exact. Every other joint, and positions animated on joints below the
/// hips, keep the source's own motion at the warped time (slerp, lerp). If the hips joint is not
/// the root, the joints above keep the source's motion and the hips' own offset is solved for, so
/// that the clip animates translations.
///
/// @returns a clip of pose.frame_count() frames at pose.frame_rate_hz on source's skeleton.
/// @throws Error{kUsage} if the humanoid does not fit the source, or source_frames has another
///         length than the pose matrix or values that are not finite; Error{kData} if the source
///         has no frame after its T-pose.
[[nodiscard]] Clip from_pose_matrix(const PoseMatrix& pose, const Humanoid& humanoid,
                                    const Clip& source, const RetargetOptions& options = {});

}  // namespace laban::motion
