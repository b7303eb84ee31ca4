#include "laban/texture/observation_space.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "laban/base/error.h"
#include "laban/math/branch.h"
#include "laban/math/rotation.h"

namespace laban::texture {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using motion::kAngleRowCount;
using motion::kStandardJointCount;
using motion::PoseMatrix;

/// The rotation that lies nearest to all of a joint's [Markley et al. 2007]: eigenvector of
/// sum q q' of the largest eigenvalue; q and -q count alike.
Quaterniond mean_rotation(std::span<const PoseMatrix> takes, int joint) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const PoseMatrix& take : takes) {
    for (int f = 0; f < take.frame_count(); ++f) {
      const Quaterniond q = math::exp(take.angles.block<3, 1>(3 * joint, f));
      sum.noalias() += q.coeffs() * q.coeffs().transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sum);
  Quaterniond mean;
  mean.coeffs() = solver.eigenvectors().col(3);
  mean.normalize();
  return mean.w() < 0.0 ? Quaterniond(-mean.coeffs()) : mean;
}

/// Exponential maps of one joint away from its reference, unwrapped along time.
Eigen::Matrix3Xd away_from(const Quaterniond& reference, const MatrixXd& angles, int joint) {
  Eigen::Matrix3Xd away(3, angles.cols());
  for (Index f = 0; f < angles.cols(); ++f) {
    const Vector3d r =
        math::log(reference.conjugate() * math::exp(angles.block<3, 1>(3 * joint, f)));
    away.col(f) = f == 0 ? r : math::nearest_branch(r, away.col(f - 1));
  }
  return away;
}

/// The same rotations on the branch where they stay nearest to the reference: a take that begins
/// with more than half a turn is then told as one that gets there.
Eigen::Matrix3Xd on_nearest_branch(Eigen::Matrix3Xd away) {
  if (away.colwise().squaredNorm().maxCoeff() <= std::numbers::pi * std::numbers::pi) return away;
  for (const int turns : {-1, 1}) {
    Eigen::Matrix3Xd shifted = math::shift_branch(away, turns);
    if (shifted.squaredNorm() < away.squaredNorm()) away = std::move(shifted);
  }
  return away;
}

/// Sums of squares about the mean, and from frame to frame, of the rows of angles.
struct Spread {
  double about_mean = 0.0;  ///< mean square
  double step = 0.0;
};

Spread angle_spread(const std::vector<MatrixXd>& observations) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(kAngleRowCount);
  double squares = 0.0;
  double steps = 0.0;
  double frames = 0.0;
  double differences = 0.0;
  for (const MatrixXd& take : observations) {
    const auto angles = take.topRows(kAngleRowCount);
    sum += angles.rowwise().sum();
    squares += angles.squaredNorm();
    frames += static_cast<double>(angles.cols());
    if (angles.cols() < 2) continue;
    const Index pairs = angles.cols() - 1;
    steps += (angles.rightCols(pairs) - angles.leftCols(pairs)).squaredNorm();
    differences += static_cast<double>(pairs);
  }
  Spread spread;
  spread.about_mean = std::max(0.0, squares / frames - (sum / frames).squaredNorm());
  spread.step = differences > 0.0 ? steps / differences : 0.0;
  return spread;
}

}  // namespace

MatrixXd observe(const ObservationSpace& space, const PoseMatrix& pose) {
  MatrixXd observations(kObservationRows, pose.frame_count());
  for (int s = 0; s < kStandardJointCount; ++s) {
    observations.middleRows<3>(3 * s) =
        on_nearest_branch(away_from(space.reference[static_cast<std::size_t>(s)], pose.angles, s));
  }
  observations.row(kHeightRow) = pose.height;
  observations.middleRows<3>(kStepRow) = pose.steps;
  return space.scale.asDiagonal() * observations;
}

MatrixXd on_branches_near(const ObservationSpace& space, MatrixXd observations,
                          const Eigen::Ref<const Eigen::VectorXd>& near) {
  for (Index row = 0; row < kAngleRowCount; row += 3) {
    const Vector3d scale = space.scale.segment<3>(row);
    Vector3d before = near.segment<3>(row).cwiseQuotient(scale);
    for (Index f = 0; f < observations.cols(); ++f) {
      auto angles = observations.block<3, 1>(row, f);
      before = math::nearest_branch(angles.cwiseQuotient(scale), before);
      angles = before.cwiseProduct(scale);
    }
  }
  return observations;
}

