#include "laban/motion/standard_body.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "laban/math/rotation.h"

namespace laban::motion {
namespace {

// Offsets from the parent in the T-pose, metres, for a leg of 0.84 m: segment lengths of a 1.75 m
// adult, rounded. Left is +X.
Skeleton build_standard_skeleton() {
  const auto left = [](double x, double y, double z) { return Eigen::Vector3d(x, y, z); };
  const auto right = [](double x, double y, double z) { return Eigen::Vector3d(-x, y, z); };
  std::vector<Joint> joints(kStandardJointCount);
  const auto set = [&joints](StandardJoint which, const Eigen::Vector3d& offset) {
    const auto i = static_cast<std::size_t>(index_of(which));
    joints[i].name = std::string(kStandardJointNames[i]);
    joints[i].parent = kStandardParents[i];
    joints[i].rest_offset = offset;
  };
  const auto end = [&joints](StandardJoint which, const Eigen::Vector3d& offset) {
    joints[static_cast<std::size_t>(index_of(which))].end_site = offset;
  };
  using enum StandardJoint;
  set(kHips, left(0.0, 0.98, 0.0));
  set(kSpine, left(0.0, 0.10, 0.0));
  set(kChest, left(0.0, 0.14, 0.0));
  set(kNeck, left(0.0, 0.26, 0.0));
  set(kHead, left(0.0, 0.10, 0.0));
  end(kHead, left(0.0, 0.18, 0.0));
  const auto side = [&](StandardJoint clavicle, StandardJoint thigh, const auto& at) {
    const auto next = [](StandardJoint joint, int steps) {
      return static_cast<StandardJoint>(index_of(joint) + steps);
    };
    set(clavicle, at(0.03, 0.20, 0.0));
    set(next(clavicle, 1), at(0.15, 0.0, 0.0));
    set(next(clavicle, 2), at(0.28, 0.0, 0.0));
    set(next(clavicle, 3), at(0.26, 0.0, 0.0));
    end(next(clavicle, 3), at(0.18, 0.0, 0.0));
    set(thigh, at(0.09, -0.06, 0.0));
    set(next(thigh, 1), at(0.0, -0.42, 0.0));
    set(next(thigh, 2), at(0.0, -0.42, 0.0));
    set(next(thigh, 3), at(0.0, -0.06, 0.13));
    end(next(thigh, 3), at(0.0, -0.02, 0.07));
  };
  side(kLeftClavicle, kLeftThigh, left);
  side(kRightClavicle, kRightThigh, right);
  return Skeleton(std::move(joints));
}

// Frames side by side: every operation of forward kinematics is one on so many numbers.
constexpr int kLanes = 8;
using Lane = Eigen::Array<double, kLanes, 1>;

struct LaneVector {
  Lane x, y, z;
};
struct LaneTurn {
  Lane w, x, y, z;
};

/// Taylor coefficients of cos t and sin t / t in t^2: exact to round-off for |t| <= pi, a whole
/// turn.
constexpr int kTerms = 14;
constexpr std::array<std::array<double, kTerms>, 2> taylor_coefficients() {
  std::array<std::array<double, kTerms>, 2> found{};
  double factorial = 1.0;
  for (std::size_t k = 0; k < kTerms; ++k) {
    const auto n = static_cast<double>(2 * k);
    if (k > 0) factorial *= -(n - 1.0) * n;
    found[0][k] = 1.0 / factorial;
    found[1][k] = 1.0 / (factorial * (n + 1.0));
  }
  return found;
}
constexpr auto kTaylor = taylor_coefficients();

LaneTurn exp(const LaneVector& r) {
  constexpr double kMostSquared = 9.8696044;  // pi^2
  const Lane squared = 0.25 * (r.x.square() + r.y.square() + r.z.square());
  Lane cosine, sinc;
  if ((squared <= kMostSquared).all()) {
    cosine = Lane::Constant(kTaylor[0].back());
    sinc = Lane::Constant(kTaylor[1].back());
    for (std::size_t k = kTerms - 1; k > 0; --k) {
      cosine = cosine * squared + kTaylor[0][k - 1];
      sinc = sinc * squared + kTaylor[1][k - 1];
    }
  } else {
    const Lane half = squared.sqrt();
    cosine = half.cos();
    sinc = (half < 1e-4).select(1.0 - squared / 6.0, half.sin() / half);
  }
  const Lane half_sinc = 0.5 * sinc;
  return {cosine, half_sinc * r.x, half_sinc * r.y, half_sinc * r.z};
}

LaneTurn operator*(const LaneTurn& a, const LaneTurn& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z, a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x};
}

/// p + q o q*.
LaneVector plus_turned(const LaneVector& p, const LaneTurn& q, const Eigen::Vector3d& o) {
  const Lane tx = 2.0 * (q.y * o.z() - q.z * o.y());
  const Lane ty = 2.0 * (q.z * o.x() - q.x * o.z());
  const Lane tz = 2.0 * (q.x * o.y() - q.y * o.x());
  return {p.x + o.x() + q.w * tx + q.y * tz - q.z * ty,
          p.y + o.y() + q.w * ty + q.z * tx - q.x * tz,
          p.z + o.z() + q.w * tz + q.x * ty - q.y * tx};
}

/// Joints that others hang from: of the others, the rotation moves nothing.
constexpr std::array<bool, kStandardJointCount> parents() {
  std::array<bool, kStandardJointCount> found{};
  for (const int parent : kStandardParents) {
    if (parent >= 0) found[static_cast<std::size_t>(parent)] = true;
  }
  return found;
}
constexpr auto kIsParent = parents();

}  // namespace

