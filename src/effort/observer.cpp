#include "laban/effort/observer.h"

#include <array>
#include <cmath>
#include <map>

#include "laban/base/error.h"
#include "laban/math/low_pass.h"
#include "laban/math/statistics.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"

// What is measured, and why so. DESIGN 6 gives starting points after [LarbouletteGibet15]; where we
// leave them, the reason was measured on real captures (tests/studies/observer.cpp prints the
// figures): labels of blends have to follow from those of their parents, factors must not repeat
// each other, and neither the frame rate nor a millimetre of noise may matter.
//
// Notation
//   v_k, a_k   velocity, acceleration of part k         speed, acceleration (norms)
//   m_k        share of part k in the tracked mass      mass
//   E(t)       sum_k m_k |v_k|^2                        energy, m^2/s^2
//   q_k        |v_k| over its root mean square          q
//
// Weight = log of the power mean of E of order 2, a soft maximum: the maximum itself jumps from one
//   peak to another along a blend. Velocities are global: travel is kinetic energy too. Relative to
//   the root, Weight and Time say the same thing more often.
// Time = mean over parts of log (mean |a_k| / mean |v_k|), every part alike, from positions
// smoothed
//   at 4 Hz: at 6 Hz, 1 mm of noise at 30 Hz reorders captures. Soft floors give a part that rests
//   a middling value instead of the quickness of its noise.
// Flow = hesitation against fluency, the sum of three parts, each divided by its usual spread:
//   - unevenness: mean over parts of log (power mean of |v_k| of order 2 / of order 1/2): go and
//     stop against going on;
//   - stillness: share of time near rest, by a soft threshold at half the movement's own speed;
//   - simultaneity (at half weight): log (mean (mean_k q_k)^2 / mean q_k^2): parts that start and
//     stop as one against movement that flows from part to part; relative to the root.
//   Left out: irregularity log (rms jerk rms velocity / rms acceleration^2), which is minus Time
//   again, since smoothed jerk over acceleration hardly varies; and spectral arc length, whose
//   value for a blend hardly follows from its parents' (it counts peaks above a threshold).

