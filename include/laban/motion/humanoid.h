#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/motion/clip.h"
#include "laban/motion/standard_joint.h"

namespace laban::motion {

/// What plays one standard joint on a rig.
struct MappedJoint {
  int joint = -1;  ///< index in the rig's skeleton
  /// Model-space rotation of that joint when the rig stands in the standard reference T-pose
  /// (facing +Z, arms along +-X, palms down, legs straight down, feet forward).
  Eigen::Quaterniond reference = Eigen::Quaterniond::Identity();
};

/// How a rig is read.
struct HumanoidOptions {
  /// Joint names given by the user: they go before the name tables. A standard joint left out is
  /// looked up in the tables.
  std::map<StandardJoint, std::string> joint_names;
  /// Whether frame 0 of the clip is a T-pose and no motion; nullopt: found from the pose itself, on
  /// rigs whose files are known to begin so (cgspeed's conversions of CMU captures).
  std::optional<bool> t_pose_frame;
};

/// Which joint of a rig plays which of the 21 standard joints, and the rig's joint rotations in the
/// standard reference pose (DESIGN 2, METHODS 0). It belongs to one skeleton and may be used with
/// any clip on it.
///
/// Invariant: the 17 required joints are mapped, no rig joint plays two; references are unit
/// rotations; leg_length_m > 0.
class Humanoid {
 public:
  using Mapping = std::array<std::optional<MappedJoint>, kStandardJointCount>;

  /// @param root_point  of the hips joint, see root_point(); metres.
  /// @throws Error{kData} naming the first joint that breaks the invariant.
  Humanoid(std::string rig_name, const Skeleton& skeleton, Mapping joints, double leg_length_m,
           const Eigen::Vector3d& root_point, int first_motion_frame);

  /// The name table that fitted: "bandai", "cmu-31", "cmu-43", "mixamo", ..
  [[nodiscard]] const std::string& rig_name() const noexcept { return rig_name_; }
  /// Empty for an optional joint (clavicle, toe) that the rig does not have.
  [[nodiscard]] const std::optional<MappedJoint>& mapped(StandardJoint which) const {
    return joints_[static_cast<std::size_t>(index_of(which))];
  }
  /// Standard joint played by a rig joint, if any.
  [[nodiscard]] std::optional<StandardJoint> played_by(int rig_joint) const;
  /// Optional standard joints that the rig does not have, in order.
  [[nodiscard]] std::vector<StandardJoint> missing() const;
  /// Thigh plus shin, mean of left and right, metres.
  [[nodiscard]] double leg_length_m() const noexcept { return leg_length_m_; }
  /// Where the hips of the standard body lie, in the space of the rig's hips joint, metres: rigs
  /// put their hips joint anywhere from below the hip line to the waist, so the root path of a pose
  /// matrix follows the point that lies above the middle of the hip line by what the standard body
  /// has there.
  [[nodiscard]] const Eigen::Vector3d& root_point() const noexcept { return root_point_; }
  /// Joints of the skeleton it was made for.
  [[nodiscard]] int rig_joint_count() const noexcept { return rig_joint_count_; }
  /// Index of the first clip frame that is motion: 1 if frame 0 is a T-pose, else 0.
  [[nodiscard]] int first_motion_frame() const noexcept { return first_motion_frame_; }
  [[nodiscard]] bool has_t_pose_frame() const noexcept { return first_motion_frame_ > 0; }
  /// The same rig for a clip whose T-pose frame has been cut off: first_motion_frame() is 0.
  [[nodiscard]] Humanoid without_t_pose_frame() const;

 private:
  std::string rig_name_;
  Mapping joints_;
  double leg_length_m_;
  Eigen::Vector3d root_point_;
  int rig_joint_count_;
  int first_motion_frame_;
};

/// Index of the rig joint that plays each standard joint; empty where none does.
using StandardJointIndices = std::array<std::optional<int>, kStandardJointCount>;

/// Which joint of a skeleton plays which standard joint, by the names alone, as find_humanoid finds
/// them; empty where none is found.
/// @throws Error{kUsage} if options name a joint that the skeleton does not have.
[[nodiscard]] StandardJointIndices find_standard_joints(const Skeleton& skeleton,
                                                        const HumanoidOptions& options = {});

/// Finds the standard joints of a clip's skeleton by name and computes the reference pose.
///
/// Names are compared without case, separators, namespaces and prefixes such as "mixamorig:". Name
/// tables: Bandai, CMU by cgspeed (31 joints), CMU/Daz (43 joints), LAFAN1, Mixamo, the standard
/// body's own names, MotionBuilder/HIK, 3ds Max Biped, Unreal, Unity, VRM, Xsens, Rokoko, HDM05/CMU
/// ASF, Rigify, SMPL. The table that finds most joints wins, ties go to the first.
///
/// The reference is computed from the T-pose frame where the clip begins with one, else from the
/// rest skeleton: bone directions are turned into the standard T-pose, twist is fixed by a second
/// direction (knee and elbow hinge, hip line, shoulder line).
///
/// @throws Error{kData} naming the required joints that were not found, the nearest table and the
///         names that were seen;
///         Error{kUsage} if options name a joint that the skeleton does not have.
[[nodiscard]] Humanoid find_humanoid(const Clip& clip, const HumanoidOptions& options = {});

/// A clip of which every frame is motion, and its rig.
struct Capture {
  Clip clip;          ///< without the T-pose frame, if there was one
  Humanoid humanoid;  ///< first_motion_frame() is 0
};

/// find_humanoid, and the clip cut to its motion: what is to be resampled must be cut first, or the
/// T-pose would leak into the first frames. @throws as find_humanoid; Error{kData} if the T-pose is
/// the only frame.
[[nodiscard]] Capture find_capture(const Clip& clip, const HumanoidOptions& options = {});

}  // namespace laban::motion