const std::shared_ptr<const Skeleton>& standard_skeleton() {
  static const auto skeleton = std::make_shared<const Skeleton>(build_standard_skeleton());
  return skeleton;
}

Clip to_standard_clip(const PoseMatrix& pose, const PlanarPose& start) {
  const Eigen::Matrix3Xd path = planar_path(pose, start);
  const int frames = pose.frame_count();
  Eigen::Matrix3Xd root(3, frames);
  std::vector<Eigen::Quaterniond> rotations;
  rotations.reserve(static_cast<std::size_t>(frames) * kStandardJointCount);
  for (int f = 0; f < frames; ++f) {
    root.col(f) << path(0, f), pose.height(f), path(1, f);
    for (int s = 0; s < kStandardJointCount; ++s) {
      const Eigen::Quaterniond q = math::exp(pose.angles.block<3, 1>(3 * s, f));
      rotations.push_back(s == 0 ? math::yaw_rotation(path(2, f)) * q : q);
    }
  }
  return {standard_skeleton(), pose.frame_rate_hz, root * kStandardLegLengthM,
          std::move(rotations)};
}

Eigen::MatrixXd standard_joint_positions(const PoseMatrix& pose, const PlanarPose& start) {
  const Eigen::Matrix3Xd path = planar_path(pose, start);
  const std::vector<Joint>& joints = standard_skeleton()->joints();
  const Eigen::Index frames = pose.frame_count();
  Eigen::MatrixXd positions(3 * kStandardJointCount, frames);
  std::array<LaneTurn, kStandardJointCount> turns;
  std::array<LaneVector, kStandardJointCount> places;
  for (Eigen::Index begin = 0; begin < frames; begin += kLanes) {
    const Eigen::Index count = std::min<Eigen::Index>(kLanes, frames - begin);
    const auto row_of = [&](const auto& rows, Eigen::Index row) {
      Lane lane = Lane::Constant(rows(row, begin));
      for (Eigen::Index l = 1; l < count; ++l) lane[l] = rows(row, begin + l);
      return lane;
    };
    for (std::size_t s = 0; s < kStandardJointCount; ++s) {
      const auto row = static_cast<Eigen::Index>(3 * s);
      if (s == 0) {
        places[0] = {kStandardLegLengthM * row_of(path, 0),
                     kStandardLegLengthM * row_of(pose.height, 0),
                     kStandardLegLengthM * row_of(path, 1)};
      } else {
        const auto parent = static_cast<std::size_t>(kStandardParents[s]);
        places[s] = plus_turned(places[parent], turns[parent], joints[s].rest_offset);
      }
      const auto store = [&](Eigen::Index axis, const Lane& lane) {
        for (Eigen::Index l = 0; l < count; ++l) positions(row + axis, begin + l) = lane[l];
      };
      store(0, places[s].x);
      store(1, places[s].y);
      store(2, places[s].z);
      if (!kIsParent[s]) continue;
      const LaneVector own = {row_of(pose.angles, row), row_of(pose.angles, row + 1),
                              row_of(pose.angles, row + 2)};
      turns[s] = (s == 0 ? exp({Lane::Zero(), row_of(path, 2), Lane::Zero()})
                         : turns[static_cast<std::size_t>(kStandardParents[s])]) *
                 exp(own);
    }
  }
  return positions;
}

}  // namespace laban::motion
