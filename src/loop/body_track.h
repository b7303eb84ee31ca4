#pragma once

#include <array>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "laban/motion/foot_contacts.h"
#include "laban/motion/humanoid.h"

namespace laban::loop {

/// A rigid motion over the ground: a turn about +Y, then a shift in x and z.
struct PlanarMotion {
  double yaw = 0.0;                                 ///< radians
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< metres, y = 0

  [[nodiscard]] Eigen::Vector3d operator()(const Eigen::Vector3d& point) const;
  /// First `other`, then this.
  [[nodiscard]] PlanarMotion after(const PlanarMotion& other) const;
};

/// One frame of a body, its place in the world held by the hips alone, whatever joints a rig has
/// above them.
struct BodyFrame {
  Eigen::Vector3d hips = Eigen::Vector3d::Zero();  ///< model space, metres
  /// A rotation a row of BodyRows: of the hips (row 0) in model space, of others parent-from-joint.
  std::vector<Eigen::Quaterniond> rotations;
  Eigen::Matrix3Xd offsets;  ///< 3 x R from the parent, metres, or empty: at rest; row 0 unused
  Eigen::Vector4d contacts = Eigen::Vector4d::Zero();  ///< shares as in FootContacts
  double source_frame = 0.0;                           ///< of the clip it comes from
  /// What the left and the right toe have stepped since the frame before and no capture did,
  /// metres.
  Eigen::Matrix<double, 3, 2> added_steps = Eigen::Matrix<double, 3, 2>::Zero();

  void move(const PlanarMotion& motion);
};

/// The joints of a rig that move with the hips, hips first: rows of seams and of Poisson grids.
struct BodyRows {
  /// @throws Error{kUsage} if the humanoid was made for a skeleton of another size.
  BodyRows(const motion::Skeleton& skeleton, const motion::Humanoid& humanoid);

  std::vector<int> joints;   ///< of each row
  std::vector<int> parents;  ///< row of the parent, -1 for row 0
  std::vector<Eigen::Vector3d> rest_offsets;
  std::vector<int> points;  ///< rows that play standard joints
  /// Length of the longest chain of bones below each row plus 5 % of a leg, metres: how far a turn
  /// of the joint moves the body.
  Eigen::VectorXd reach_m;
  std::array<int, motion::kFootPointCount> feet{};  ///< row of the foot of each foot point
  double leg_length_m = 0.0;
  std::array<int, 2> toes{};  ///< row of the left and right toe, of the foot where a rig has none

  [[nodiscard]] int count() const noexcept { return static_cast<int>(joints.size()); }
};

/// Model-space positions of all rows, 3 x R.
[[nodiscard]] Eigen::Matrix3Xd positions(const BodyRows& rows, const BodyFrame& frame);

/// All frames of a clip. @param contacts  a column a frame.
[[nodiscard]] std::vector<BodyFrame> to_body_frames(const motion::Clip& clip, const BodyRows& rows,
                                                    const motion::FootContacts& contacts);

/// Frames as a clip on the skeleton of `source`: joints above the hips, and beside them, are as in
/// the source at each frame's source_frame; the hips' place is solved for.
[[nodiscard]] motion::Clip to_clip(const std::vector<BodyFrame>& frames, const BodyRows& rows,
                                   const motion::Clip& source);

/// Between two frames: rotations by slerp, places and contacts linearly; `b` at share 1. The source
/// frame is a's below one half.
[[nodiscard]] BodyFrame mix(const BodyFrame& a, const BodyFrame& b, double share);

/// Frame at a fractional place, clamped to the ends: cubics through the two frames on either side,
/// so that velocities do not break at frames when motion is played slower; contacts linearly. Exact
/// at whole places.
[[nodiscard]] BodyFrame sample(const std::vector<BodyFrame>& frames, double place);

}  // namespace laban::loop
