#include "laban/motion/calm.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "laban/base/error.h"
#include "laban/math/low_pass.h"
#include "laban/motion/standard_body.h"

namespace laban::motion {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;

/// What is tried, one after the other, Hz. Movement at will hardly has anything above 6.
constexpr std::array kCutoffsHz = {14.0, 12.0, 10.0, 8.0, 7.0, 6.0, 5.5,
                                   5.0,  4.5,  4.0,  3.5, 3.0, 2.5, 2.0};
/// Reach of local jerk on either side of a frame, and that of the smoothing, seconds.
constexpr double kLocalS = 0.1;
constexpr double kFadeS = 0.15;

/// Frames [begin, end).
struct Range {
  Index begin = 0;
  Index end = 0;
};

/// The frames within `reach` of one that is wanted; ranges that meet are one.
std::vector<Range> around(const std::vector<bool>& wanted, Index reach) {
  const Index frames = std::ssize(wanted);
  std::vector<Range> ranges;
  for (Index f = 0; f < frames; ++f) {
    if (!wanted[static_cast<std::size_t>(f)]) continue;
    const Range own{std::max<Index>(f - reach, 0), std::min(f + reach + 1, frames)};
    if (ranges.empty() || ranges.back().end < own.begin) {
      ranges.push_back(own);
    } else {
      ranges.back().end = own.end;
    }
  }
  return ranges;
}

/// The pose matrix low-passed in some ranges, and as it is beside them. Only frames near enough to
/// count are looked at: three periods of the cutoff, after which the filter's answer is a
/// millionth.
PoseMatrix smoothed(const PoseMatrix& pose, double cutoff_hz, const std::vector<Range>& ranges) {
  const Index frames = pose.frame_count();
  const auto beside = static_cast<Index>(std::ceil(3.0 * pose.frame_rate_hz / cutoff_hz));
  PoseMatrix result = pose;
  for (const auto& [begin, end] : ranges) {
    const Index from = std::max<Index>(begin - beside, 0);
    const Index count = std::min(end + beside, frames) - from;
    MatrixXd rows(kAngleRowCount + 4, count);
    rows << pose.angles.middleCols(from, count), pose.height.segment(from, count),
        pose.steps.middleCols(from, count);
    const MatrixXd smooth =
        math::low_pass(rows, pose.frame_rate_hz, cutoff_hz).middleCols(begin - from, end - begin);
    result.angles.middleCols(begin, end - begin) = smooth.topRows<kAngleRowCount>();
    result.height.segment(begin, end - begin) = smooth.row(kAngleRowCount);
    result.steps.middleCols(begin, end - begin) = smooth.bottomRows<3>();
  }
  result.steps.col(0) = result.steps.col(std::min<Index>(1, frames - 1));
  return result;
}

PoseMatrix smoothed(const PoseMatrix& pose, double cutoff_hz) {
  return smoothed(pose, cutoff_hz, {{0, pose.frame_count()}});
}

/// Moves a towards b by a share a frame.
void move(PoseMatrix& a, const PoseMatrix& b, const RowVectorXd& share) {
  for (Index f = 0; f < share.size(); ++f) {
    if (share(f) == 0.0) continue;
    a.angles.col(f) += share(f) * (b.angles.col(f) - a.angles.col(f));
    a.height(f) += share(f) * (b.height(f) - a.height(f));
    a.steps.col(f) += share(f) * (b.steps.col(f) - a.steps.col(f));
  }
  a.steps.col(0) = a.steps.col(std::min<Index>(1, a.steps.cols() - 1));
}

/// Third differences of the rows, per second cubed; F - 3 columns.
MatrixXd third_derivative(const MatrixXd& rows, double rate_hz) {
  const Index count = rows.cols() - 3;
  return (rows.rightCols(count) - 3.0 * rows.middleCols(2, count) +
          3.0 * rows.middleCols(1, count) - rows.leftCols(count)) *
         std::pow(rate_hz, 3);
}

/// Largest, or mean, of the values within `reach` of each (the ends go on).
RowVectorXd largest_around(const RowVectorXd& values, Index reach) {
  RowVectorXd result(values.size());
  for (Index f = 0; f < values.size(); ++f) {
    const Index begin = std::max<Index>(f - reach, 0);
    result(f) =
        values.segment(begin, std::min(f + reach, values.size() - 1) - begin + 1).maxCoeff();
  }
  return result;
}
RowVectorXd mean_around(const RowVectorXd& values, Index reach) {
  RowVectorXd result(values.size());
  for (Index f = 0; f < values.size(); ++f) {
    double sum = 0.0;
    for (Index k = f - reach; k <= f + reach; ++k)
      sum += values(std::clamp<Index>(k, 0, values.size() - 1));
    result(f) = sum / static_cast<double>(2 * reach + 1);
  }
  return result;
}

Index frames_in(const PoseMatrix& pose, double seconds) {
  return std::max<Index>(1, std::lround(seconds * pose.frame_rate_hz));
}

/// Mean squares over joints of the jerk of at least four frames. A third difference lies between
/// frames 1 and 2 of its four: it counts to both, and the larger of two counts.
RowVectorXd squared_jerk(const MatrixXd& positions, double rate_hz) {
  const RowVectorXd each =
      third_derivative(positions, rate_hz).colwise().squaredNorm() / kStandardJointCount;
  RowVectorXd squares = RowVectorXd::Zero(positions.cols());
  squares.segment(1, each.size()) = each;
  squares.segment(2, each.size()) = squares.segment(2, each.size()).cwiseMax(each);
  return squares;
}

/// The same of frames [begin, end), as the motion plays along `path`.
RowVectorXd squared_jerk(const PoseMatrix& pose, const Eigen::Matrix3Xd& path, Index begin,
                         Index end) {
  const PoseMatrix part = pose.slice(static_cast<int>(begin), static_cast<int>(end));
  return squared_jerk(
      standard_joint_positions(part, {path(0, begin), path(1, begin), path(2, begin)}),
      pose.frame_rate_hz);
}

/// rms_jerk_m_s3 of a motion that takes the joints there.
double rms_jerk_beside_hips(MatrixXd positions, double rate_hz) {
  const MatrixXd hips = positions.topRows<3>();
  for (int joint = 0; joint < kStandardJointCount; ++joint)
    positions.middleRows<3>(3 * joint) -= hips;
  const MatrixXd jerk = third_derivative(positions, rate_hz);
  return std::sqrt(jerk.squaredNorm() /
                   static_cast<double>(jerk.cols() * (kStandardJointCount - 1)));
}

/// local_jerk_m_s3 of the frames that are `wanted`; what the others get means nothing. Only what
/// these frames need is played: most of the time is spent there.
RowVectorXd local_jerk_of(const PoseMatrix& pose, const std::vector<bool>& wanted) {
  RowVectorXd squares = RowVectorXd::Zero(pose.frame_count());
  if (pose.frame_count() < 4) return squares;
  const Eigen::Matrix3Xd path = planar_path(pose);
  const Index reach = frames_in(pose, kLocalS);
  for (const auto& [begin, end] : around(wanted, reach + 2))
    squares.segment(begin, end - begin) = squared_jerk(pose, path, begin, end);
  return mean_around(squares, reach).cwiseSqrt();
}

/// The frames that have a limit.
std::vector<bool> limited(const RowVectorXd& most_m_s3) {
  std::vector<bool> limits;
  for (const double most : most_m_s3) limits.push_back(!std::isinf(most));
  return limits;
}

PosedMotion posed(PoseMatrix pose) {
  MatrixXd positions = standard_joint_positions(pose);
  return {std::move(pose), std::move(positions)};
}

double rms_jerk_of(const PosedMotion& motion) {
  if (motion.pose.frame_count() < 4) return 0.0;
  return rms_jerk_beside_hips(motion.joint_positions, motion.pose.frame_rate_hz);
}

/// Of all frames.
RowVectorXd local_jerk_of(const PosedMotion& motion) {
  const PoseMatrix& pose = motion.pose;
  if (pose.frame_count() < 4) return RowVectorXd::Zero(pose.frame_count());
  return mean_around(squared_jerk(motion.joint_positions, pose.frame_rate_hz),
                     frames_in(pose, kLocalS))
      .cwiseSqrt();
}

PosedMotion calm(PosedMotion motion, double most_m_s3) {
  if (rms_jerk_of(motion) <= most_m_s3) return motion;
  // Jerk falls with the cutoff: the first that is low enough, by bisection.
  std::optional<PosedMotion> calmest;  // at `high`, once that was tried
  std::size_t low = 0;
  std::size_t high = kCutoffsHz.size() - 1;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    PosedMotion tried = posed(smoothed(motion.pose, kCutoffsHz[middle]));
    if (rms_jerk_of(tried) <= most_m_s3) {
      high = middle;
      calmest = std::move(tried);
    } else {
      low = middle + 1;
    }
  }
  return calmest ? std::move(*calmest) : posed(smoothed(motion.pose, kCutoffsHz[low]));
}

