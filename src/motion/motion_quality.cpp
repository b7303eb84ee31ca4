#include "laban/motion/motion_quality.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>

#include <unsupported/Eigen/FFT>

#include "laban/math/statistics.h"
#include "laban/motion/forward_kinematics.h"

namespace laban::motion {
namespace {

using Eigen::Index;

constexpr double kSkateHeightM = 0.025;
constexpr double kSkateRateHz = 30.0;
constexpr double kFloorPercent = 2.0;
/// Frames on either side of a join that count to it.
constexpr Index kJoinReach = 2;

constexpr std::array<FootPoint, 2> kToes = {FootPoint::kLeftToe, FootPoint::kRightToe};

const Eigen::Matrix3Xd& path_of(const FootPaths& paths, FootPoint point) {
  return paths.points[static_cast<std::size_t>(index_of(point))];
}

/// Positions of the rig's standard joints, hips first: 3 K x F, metres.
Eigen::MatrixXd standard_positions(const Clip& clip, const Humanoid& humanoid) {
  std::vector<int> joints;
  for (int s = 0; s < kStandardJointCount; ++s) {
    if (const auto& mapped = humanoid.mapped(static_cast<StandardJoint>(s)))
      joints.push_back(mapped->joint);
  }
  Eigen::MatrixXd positions(3 * static_cast<Index>(joints.size()), clip.frame_count());
  for (int f = 0; f < clip.frame_count(); ++f) {
    const ModelPose pose = forward_kinematics(clip, f);
    for (std::size_t k = 0; k < joints.size(); ++k) {
      positions.block<3, 1>(3 * static_cast<Index>(k), f) = pose.positions.col(joints[k]);
    }
  }
  return positions;
}

/// Root mean square over joints of the length of their third differences, positions relative to the
/// hips, over frames.
double rms_jerk(const Eigen::MatrixXd& positions, double rate_hz) {
  const Index frames = positions.cols();
  const Index joints = positions.rows() / 3;
  if (frames < 4 || joints < 2) return 0.0;
  Eigen::MatrixXd relative = positions.bottomRows(positions.rows() - 3);
  relative -= positions.topRows<3>().replicate(joints - 1, 1);
  const Index count = frames - 3;
  const double squares = (relative.rightCols(count) - 3.0 * relative.middleCols(2, count) +
                          3.0 * relative.middleCols(1, count) - relative.leftCols(count))
                             .squaredNorm();
  return std::sqrt(squares / static_cast<double>(count * (joints - 1))) * std::pow(rate_hz, 3);
}

std::vector<double> accelerations(const Eigen::MatrixXd& positions, double rate_hz) {
  const Index frames = positions.cols();
  const double joints = static_cast<double>(positions.rows()) / 3.0;
  std::vector<double> all(static_cast<std::size_t>(frames), 0.0);
  for (Index f = 1; f + 1 < frames; ++f) {
    const double square =
        (positions.col(f + 1) - 2.0 * positions.col(f) + positions.col(f - 1)).squaredNorm();
    all[static_cast<std::size_t>(f)] = std::sqrt(square / joints) * rate_hz * rate_hz;
  }
  return all;
}

/// Magnitudes of the lowest `count` bins of the discrete Fourier transform of length `size`.
std::vector<double> spectrum(std::span<const double> values, std::size_t size, std::size_t count) {
  std::vector<double> padded(values.begin(), values.end());
  padded.resize(size, 0.0);
  std::vector<std::complex<double>> bins;
  Eigen::FFT<double> fft;
  fft.fwd(bins, padded);
  std::vector<double> magnitudes;
  for (std::size_t k = 0; k < std::min(count, bins.size()); ++k)
    magnitudes.push_back(std::abs(bins[k]));
  return magnitudes;
}

/// Mean over hands and feet of the spectral arc length of their speed relative to the hips.
double mean_arc_length(const Clip& clip, const Humanoid& humanoid) {
  using enum StandardJoint;
  const int hips = humanoid.mapped(kHips)->joint;
  const Eigen::Matrix3Xd all = joint_positions(clip);
  double sum = 0.0;
  int count = 0;
  for (const StandardJoint end : {kLeftHand, kRightHand, kLeftFoot, kRightFoot}) {
    const auto& mapped = humanoid.mapped(end);
    if (!mapped) continue;
    std::vector<double> speed;
    for (int f = 0; f + 1 < clip.frame_count(); ++f) {
      const auto at = [&](int frame) {
        const Index begin = static_cast<Index>(frame) * clip.joint_count();
        return Eigen::Vector3d(all.col(begin + mapped->joint) - all.col(begin + hips));
      };
      speed.push_back((at(f + 1) - at(f)).norm() * clip.frame_rate_hz());
    }
    sum += spectral_arc_length(speed, clip.frame_rate_hz());
    ++count;
  }
  return count == 0 ? 0.0 : sum / count;
}

/// Largest value within kJoinReach of `frame`.
double largest_around(const std::vector<double>& values, Index frame) {
  const auto count = static_cast<Index>(values.size());
  double largest = 0.0;
  for (Index f = std::max<Index>(frame - kJoinReach, 0);
       f <= std::min(frame + kJoinReach, count - 1); ++f) {
    largest = std::max(largest, values[static_cast<std::size_t>(f)]);
  }
  return largest;
}

}  // namespace

double foot_skate_cm(const FootPaths& paths, double toe_floor_m) {
  const Index frames = paths.frame_count();
  if (frames < 2) return 0.0;
  double sum = 0.0;
  for (const FootPoint toe : kToes) {
    const Eigen::Matrix3Xd& path = path_of(paths, toe);
    for (Index f = 1; f < frames; ++f) {
      const Eigen::Vector3d step = path.col(f) - path.col(f - 1);
      const double height = 0.5 * (path(1, f) + path(1, f - 1)) - toe_floor_m;
      sum += std::hypot(step.x(), step.z()) *
             std::clamp(2.0 - std::exp2(height / kSkateHeightM), 0.0, 1.0);
    }
  }
  const double mean_m = sum / static_cast<double>(2 * (frames - 1));
  return 100.0 * mean_m * paths.frame_rate_hz / kSkateRateHz;
}

double toe_height_percentile_m(const FootPaths& paths, double toe_floor_m, double percent) {
  std::vector<double> heights;
  for (const FootPoint toe : kToes) {
    const Eigen::Matrix3Xd& path = path_of(paths, toe);
    for (Index f = 0; f < path.cols(); ++f) heights.push_back(path(1, f) - toe_floor_m);
  }
  return math::percentile(heights, percent);
}

double spectral_arc_length(std::span<const double> speed, double rate_hz) {
  constexpr double kMostHz = 10.0;
  constexpr double kThreshold = 0.05;
  if (speed.size() < 2) return 0.0;
  const std::size_t size = 16 * std::bit_ceil(speed.size());
  const auto most = static_cast<std::size_t>(kMostHz * static_cast<double>(size) / rate_hz) + 1;
  std::vector<double> magnitudes = spectrum(speed, size, std::min(most, size / 2 + 1));
  const double largest = *std::max_element(magnitudes.begin(), magnitudes.end());
  if (!(largest > 1e-12)) return 0.0;
  for (double& magnitude : magnitudes) magnitude /= largest;
  // Speeds are never negative, so the spectrum is largest, 1, at 0.
  std::size_t last = magnitudes.size() - 1;
  while (last > 0 && magnitudes[last] < kThreshold) --last;
  double length = 0.0;
  for (std::size_t k = 0; k < last; ++k)
    length += std::hypot(1.0 / static_cast<double>(last), magnitudes[k + 1] - magnitudes[k]);
  return -length;
}

MotionQuality measure_quality(const Clip& clip, const Humanoid& humanoid, const FootFloor& floor) {
  const FootPaths paths = foot_paths(clip, humanoid);
  const Eigen::MatrixXd positions = standard_positions(clip, humanoid);
  return {foot_skate_cm(paths, floor.toe_m),
          toe_height_percentile_m(paths, floor.toe_m, kFloorPercent),
          rms_jerk(positions, clip.frame_rate_hz()), mean_arc_length(clip, humanoid),
          accelerations(positions, clip.frame_rate_hz())};
}

std::optional<double> join_acceleration_percentile(const MotionQuality& output,
                                                   std::span<const int> joins,
                                                   std::span<const MotionQuality> references) {
  std::vector<double> usual;
  for (const MotionQuality& reference : references) {
    const auto frames = static_cast<Index>(reference.acceleration_m_s2.size());
    for (Index f = kJoinReach + 1; f + kJoinReach + 1 < frames; ++f) {
      usual.push_back(largest_around(reference.acceleration_m_s2, f));
    }
  }
  if (joins.empty() || usual.empty()) return std::nullopt;
  double worst = 0.0;
  for (const int join : joins) {
    worst = std::max(worst, largest_around(output.acceleration_m_s2, join));
  }
  const auto below =
      std::count_if(usual.begin(), usual.end(), [&](double value) { return value <= worst; });
  return 100.0 * static_cast<double>(below) / static_cast<double>(usual.size());
}

}  // namespace laban::motion