namespace laban::effort {
namespace {

using motion::StandardJoint;

constexpr double kSpeedCutoffHz = 6.0;  // DESIGN 6
constexpr double kQuicknessCutoffHz = 4.0;

// Soft floors: what is slower counts as at rest.
constexpr double kEnergyFloor = 1e-4;       // m^2/s^2: all parts at 1 cm/s
constexpr double kSpeedFloor = 0.05;        // m/s
constexpr double kAccelerationFloor = 0.4;  // m/s^2; over kSpeedFloor 8 per s, a middling quickness
constexpr double kStillFloor = 0.03;        // m/s
constexpr double kUnisonFloor = 0.01;       // of q^2

// Usual spread (robust deviation inside content groups) of the three parts of Flow.
constexpr double kUnevennessSpread = 0.05;
constexpr double kStillnessSpread = 0.03;
constexpr double kUnisonSpread = 0.05;

/// A tracked part: the middle between two joints and its mass in per cent of the body's.
struct Part {
  StandardJoint from;
  StandardJoint to;
  double mass;
};

// Masses of segments: de Leva 1996, table 4, men; the pelvis is his lower trunk.
constexpr std::array<Part, 8> kParts = {{
    {StandardJoint::kHips, StandardJoint::kHips, 11.17},
    {StandardJoint::kHead, StandardJoint::kHead, 6.94},
    {StandardJoint::kLeftForearm, StandardJoint::kLeftHand, 1.62},
    {StandardJoint::kRightForearm, StandardJoint::kRightHand, 1.62},
    {StandardJoint::kLeftHand, StandardJoint::kLeftHand, 0.61},
    {StandardJoint::kRightHand, StandardJoint::kRightHand, 0.61},
    {StandardJoint::kLeftFoot, StandardJoint::kLeftFoot, 1.37},
    {StandardJoint::kRightFoot, StandardJoint::kRightFoot, 1.37},
}};
constexpr int kPartCount = static_cast<int>(kParts.size());

using PartVector = Eigen::Matrix<double, kPartCount, 1>;
using PartRows = Eigen::Matrix<double, kPartCount, Eigen::Dynamic>;

PartVector mass_shares() {
  PartVector shares;
  for (int k = 0; k < kPartCount; ++k) shares[k] = kParts[static_cast<std::size_t>(k)].mass;
  return shares / shares.sum();
}

/// Positions of the parts on the standard body: 3 K x F, metres.
Eigen::MatrixXd part_positions(const motion::PoseMatrix& pose) {
  const Eigen::Matrix3Xd joints = motion::joint_positions(motion::to_standard_clip(pose));
  Eigen::MatrixXd positions(3 * kPartCount, pose.frame_count());
  for (int f = 0; f < pose.frame_count(); ++f) {
    const auto joint = [&](StandardJoint which) {
      return joints.col(f * motion::kStandardJointCount + motion::index_of(which));
    };
    for (int k = 0; k < kPartCount; ++k) {
      const Part& part = kParts[static_cast<std::size_t>(k)];
      positions.block<3, 1>(3 * k, f) = 0.5 * (joint(part.from) + joint(part.to));
    }
  }
  return positions;
}

/// Time derivative of every row by the five-point difference; beyond the ends rows go on by odd
/// reflection. (Three points lose a tenth of what moves at 4 Hz if the rate is 30 Hz, so that the
/// rate would show.)
Eigen::MatrixXd derivative(const Eigen::MatrixXd& rows, double rate_hz) {
  const Eigen::Index frames = rows.cols();
  Eigen::MatrixXd x(rows.rows(), frames + 4);
  x.middleCols(2, frames) = rows;
  for (Eigen::Index k = 1; k <= 2; ++k) {
    const Eigen::Index inside = std::min(k, frames - 1);
    x.col(2 - k) = 2.0 * rows.col(0) - rows.col(inside);
    x.col(frames + 1 + k) = 2.0 * rows.col(frames - 1) - rows.col(frames - 1 - inside);
  }
  return (8.0 * (x.middleCols(3, frames) - x.middleCols(1, frames)) -
          (x.middleCols(4, frames) - x.leftCols(frames))) *
         (rate_hz / 12.0);
}

/// Lengths of the parts' vectors: K x F of 3 K x F.
PartRows norms(const Eigen::MatrixXd& rows) {
  PartRows result(kPartCount, rows.cols());
  for (int k = 0; k < kPartCount; ++k) result.row(k) = rows.middleRows<3>(3 * k).colwise().norm();
  return result;
}

/// All that the descriptors of any range of frames are made of.
struct Kinematics {
  Eigen::RowVectorXd energy;  ///< F, m^2/s^2
  PartRows speed;             ///< K x F, m/s
  PartRows root_speed;        ///< the same relative to the pelvis' path over ground
  PartRows slow_speed;        ///< K x F, m/s, and
  PartRows acceleration;  ///< K x F, m/s^2, both of positions smoothed for Time; floors included
};

Kinematics kinematics_of(const motion::PoseMatrix& pose) {
  if (pose.frame_count() < 1) {
    throw base::Error(base::ErrorKind::kData, "observer: no frame (needs at least 1)");
  }
  if (!pose.angles.allFinite() || !pose.height.allFinite() || !pose.steps.allFinite()) {
    throw base::Error(base::ErrorKind::kData,
                      "observer: the pose matrix has values that are not finite");
  }
  const double rate = pose.frame_rate_hz;
  if (!(rate > 0.0) || !std::isfinite(rate)) {
    throw base::Error(base::ErrorKind::kUsage, "observer: frame rate of " + std::to_string(rate) +
                                                   " Hz (must be positive and finite)");
  }
  const Eigen::MatrixXd positions = part_positions(pose);
  Kinematics k;
  const Eigen::MatrixXd velocity =
      derivative(math::low_pass(positions, rate, kSpeedCutoffHz), rate);
  k.speed = norms(velocity);
  k.energy = mass_shares().transpose() * k.speed.cwiseAbs2();
  Eigen::MatrixXd relative = velocity;
  for (int part = 0; part < kPartCount; ++part) {
    relative.row(3 * part) -= velocity.row(0);
    relative.row(3 * part + 2) -= velocity.row(2);
  }
  k.root_speed = norms(relative);
  const Eigen::MatrixXd slow =
      derivative(math::low_pass(positions, rate, kQuicknessCutoffHz), rate);
  k.slow_speed = (norms(slow).array().square() + kSpeedFloor * kSpeedFloor).sqrt();
  k.acceleration =
      (norms(derivative(slow, rate)).array().square() + kAccelerationFloor * kAccelerationFloor)
          .sqrt();
  return k;
}

double unevenness(const PartRows& speed) {
  const Eigen::ArrayXXd s = speed.array() + kSpeedFloor;
  const Eigen::ArrayXd high = s.square().rowwise().mean().sqrt();
  const Eigen::ArrayXd low = s.sqrt().rowwise().mean().square();
  return (high / low).log().mean();
}

double stillness(const Eigen::RowVectorXd& energy) {
  const double threshold = 0.5 * std::sqrt(energy.mean()) + kStillFloor;
  return (-energy.array() / (threshold * threshold)).exp().mean();
}

double simultaneity(const PartRows& root_speed) {
  const Eigen::ArrayXd rms = root_speed.array().square().rowwise().mean().sqrt() + kSpeedFloor;
  const Eigen::ArrayXXd q = root_speed.array().colwise() / rms;
  const double together = q.colwise().mean().square().mean();
  return std::log((together + kUnisonFloor) / (q.square().mean() + kUnisonFloor));
}

/// Descriptors of the frames [begin, begin + count).
Descriptors describe_range(const Kinematics& k, Eigen::Index begin, Eigen::Index count) {
  const Eigen::RowVectorXd energy = k.energy.middleCols(begin, count);
  Descriptors d;
  d.weight = std::log(std::sqrt(energy.array().square().mean()) + kEnergyFloor);
  const Eigen::ArrayXd quickness =
      k.acceleration.middleCols(begin, count).rowwise().mean().array() /
      k.slow_speed.middleCols(begin, count).rowwise().mean().array();
  d.time = quickness.log().mean();
  d.flow = unevenness(k.speed.middleCols(begin, count)) / kUnevennessSpread +
           stillness(energy) / kStillnessSpread +
           0.5 * simultaneity(k.root_speed.middleCols(begin, count)) / kUnisonSpread;
  return d;
}

double value_of(const Descriptors& d, Factor factor) {
  return factor == Factor::kFlow ? d.flow : factor == Factor::kWeight ? d.weight : d.time;
}

/// Column of the reference for a group: its own, or the last, which is pooled.
int column_of(const ObserverReference& reference, std::optional<int> group) {
  return group.value_or(static_cast<int>(reference.center.cols()) - 1);
}

Eigen::Vector3d standardized(const Eigen::Vector3d& descriptors, const ObserverReference& reference,
                             int column) {
  return kEffortPerDeviation *
         (descriptors - reference.center.col(column)).cwiseQuotient(reference.scale.col(column));
}

/// Descriptors of equal scale never are: a spread below this (of logs, or of Flow's usual spreads)
/// says that there is nothing to compare with.
constexpr double kLeastScale = 0.05;

/// Centre and scale of one factor in all groups and pooled, written to a row of the reference.
void fit_factor(const std::vector<std::vector<double>>& by_group, const std::vector<double>& all,
                int row, ObserverReference& reference) {
  std::vector<double> deviations;
  for (std::size_t g = 0; g < by_group.size(); ++g) {
    const double center = math::median(by_group[g]);
    reference.center(row, static_cast<Eigen::Index>(g)) = center;
    for (const double value : by_group[g]) deviations.push_back(value - center);
  }
  const double within = deviations.empty() ? 0.0 : math::robust_deviation(deviations);
  for (std::size_t g = 0; g < by_group.size(); ++g) {
    const double own = math::robust_deviation(by_group[g]);
    const auto count = static_cast<double>(by_group[g].size());
    const double borrowed = std::max(0.25, 4.0 / (count + 3.0));
    const double scale = std::sqrt((1.0 - borrowed) * own * own + borrowed * within * within);
    reference.scale(row, static_cast<Eigen::Index>(g)) = std::max(scale, kLeastScale);
  }
  const Eigen::Index pooled = reference.center.cols() - 1;
  reference.center(row, pooled) = math::median(all);
  reference.scale(row, pooled) = std::max(math::robust_deviation(all), kLeastScale);
}

}  // namespace

Descriptors describe(const motion::PoseMatrix& pose) {
  const Kinematics k = kinematics_of(pose);
  return describe_range(k, 0, k.energy.cols());
}

Eigen::Matrix3Xd describe_over_time(const motion::PoseMatrix& pose, double window_s) {
  if (!(window_s > 0.0) || !std::isfinite(window_s)) {
    throw base::Error(base::ErrorKind::kUsage, "observer: window of " + std::to_string(window_s) +
                                                   " s (must be positive and finite)");
  }
  const Kinematics k = kinematics_of(pose);
  const Eigen::Index frames = k.energy.cols();
  // As a double first: a long window would overflow the index.
  const double half_frames = std::round(0.5 * window_s * pose.frame_rate_hz);
  const auto half = static_cast<Eigen::Index>(
      std::clamp(half_frames, 2.0, std::max(2.0, static_cast<double>(frames))));
  Eigen::Matrix3Xd rows(3, frames);
  for (Eigen::Index f = 0; f < frames; ++f) {
    const Eigen::Index begin = std::max<Eigen::Index>(f - half, 0);
    const Eigen::Index end = std::min(f + half + 1, frames);
    const Descriptors d = describe_range(k, begin, end - begin);
    rows.col(f) << d.flow, d.weight, d.time;
  }
  return rows;
}

std::optional<int> ObserverReference::find(std::string_view group) const {
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (groups[g] == group) return static_cast<int>(g);
  }
  return std::nullopt;
}

