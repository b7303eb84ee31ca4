#include "laban/manifold/pose_vector.h"

#include "laban/base/error.h"
#include "laban/motion/standard_body.h"

namespace laban::manifold {

Eigen::MatrixXd pose_vectors(const motion::PoseMatrix& pose) {
  motion::PoseMatrix still = pose;
  still.steps.setZero();
  return motion::standard_joint_positions(still);
}

double mean_joint_distance(const Eigen::Ref<const Eigen::VectorXd>& a,
                           const Eigen::Ref<const Eigen::VectorXd>& b) {
  if (a.size() != kPoseRowCount || b.size() != kPoseRowCount) {
    throw base::Error(base::ErrorKind::kData, "mean_joint_distance: poses of " +
                                                  std::to_string(a.size()) + " and " +
                                                  std::to_string(b.size()) + " rows, must be " +
                                                  std::to_string(kPoseRowCount));
  }
  double sum = 0.0;
  for (int joint = 0; joint < motion::kStandardJointCount; ++joint) {
    sum += (a.segment<3>(3 * joint) - b.segment<3>(3 * joint)).norm();
  }
  return sum / motion::kStandardJointCount;
}

}  // namespace laban::manifold