/// calm_locally of a motion whose local jerk, wherever it is limited, is `jerk`; nullopt: it stays
/// as it is.
std::optional<PoseMatrix> calmed_locally(const PoseMatrix& pose, const RowVectorXd& most_m_s3,
                                         RowVectorXd jerk) {
  std::vector<PoseMatrix> ladder;  // of levels 1, 2, ..
  RowVectorXd rung = RowVectorXd::Zero(pose.frame_count());
  std::vector<bool> too_jerky = limited(most_m_s3);  // what no level so far brought down
  // Smoothing fades in beside what is too jerky; jerk is told from there and a little farther.
  const Index fade = frames_in(pose, kFadeS);
  const Index half = std::max<Index>(1, fade / 2);
  const Index needed = fade + 2 * half + frames_in(pose, kLocalS) + 2;
  for (std::size_t level = 0; level <= kCutoffsHz.size(); ++level) {
    if (level > 0) {
      ladder.push_back(smoothed(pose, kCutoffsHz[level - 1], around(too_jerky, needed)));
      jerk = local_jerk_of(ladder.back(), too_jerky);
    }
    bool any = false;
    for (Index f = 0; f < rung.size(); ++f) {
      const auto cell = static_cast<std::size_t>(f);
      if (!too_jerky[cell]) continue;
      rung(f) = static_cast<double>(level);
      too_jerky[cell] = !(jerk(f) <= most_m_s3(f));
      any = any || too_jerky[cell];
    }
    if (!any) break;
  }
  if (rung.isZero(0.0)) return std::nullopt;
  rung = mean_around(mean_around(largest_around(rung, fade), half), half);
  PoseMatrix result = pose;
  for (std::size_t below = 0; below < ladder.size(); ++below) {
    const RowVectorXd share =
        (rung.array() - static_cast<double>(below)).cwiseMax(0.0).cwiseMin(1.0);
    move(result, ladder[below], share);
  }
  return result;
}

}  // namespace

