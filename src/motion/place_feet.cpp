#include "motion/place_feet.h"

#include <algorithm>
#include <string>
#include <vector>

#include "laban/base/error.h"
#include "laban/math/low_pass.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/place_feet.h"

namespace laban::motion {
namespace {

using Eigen::Index;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Displacements have nothing above this. Steps and kicks of captures lie below 6 Hz.
constexpr double kMapCutoffHz = 8.0;
constexpr int kRounds = 3;
/// Displacements below these are none: metres, radians.
constexpr double kNegligibleMove = 1e-9;
constexpr double kNegligibleTurn = 1e-9;
/// Rows of a leg in a displacement map: exponential maps of thigh and shin.
constexpr Index kLegRows = 6;

/// The rotations of a clip while they are edited.
struct Rotations {
  std::vector<Quaterniond> all;  // frame-major
  int joints = 0;

  explicit Rotations(const Clip& clip) : joints(clip.joint_count()) {
    for (int f = 0; f < clip.frame_count(); ++f) {
      const auto local = clip.rotations(f);
      all.insert(all.end(), local.begin(), local.end());
    }
  }
  [[nodiscard]] std::span<Quaterniond> at(int frame) {
    const auto count = static_cast<std::size_t>(joints);
    return std::span(all).subspan(static_cast<std::size_t>(frame) * count, count);
  }
  [[nodiscard]] Clip on(const Clip& clip) const {
    Eigen::Matrix3Xd translations;
    if (clip.has_translations()) {
      translations.resize(3, static_cast<Index>(clip.frame_count()) * joints);
      for (int f = 0; f < clip.frame_count(); ++f) {
        for (int j = 0; j < joints; ++j)
          translations.col(static_cast<Index>(f) * joints + j) = clip.translation(f, j);
      }
    }
    return {clip.shared_skeleton(), clip.frame_rate_hz(), clip.root_positions(), all,
            std::move(translations)};
  }
};

/// The turn of a joint, in its parent's space, that brings it from one rotation to another.
Vector3d turn(const Quaterniond& from, const Quaterniond& to) {
  return math::log(to * from.conjugate());
}

/// Displacements of both legs that would bring the feet to their goals, each frame by itself.
Eigen::MatrixXd solve(const Clip& clip, const std::array<LegJoints, 2>& legs,
                      const std::array<Eigen::Matrix3Xd, 2>& goals) {
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(2 * kLegRows, clip.frame_count());
  std::vector<Quaterniond> local;
  for (int f = 0; f < clip.frame_count(); ++f) {
    const ModelPose pose = forward_kinematics(clip, f);
    const auto before = clip.rotations(f);
    local.assign(before.begin(), before.end());
    for (std::size_t side = 0; side < 2; ++side) {
      const LegJoints& leg = legs[side];
      const Vector3d move = goals[side].col(f) - pose.positions.col(leg.foot);
      if (move.norm() < kNegligibleMove) continue;
      move_foot(pose, clip.skeleton(), leg, move, local);
      const auto thigh = static_cast<std::size_t>(leg.thigh);
      const auto shin = static_cast<std::size_t>(leg.shin);
      auto rows = map.col(f).segment<kLegRows>(static_cast<Index>(side) * kLegRows);
      rows << turn(before[thigh], local[thigh]), turn(before[shin], local[shin]);
    }
  }
  return map;
}

void displace(Rotations& rotations, const std::array<LegJoints, 2>& legs,
              const Eigen::MatrixXd& map) {
  for (Index f = 0; f < map.cols(); ++f) {
    const auto local = rotations.at(static_cast<int>(f));
    for (std::size_t side = 0; side < 2; ++side) {
      const Index row = static_cast<Index>(side) * kLegRows;
      const auto add = [&](int joint, const Vector3d& by) {
        Quaterniond& rotation = local[static_cast<std::size_t>(joint)];
        if (by.norm() >= kNegligibleTurn) rotation = (math::exp(by) * rotation).normalized();
      };
      add(legs[side].thigh, map.block<3, 1>(row, f));
      add(legs[side].shin, map.block<3, 1>(row + 3, f));
    }
  }
}

/// Bends knees that the low-pass has straightened farther than move_foot would, and turns the feet
/// of displaced legs back to how `original` has them.
void settle(Rotations& rotations, const Clip& original, const std::array<LegJoints, 2>& legs) {
  const Clip clip = rotations.on(original);
  for (int f = 0; f < clip.frame_count(); ++f) {
    const auto local = rotations.at(f);
    const auto moved = [&](int joint) {
      return local[static_cast<std::size_t>(joint)].coeffs() !=
             original.rotation(f, joint).coeffs();
    };
    const ModelPose before = forward_kinematics(original, f);
    const ModelPose pose = forward_kinematics(clip, f);
    for (const LegJoints& leg : legs) {
      if (!moved(leg.thigh) && !moved(leg.shin)) continue;
      // What is as bent as it was stays so, to the bit.
      const double least = std::min(kStraightestKnee, knee_bend(before, leg) - kSettleWidth);
      settle_leg(pose, clip.skeleton(), leg, least,
                 before.rotations[static_cast<std::size_t>(leg.foot)], local);
    }
  }
}

}  // namespace

std::array<LegJoints, 2> legs_of(const Humanoid& humanoid, std::span<const ModelPose> poses) {
  using enum StandardJoint;
  const auto leg_of = [&](StandardJoint thigh, StandardJoint shin, StandardJoint foot) {
    LegJoints leg{humanoid.mapped(thigh)->joint, humanoid.mapped(shin)->joint,
                  humanoid.mapped(foot)->joint, Vector3d::UnitX()};
    leg.hinge = find_hinge(poses, leg, humanoid.mapped(thigh)->reference);
    return leg;
  };
  return {leg_of(kLeftThigh, kLeftShin, kLeftFoot), leg_of(kRightThigh, kRightShin, kRightFoot)};
}

Clip mend_knees(const Clip& clip, const std::array<LegJoints, 2>& legs) {
  Rotations rotations(clip);
  bool any = false;
  for (int f = 0; f < clip.frame_count(); ++f) {
    const ModelPose pose = forward_kinematics(clip, f);
    for (const LegJoints& leg : legs)
      any = mend_knee(pose, clip.skeleton(), leg, rotations.at(f)) || any;
  }
  return any ? rotations.on(clip) : clip;
}

Clip place_feet(const Clip& clip, const std::array<LegJoints, 2>& legs,
                const std::array<Eigen::Matrix3Xd, 2>& goals) {
  Clip placed = clip;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::MatrixXd map = solve(placed, legs, goals);
    if (map.isZero(0.0)) break;
    Rotations rotations(placed);
    displace(rotations, legs, math::low_pass(map, clip.frame_rate_hz(), kMapCutoffHz));
    settle(rotations, clip, legs);
    placed = rotations.on(clip);
  }
  return placed;
}

Clip place_feet(const Clip& clip, const Humanoid& humanoid,
                const std::array<Eigen::Matrix3Xd, 2>& goals) {
  if (clip.joint_count() != humanoid.rig_joint_count()) {
    throw base::Error(base::ErrorKind::kUsage, "place_feet: the clip has " +
                                                   std::to_string(clip.joint_count()) +
                                                   " joints, the humanoid was made for " +
                                                   std::to_string(humanoid.rig_joint_count()));
  }
  for (const Eigen::Matrix3Xd& path : goals) {
    if (path.cols() != clip.frame_count() || !path.allFinite()) {
      throw base::Error(base::ErrorKind::kData, "place_feet: " + std::to_string(path.cols()) +
                                                    " goals for " +
                                                    std::to_string(clip.frame_count()) +
                                                    " frames (must be as many, and finite)");
    }
  }
  std::vector<ModelPose> poses;
  for (int f = 0; f < clip.frame_count(); ++f) poses.push_back(forward_kinematics(clip, f));
  return place_feet(clip, legs_of(humanoid, poses), goals);
}

}  // namespace laban::motion
