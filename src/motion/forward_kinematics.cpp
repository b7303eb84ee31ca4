#include "laban/motion/forward_kinematics.h"

namespace laban::motion {

namespace {

// Into a pose of as many joints, so that frame after frame needs no memory of its own.
void pose_frame(const Clip& clip, int frame, ModelPose& pose) {
  const int joints = clip.joint_count();
  const auto local = clip.rotations(frame);
  for (int j = 0; j < joints; ++j) {
    const auto cell = static_cast<std::size_t>(j);
    const int parent = clip.skeleton().joint(j).parent;
    const Eigen::Vector3d offset = clip.translation(frame, j);
    if (parent < 0) {
      pose.positions.col(j) = offset;
      pose.rotations[cell] = local[cell];
      continue;
    }
    const Eigen::Quaterniond& model_from_parent = pose.rotations[static_cast<std::size_t>(parent)];
    pose.positions.col(j) = pose.positions.col(parent) + model_from_parent * offset;
    pose.rotations[cell] = model_from_parent * local[cell];
  }
}

ModelPose unposed(int joints) {
  return {Eigen::Matrix3Xd(3, joints),
          std::vector<Eigen::Quaterniond>(static_cast<std::size_t>(joints))};
}

}  // namespace

ModelPose forward_kinematics(const Clip& clip, int frame) {
  ModelPose pose = unposed(clip.joint_count());
  pose_frame(clip, frame, pose);
  return pose;
}

Eigen::Matrix3Xd joint_positions(const Clip& clip) {
  const Eigen::Index joints = clip.joint_count();
  Eigen::Matrix3Xd positions(3, clip.frame_count() * joints);
  ModelPose pose = unposed(clip.joint_count());
  for (int f = 0; f < clip.frame_count(); ++f) {
    pose_frame(clip, f, pose);
    positions.middleCols(f * joints, joints) = pose.positions;
  }
  return positions;
}

ModelPose rest_pose(const Skeleton& skeleton) {
  const int joints = skeleton.joint_count();
  ModelPose pose{Eigen::Matrix3Xd(3, joints),
                 std::vector<Eigen::Quaterniond>(static_cast<std::size_t>(joints),
                                                 Eigen::Quaterniond::Identity())};
  for (int j = 0; j < joints; ++j) {
    const Joint& joint = skeleton.joint(j);
    pose.positions.col(j) = joint.rest_offset;
    if (joint.parent >= 0) pose.positions.col(j) += pose.positions.col(joint.parent);
  }
  return pose;
}

}  // namespace laban::motion
