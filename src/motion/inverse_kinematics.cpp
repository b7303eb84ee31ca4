#include "laban/motion/inverse_kinematics.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

#include "laban/base/error.h"

namespace laban::motion {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// A bone shorter than this points nowhere, metres.
constexpr double kShortestBone = 1e-6;
// Share of the bones' weight that a guide has where positions say everything.
constexpr double kGuideShare = 1e-3;

/// The rotation R of greatest trace(R' B), B = sum of weight * place * offset': the eigenvector of
/// the greatest eigenvalue of Davenport's matrix.
Quaterniond best_rotation(const Matrix3d& B) {
  const Matrix3d S = B + B.transpose();
  const Vector3d z(B(2, 1) - B(1, 2), B(0, 2) - B(2, 0), B(1, 0) - B(0, 1));
  Eigen::Matrix4d K;
  K.topLeftCorner<3, 3>() = S - B.trace() * Matrix3d::Identity();
  K.topRightCorner<3, 1>() = z;
  K.bottomLeftCorner<1, 3>() = z.transpose();
  K(3, 3) = B.trace();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solved(K);
  const Eigen::Vector4d q = solved.eigenvectors().col(3);
  return Quaterniond(q[3], q[0], q[1], q[2]).normalized();
}

/// The bones of one joint: where they end at rest, and where they shall end as seen from the joint.
struct Bones {
  Matrix3d B = Matrix3d::Zero();
  double weight = 0.0;
  int count = 0;
  Vector3d offset = Vector3d::Zero();  // of the last one
  Vector3d place = Vector3d::Zero();
};

Quaterniond turned(const Bones& bones, const Quaterniond& guide) {
  if (bones.count == 0) return guide;
  if (bones.count == 1) {
    const Vector3d guided = guide * bones.offset;
    const double missing = std::max(0.0, 1.0 - bones.place.norm() / bones.offset.norm());
    const Vector3d target = bones.place + missing * guided;
    if (target.norm() < kShortestBone) return guide;
    return (Quaterniond::FromTwoVectors(guided, target) * guide).normalized();
  }
  return best_rotation(bones.B + kGuideShare * bones.weight * guide.toRotationMatrix());
}

}  // namespace

std::vector<Quaterniond> rotations_from_positions(
    const Skeleton& skeleton, const Eigen::Ref<const Eigen::Matrix3Xd>& positions,
    std::span<const Quaterniond> guide) {
  const int joints = skeleton.joint_count();
  if (positions.cols() != joints || std::ssize(guide) != joints) {
    throw Error(ErrorKind::kUsage, "rotations_from_positions: " + std::to_string(positions.cols()) +
                                       " positions and " + std::to_string(guide.size()) +
                                       " guides for " + std::to_string(joints) + " joints");
  }
  if (!positions.allFinite()) {
    throw Error(ErrorKind::kData, "rotations_from_positions: a position is not finite");
  }
  std::vector<std::vector<int>> children(static_cast<std::size_t>(joints));
  for (int j = 1; j < joints; ++j) {
    children[static_cast<std::size_t>(skeleton.joint(j).parent)].push_back(j);
  }
  std::vector<Quaterniond> rotations(static_cast<std::size_t>(joints));
  Eigen::Matrix3Xd reached(3, joints);
  reached.col(0) = positions.col(0);
  for (int j = 0; j < joints; ++j) {
    const auto cell = static_cast<std::size_t>(j);
    Bones bones;
    for (const int child : children[cell]) {
      const Vector3d& offset = skeleton.joint(child).rest_offset;
      if (offset.norm() < kShortestBone) continue;
      bones.offset = offset;
      bones.place = positions.col(child) - reached.col(j);
      bones.B += bones.place * offset.transpose();
      bones.weight += offset.squaredNorm();
      ++bones.count;
    }
    rotations[cell] = turned(bones, guide[cell]);
    for (const int child : children[cell]) {
      reached.col(child) = reached.col(j) + rotations[cell] * skeleton.joint(child).rest_offset;
    }
  }
  return rotations;
}

}  // namespace laban::motion
