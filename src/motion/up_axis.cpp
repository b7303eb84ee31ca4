#include "laban/motion/up_axis.h"

#include <algorithm>
#include <array>
#include <memory>
#include <numbers>

#include "laban/math/statistics.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRightAngle = std::numbers::pi / 2.0;

// Frames looked at, spread over the clip: a person's posture needs no more.
constexpr int kFramesSeen = 64;
// Cosine of the angle, 37 degrees, within which head over feet is clearly along an axis.
constexpr double kClearlyAlong = 0.8;
// A body whose head is this much above its feet along +Y stands there, whatever else.
constexpr double kStandsAlong = 0.5;

/// The direction from between the feet to the head.
Vector3d body_direction(const ModelPose& pose, int head, int left_foot, int right_foot) {
  const Vector3d feet = 0.5 * (pose.positions.col(left_foot) + pose.positions.col(right_foot));
  return (pose.positions.col(head) - feet).normalized();
}

}  // namespace

Quaterniond y_up_from(UpAxis up) {
  switch (up) {
    case UpAxis::kX:
      return Quaterniond(Eigen::AngleAxisd(kRightAngle, Vector3d::UnitZ()));
    case UpAxis::kY:
      return Quaterniond::Identity();
    case UpAxis::kZ:
      return Quaterniond(Eigen::AngleAxisd(-kRightAngle, Vector3d::UnitX()));
  }
  return Quaterniond::Identity();
}

Clip turned(const Clip& clip, const Quaterniond& turn) {
  const Eigen::Matrix3d rotation = turn.toRotationMatrix();
  std::vector<Joint> joints = clip.skeleton().joints();
  for (Joint& joint : joints) {
    joint.rest_offset = rotation * joint.rest_offset;
    if (joint.end_site) joint.end_site = Vector3d(rotation * *joint.end_site);
  }
  std::vector<Quaterniond> rotations;
  Eigen::Matrix3Xd translations;
  if (clip.has_translations()) {
    translations.resize(3, static_cast<Eigen::Index>(clip.frame_count()) * clip.joint_count());
  }
  for (int f = 0; f < clip.frame_count(); ++f) {
    for (int j = 0; j < clip.joint_count(); ++j) {
      if (clip.has_translations()) {
        translations.col(std::ssize(rotations)) = rotation * clip.translation(f, j);
      }
      rotations.push_back((turn * clip.rotation(f, j) * turn.conjugate()).normalized());
    }
  }
  return {std::make_shared<const Skeleton>(std::move(joints)), clip.frame_rate_hz(),
          rotation * clip.root_positions(), std::move(rotations), std::move(translations)};
}

UpAxis find_up_axis(const Clip& clip) {
  const StandardJointIndices joints = find_standard_joints(clip.skeleton());
  const auto& head = joints[static_cast<std::size_t>(index_of(StandardJoint::kHead))];
  const auto& left = joints[static_cast<std::size_t>(index_of(StandardJoint::kLeftFoot))];
  const auto& right = joints[static_cast<std::size_t>(index_of(StandardJoint::kRightFoot))];
  if (!head || !left || !right) return UpAxis::kY;
  const Vector3d at_rest = body_direction(rest_pose(clip.skeleton()), *head, *left, *right);
  if (at_rest.y() > kClearlyAlong) return UpAxis::kY;
  std::array<std::vector<double>, 3> directions;
  const int step = std::max(1, clip.frame_count() / kFramesSeen);
  for (int f = 0; f < clip.frame_count(); f += step) {
    const Vector3d body = body_direction(forward_kinematics(clip, f), *head, *left, *right);
    for (int axis = 0; axis < 3; ++axis) {
      directions[static_cast<std::size_t>(axis)].push_back(body[axis]);
    }
  }
  if (math::median(directions[1]) > kStandsAlong) return UpAxis::kY;
  if (math::median(directions[2]) > kClearlyAlong) return UpAxis::kZ;
  if (math::median(directions[0]) > kClearlyAlong) return UpAxis::kX;
  return UpAxis::kY;
}

}  // namespace laban::motion