ObserverReference fit_observer_reference(std::span<const Descriptors> descriptors,
                                         std::span<const std::string> groups) {
  if (descriptors.empty() || descriptors.size() != groups.size()) {
    throw base::Error(base::ErrorKind::kData,
                      "observer reference: " + std::to_string(descriptors.size()) +
                          " fragments and " + std::to_string(groups.size()) +
                          " groups (must be as many, and at least one)");
  }
  std::map<std::string, std::vector<std::size_t>> members;
  for (std::size_t n = 0; n < groups.size(); ++n) {
    if (!groups[n].empty()) members[groups[n]].push_back(n);
  }
  ObserverReference reference;
  for (const auto& member : members) reference.groups.push_back(member.first);
  const auto columns = static_cast<Eigen::Index>(members.size()) + 1;
  reference.center.resize(3, columns);
  reference.scale.resize(3, columns);
  for (const Factor factor : kFactors) {
    std::vector<std::vector<double>> by_group;
    for (const auto& member : members) {
      std::vector<double>& values = by_group.emplace_back();
      for (const std::size_t n : member.second) values.push_back(value_of(descriptors[n], factor));
    }
    std::vector<double> all;
    for (const Descriptors& d : descriptors) all.push_back(value_of(d, factor));
    fit_factor(by_group, all, index_of(factor), reference);
  }
  return reference;
}

Observation observe(const Descriptors& descriptors, const ObserverReference& reference,
                    std::string_view group) {
  const std::optional<int> column = reference.find(group);
  const Eigen::Vector3d values =
      standardized({descriptors.flow, descriptors.weight, descriptors.time}, reference,
                   column_of(reference, column));
  Observation result;
  result.unclipped = to_effort(values);
  result.effort = to_effort(values.cwiseMax(kEffortMin).cwiseMin(kEffortMax));
  result.pooled = !column.has_value();
  return result;
}

Eigen::Matrix3Xd observe_over_time(const motion::PoseMatrix& pose,
                                   const ObserverReference& reference, std::string_view group,
                                   double window_s) {
  Eigen::Matrix3Xd rows = describe_over_time(pose, window_s);
  const int column = column_of(reference, reference.find(group));
  for (Eigen::Index f = 0; f < rows.cols(); ++f) {
    rows.col(f) =
        standardized(rows.col(f), reference, column).cwiseMax(kEffortMin).cwiseMin(kEffortMax);
  }
  return rows;
}

}  // namespace laban::effort