double rms_jerk_m_s3(const PoseMatrix& pose) {
  return pose.frame_count() < 4 ? 0.0 : rms_jerk_of(posed(pose));
}

RowVectorXd local_jerk_m_s3(const PoseMatrix& pose) {
  return pose.frame_count() < 4 ? RowVectorXd::Zero(pose.frame_count())
                                : local_jerk_of(posed(pose));
}

Jerk jerk_of(const PoseMatrix& pose) {
  if (pose.frame_count() < 4) return {};
  const PosedMotion motion = posed(pose);
  return {rms_jerk_of(motion), local_jerk_of(motion).maxCoeff()};
}

PoseMatrix calm(const PoseMatrix& pose, double most_m_s3) {
  return calm(posed(pose), most_m_s3).pose;
}

PoseMatrix calm_locally(const PoseMatrix& pose, const RowVectorXd& most_m_s3) {
  if (most_m_s3.size() != pose.frame_count()) {
    throw base::Error(base::ErrorKind::kUsage,
                      "calm_locally: " + std::to_string(most_m_s3.size()) + " limits for " +
                          std::to_string(pose.frame_count()) + " frames (must be one a frame)");
  }
  return calmed_locally(pose, most_m_s3, local_jerk_of(pose, limited(most_m_s3))).value_or(pose);
}

PosedMotion calm(PoseMatrix pose, const Jerk& most) {
  PosedMotion motion = calm(posed(std::move(pose)), most.usual_m_s3);
  const RowVectorXd limits = RowVectorXd::Constant(motion.pose.frame_count(), most.largest_m_s3);
  auto calmed = calmed_locally(motion.pose, limits, local_jerk_of(motion));
  return calmed ? posed(std::move(*calmed)) : std::move(motion);
}

}  // namespace laban::motion
