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

// Frames side by side: every operation of forward kinematics is one on so many numbers (vectors of
// the compiler, g++ and clang++). All of it is inlined, so that it can be compiled for more than
// one instruction set.
constexpr int kLanes = 4;
using Lane = double __attribute__((vector_size(kLanes * sizeof(double))));
#define LABAN_LANES [[gnu::always_inline]] inline

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

/// Far rotations, one at a time.
void exp_far(const Lane& squared, Lane& cosine, Lane& sinc) {
  for (int l = 0; l < kLanes; ++l) {
    const double half = std::sqrt(squared[l]);
    cosine[l] = std::cos(half);
    sinc[l] = half < 1e-4 ? 1.0 - squared[l] / 6.0 : std::sin(half) / half;
  }
}

LABAN_LANES void exp(const LaneVector& r, LaneTurn& turn) {
  constexpr double kMostSquared = 9.8696044;  // pi^2
  const Lane squared = 0.25 * (r.x * r.x + r.y * r.y + r.z * r.z);
  bool near = true;
  for (int l = 0; l < kLanes; ++l) near &= squared[l] <= kMostSquared;
  Lane cosine{}, sinc{};
  if (near) {
    cosine = Lane{} + kTaylor[0].back();
    sinc = Lane{} + kTaylor[1].back();
    for (std::size_t k = kTerms - 1; k > 0; --k) {
      cosine = cosine * squared + kTaylor[0][k - 1];
      sinc = sinc * squared + kTaylor[1][k - 1];
    }
  } else {
    exp_far(squared, cosine, sinc);
  }
  const Lane half_sinc = 0.5 * sinc;
  turn = {cosine, half_sinc * r.x, half_sinc * r.y, half_sinc * r.z};
}

LABAN_LANES void multiply(const LaneTurn& a, const LaneTurn& b, LaneTurn& product) {
  product = {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z, a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x};
}

/// p + q o q*.
LABAN_LANES void add_turned(const LaneVector& p, const LaneTurn& q, const Eigen::Vector3d& o,
                            LaneVector& sum) {
  const double ox = o.x(), oy = o.y(), oz = o.z();
  const Lane tx = 2.0 * (q.y * oz - q.z * oy);
  const Lane ty = 2.0 * (q.z * ox - q.x * oz);
  const Lane tz = 2.0 * (q.x * oy - q.y * ox);
  sum = {p.x + ox + q.w * tx + q.y * tz - q.z * ty, p.y + oy + q.w * ty + q.z * tx - q.x * tz,
         p.z + oz + q.w * tz + q.x * ty - q.y * tx};
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

/// Numbers `stride` apart, of up to kLanes frames; lanes without a frame repeat the first.
LABAN_LANES void load(const double* from, Eigen::Index stride, Eigen::Index count, Lane& lane) {
  const auto at = [&](Eigen::Index l) { return from[l < count ? l * stride : 0]; };
  lane = Lane{at(0), at(1), at(2), at(3)};
}
LABAN_LANES void load(const double* from, Eigen::Index stride, Eigen::Index count,
                      LaneVector& lanes) {
  load(from, stride, count, lanes.x);
  load(from + 1, stride, count, lanes.y);
  load(from + 2, stride, count, lanes.z);
}
LABAN_LANES void store(const LaneVector& lanes, Eigen::Index stride, Eigen::Index count,
                       double* to) {
  for (Eigen::Index l = 0; l < count; ++l) {
    to[l * stride] = lanes.x[l];
    to[l * stride + 1] = lanes.y[l];
    to[l * stride + 2] = lanes.z[l];
  }
}

/// Positions of the joints in the frames of a pose matrix that goes along `path`.
LABAN_LANES void play(const PoseMatrix& pose, const Eigen::Matrix3Xd& path,
                      Eigen::MatrixXd& positions) {
  const std::vector<Joint>& joints = standard_skeleton()->joints();
  constexpr Eigen::Index kRows = 3 * kStandardJointCount;
  LaneTurn turns[kStandardJointCount];
  LaneVector places[kStandardJointCount];
  for (Eigen::Index begin = 0; begin < positions.cols(); begin += kLanes) {
    const Eigen::Index count = std::min<Eigen::Index>(kLanes, positions.cols() - begin);
    const double* const angles = pose.angles.data() + kRows * begin;
    double* const output = positions.data() + kRows * begin;
    LaneVector root{};  // x, z, yaw
    load(path.data() + 3 * begin, 3, count, root);
    Lane height{};
    load(pose.height.data() + begin, 1, count, height);
    places[0] = {kStandardLegLengthM * root.x, kStandardLegLengthM * height,
                 kStandardLegLengthM * root.y};
    LaneTurn heading{};
    exp({Lane{}, root.z, Lane{}}, heading);
    for (std::size_t s = 0; s < kStandardJointCount; ++s) {
      const auto parent = static_cast<std::size_t>(std::max(kStandardParents[s], 0));
      if (s > 0) add_turned(places[parent], turns[parent], joints[s].rest_offset, places[s]);
      store(places[s], kRows, count, output + 3 * s);
      if (!kIsParent[s]) continue;
      LaneVector own{};
      load(angles + 3 * s, kRows, count, own);
      LaneTurn turn{};
      exp(own, turn);
      multiply(s == 0 ? heading : turns[parent], turn, turns[s]);
    }
  }
}

void play_by_twos(const PoseMatrix& pose, const Eigen::Matrix3Xd& path,
                  Eigen::MatrixXd& positions) {
  play(pose, path, positions);
}

#if defined(__x86_64__)
// Four numbers at a time. Without FMA, so that every machine gives the same bytes.
[[gnu::target("avx2")]] void play_by_fours(const PoseMatrix& pose, const Eigen::Matrix3Xd& path,
                                           Eigen::MatrixXd& positions) {
  play(pose, path, positions);
}
#endif

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
  Eigen::MatrixXd positions(3 * kStandardJointCount, pose.frame_count());
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  const auto play = has_avx2 ? play_by_fours : play_by_twos;
#else
  const auto play = play_by_twos;
#endif
  play(pose, path, positions);
  return positions;
}

}  // namespace laban::motion