Eigen::VectorXd offset_between(const ObservationSpace& space,
                               const Eigen::Ref<const Eigen::VectorXd>& from,
                               const Eigen::Ref<const Eigen::VectorXd>& to,
                               const Eigen::VectorXd& near) {
  Eigen::VectorXd offset = to - from;
  for (Index row = 0; row < kAngleRowCount; row += 3) {
    const Vector3d scale = space.scale.segment<3>(row);
    const auto rotation = [&](const auto& y) {
      return math::exp(y.template segment<3>(row).cwiseQuotient(scale));
    };
    Vector3d turn = math::log(rotation(from).conjugate() * rotation(to));
    if (near.size() > 0) {
      turn = math::nearest_branch(turn, near.segment<3>(row).cwiseQuotient(scale));
    }
    offset.segment<3>(row) = turn.cwiseProduct(scale);
  }
  return offset;
}

MatrixXd with_offsets(const ObservationSpace& space, MatrixXd observations,
                      const Eigen::Ref<const MatrixXd>& offsets) {
  for (Index row = 0; row < kAngleRowCount; row += 3) {
    const Vector3d scale = space.scale.segment<3>(row);
    Vector3d before = observations.block<3, 1>(row, 0).cwiseQuotient(scale);
    for (Index f = 0; f < observations.cols(); ++f) {
      auto angles = observations.block<3, 1>(row, f);
      const Vector3d turn = offsets.block<3, 1>(row, f).cwiseQuotient(scale);
      const Quaterniond turned = math::exp(angles.cwiseQuotient(scale)) * math::exp(turn);
      before = math::nearest_branch(math::log(turned), before);
      angles = before.cwiseProduct(scale);
    }
  }
  const Index rest = kObservationRows - kAngleRowCount;
  observations.bottomRows(rest) += offsets.bottomRows(rest);
  return observations;
}

PoseMatrix poses_of(const ObservationSpace& space, const Eigen::Ref<const MatrixXd>& observations,
                    double frame_rate_hz, double leg_length_m) {
  if (observations.rows() != kObservationRows) {
    throw Error(ErrorKind::kUsage, "poses_of: an observation has " +
                                       std::to_string(kObservationRows) + " rows, not " +
                                       std::to_string(observations.rows()));
  }
  const MatrixXd plain = space.scale.cwiseInverse().asDiagonal() * observations;
  PoseMatrix pose{frame_rate_hz, leg_length_m, MatrixXd(kAngleRowCount, plain.cols()),
                  plain.row(kHeightRow), plain.middleRows<3>(kStepRow)};
  for (int s = 0; s < kStandardJointCount; ++s) {
    const Quaterniond& reference = space.reference[static_cast<std::size_t>(s)];
    for (Index f = 0; f < plain.cols(); ++f) {
      const Vector3d r = math::log(reference * math::exp(plain.block<3, 1>(3 * s, f)));
      pose.angles.block<3, 1>(3 * s, f) =
          f == 0 ? r : math::nearest_branch(r, pose.angles.block<3, 1>(3 * s, f - 1));
    }
  }
  return pose;
}

ObservationSpace learn_observation_space(std::span<const PoseMatrix> takes) {
  if (takes.empty()) throw Error(ErrorKind::kUsage, "learn_observation_space: there is no take");
  ObservationSpace space;
  for (int s = 0; s < kStandardJointCount; ++s)
    space.reference[static_cast<std::size_t>(s)] = mean_rotation(takes, s);
  space.scale = Eigen::VectorXd::Ones(kObservationRows);
  std::vector<MatrixXd> observations;
  for (const PoseMatrix& take : takes) observations.push_back(observe(space, take));
  const Spread spread = angle_spread(observations);
  // A radian counts as a leg length: turned by it in the hip, a straight leg's foot goes as far.
  // Root steps are differences from frame to frame, and grow smaller the higher the rate. They are
  // multiplied by what makes the angles' own differences as large as the angles are (rms), so that
  // travel counts beside the poses as much as speed does beside position. Where nothing moves there
  // is nothing to weigh.
  if (spread.step > 0.0 && spread.about_mean > 0.0) {
    space.scale.tail<3>().setConstant(
        std::clamp(std::sqrt(spread.about_mean / spread.step), 1.0, 1000.0));
  }
  return space;
}

}  // namespace laban::texture
