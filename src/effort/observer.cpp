#include "laban/effort/observer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "laban/base/error.h"
#include "laban/math/low_pass.h"
#include "laban/math/statistics.h"
#include "laban/motion/standard_body.h"

// What is measured, and why so. DESIGN 6 gives starting points after [LarbouletteGibet15]; where we
// leave them, the reason was measured on real captures (tests/studies/observer.cpp prints the
// figures). Three laws hold by construction, up to what sampling and smoothing take: played s times
// as fast, Time and Weight rise by log s and Flow stays; held still for a share h of its time, a
// movement gains about -log(1 - h) of Flow or more and keeps Weight and Time; made c times as
// large, it gains 2 log c of Weight (in angles it is not exactly so) and keeps the others.
//
// Notation
//   v_k, m_k   velocity of part k, its share of the tracked mass
//   g(t)       sqrt(sum_k m_k |v_k|^2)                  body speed
//   <s>        typical value of s: its M-location in logs, each moment counted by the path
//              that is covered in it. Moments at rest cover none, so a hold does not change it, and
//              a jump of the capture (a flipped knee, frames that leave a T-pose) pulls it by
//              little however fast it is; a mean of squares or a maximum sees hardly anything else.
//   x_k        position of part k relative to the pelvis' path over ground
//
// Time = mean over parts, weighted by <v_k>, of log (<v_k> / <|x_k - mean x_k|>): how fast for its
//   size, the rate at which reach is covered, 1/s. Acceleration over velocity, the usual choice,
//   needs a low cutoff against a millimetre of noise, and a fixed cutoff makes faster play of quick
//   movement seem slower. Here positions are smoothed at kHarmonics times the movement's own rate,
//   so that the smoothing plays faster with it.
// Weight = log (<g>^2) - Time: log of kinetic energy over rate, the action of a stroke: mass times
//   speed times reach. Energy alone repeats Time (rank correlation 0.6 to 0.7), as quick
//   performances are energetic; travel counts, it is kinetic energy too.
// Flow = -log of the share of time in motion. A moment is in motion as far as the least speed of
//   all windows that hold it is large beside the movement's typical speed: a window in which the
//   body stands is at rest to its last frame, however suddenly it stopped, where a filter would
//   smear the stop. Speeds are smoothed at one cutoff whatever the tempo (DESIGN 6): one that
//   follows a slow movement's rate, 2 to 4 Hz, spreads a hold of 0.2 s over the strokes beside it,
//   and what their typical speed loses then outweighs the rest that came in. To it is added the
//   unevenness of the parts, log of typical speed over the power mean of order 1/2: the share of
//   time alone changes by fits along blends, and what predicts labels of blends then misses (asked
//   against measured on Bandai 0.44 label units, with it 0.27).

namespace laban::effort {
namespace {

using motion::StandardJoint;

// Smoothing of velocities, as a multiple of the movement's own rate, and its limits: 2 Hz (slower
// movement has no noise that matters) and 15 Hz (what 30 frames a second hold).
constexpr double kHarmonics = 8.0;
constexpr double kLeastCutoffHz = 2.0;
constexpr double kMostCutoffHz = 15.0;
constexpr int kCutoffSteps = 3;  // towards a rate measured at its own cutoff

// Soft floors: what is slower or smaller counts as at rest.
constexpr double kSpeedFloor = 0.01;   // m/s
constexpr double kReachFloor = 0.01;   // m
constexpr double kUnevenFloor = 0.05;  // m/s
constexpr double kStillSpeed = 0.02;   // m/s: 1 mm of noise in a window of kStopHalfWindowS

constexpr double kLocationWidth = 0.5;  // of logs; beyond it deviations count by their sign only

// Flow: smoothing of speeds, half the window of a stop, the lever at which turning counts as
// moving, and the share of the typical speed that is half way between rest and motion.
constexpr double kFlowCutoffHz = 6.0;
constexpr double kStopHalfWindowS = 0.1;
constexpr double kTurnS = 0.05;
constexpr double kMotionShare = 0.6;
constexpr double kLeastMotion = 1e-3;  // share of time; the Flow of complete stillness is its log

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

/// Positions of the parts, from those of the standard joints: 3 K x F, metres.
Eigen::MatrixXd part_positions(const Eigen::MatrixXd& joints) {
  const auto joint = [&](StandardJoint which) {
    return joints.middleRows<3>(3 * motion::index_of(which));
  };
  Eigen::MatrixXd positions(3 * kPartCount, joints.cols());
  for (int k = 0; k < kPartCount; ++k) {
    const Part& part = kParts[static_cast<std::size_t>(k)];
    positions.middleRows<3>(3 * k) = 0.5 * (joint(part.from) + joint(part.to));
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

using Values = Eigen::ArrayXd;

/// Values side by side. Single precision: what it loses of a logarithm is a ten-millionth.
constexpr Eigen::Index kLanes = 8;
using Lane = Eigen::Array<float, kLanes, 1>;
using Lanes = Eigen::Array<float, kLanes, Eigen::Dynamic>;

/// The values, a column so many; the last column is filled up with `rest`.
Lanes lanes_of(const Values& values, float rest) {
  Lanes lanes(kLanes, (values.size() + kLanes - 1) / kLanes);
  lanes.reshaped().tail(lanes.size() - values.size()).setConstant(rest);
  lanes.reshaped().head(values.size()) = values.cast<float>();
  return lanes;
}

/// Sums of the M-location's equation below.
struct Pull {
  double force = 0.0;   ///< sum w u p, p = 1 / sqrt(1 + u^2)
  double weight = 0.0;  ///< sum w p
  double slope = 0.0;   ///< sum w p^3
};

Pull pull_at(const Lanes& values, const Lanes& weights, double location) {
  constexpr Eigen::Index kSummedColumns = 32;  // summed in single precision
  Pull all;
  for (Eigen::Index begin = 0; begin < values.cols(); begin += kSummedColumns) {
    Lane force = Lane::Zero(), weight = Lane::Zero(), slope = Lane::Zero();
    for (Eigen::Index n = begin; n < std::min(begin + kSummedColumns, values.cols()); ++n) {
      const Lane u =
          (values.col(n) - static_cast<float>(location)) / static_cast<float>(kLocationWidth);
      const Lane p = 1.0F / (1.0F + u.square()).sqrt();
      const Lane weighted = weights.col(n) * p;
      force += weighted * u;
      weight += weighted;
      slope += weighted * p.square();
    }
    all.force += force.sum();
    all.weight += weight.sum();
    all.slope += slope.sum();
  }
  return all;
}

/// exp of the weighted M-location m of logs l: sum w u / sqrt(1 + u^2) = 0 with u = (l - m) /
/// width. Newton's steps where they are short, else means reweighted by 1 / sqrt(1 + u^2), which
/// converge from anywhere as the loss is convex. @param values > 0.
double typical(const Values& values, const Values& weights) {
  const Lanes logs = lanes_of(values, 1.0F).log();
  const Lanes shares = lanes_of(weights, 0.0F);
  double location = (shares * logs).sum() / shares.sum();
  for (int step = 0; step < 50; ++step) {
    const Pull pull = pull_at(logs, shares, location);
    const double newton = pull.force / pull.slope;
    const bool is_near = std::abs(newton) < 0.5;
    const double move = kLocationWidth * (is_near ? newton : pull.force / pull.weight);
    location += move;
    // What is left after a step of Newton's is of the order of its square.
    if (std::abs(move) < (is_near ? 1e-4 : 1e-6)) break;
  }
  return std::exp(location);
}

/// The same, each moment counted by its own value.
double typical(const Values& speed) {
  return typical(speed, speed);
}

/// Time: of positions relative to the pelvis' path and their smoothed velocities, 3 K x F.
double quickness(const Eigen::Ref<const Eigen::MatrixXd>& positions,
                 const Eigen::Ref<const Eigen::MatrixXd>& velocities) {
  double sum = 0.0, weight = 0.0;
  for (int k = 0; k < kPartCount; ++k) {
    const auto x = positions.middleRows<3>(3 * k);
    const Values speed = (velocities.middleRows<3>(3 * k).colwise().squaredNorm().array() +
                          kSpeedFloor * kSpeedFloor)
                             .sqrt()
                             .transpose();
    const Eigen::Vector3d middle = x * speed.matrix() / speed.sum();
    const Values reach =
        ((x.colwise() - middle).colwise().squaredNorm().array() + kReachFloor * kReachFloor)
            .sqrt()
            .transpose();
    const double pace = typical(speed);
    sum += pace * std::log(pace / typical(reach, speed));
    weight += pace;
  }
  return sum / weight;
}

double cutoff_hz(double quickness) {
  return std::clamp(kHarmonics * std::exp(quickness) / (2.0 * std::numbers::pi), kLeastCutoffHz,
                    kMostCutoffHz);
}

/// Positions less the pelvis' path over ground.
Eigen::MatrixXd relative_to_root(Eigen::MatrixXd positions) {
  const Eigen::MatrixXd root = positions.topRows<3>();
  for (int k = 0; k < kPartCount; ++k) {
    positions.row(3 * k) -= root.row(0);
    positions.row(3 * k + 2) -= root.row(2);
  }
  return positions;
}

/// Body speed (all parts alike, root mean square) in a window about each frame: of the quadratics
/// that fit the parts' paths there best, the velocity v and acceleration a in |v|^2 + (kTurnS a)^2.
/// Where a swing turns, a body moves though its velocity passes through zero. Ends by odd
/// reflection.
Values windowed_speed(const Eigen::MatrixXd& positions, double rate_hz, Eigen::Index half) {
  const Eigen::Index frames = positions.cols();
  const auto at = [&](Eigen::Index f) -> Eigen::VectorXd {
    if (f < 0) return 2.0 * positions.col(0) - positions.col(std::min(-f, frames - 1));
    if (f < frames) return positions.col(f);
    const Eigen::Index inside = std::max<Eigen::Index>(2 * (frames - 1) - f, 0);
    return 2.0 * positions.col(frames - 1) - positions.col(inside);
  };
  Eigen::MatrixXd padded(positions.rows(), frames + 2 * half);
  for (Eigen::Index f = 0; f < padded.cols(); ++f) padded.col(f) = at(f - half);
  // Ends count half, as in the trapezoid rule, so that the window is as long at any rate.
  const auto reach = static_cast<double>(half);
  const Eigen::ArrayXd offset = Eigen::ArrayXd::LinSpaced(2 * half + 1, -reach, reach);
  Eigen::ArrayXd weight = Eigen::ArrayXd::Ones(2 * half + 1);
  weight[0] = weight[2 * half] = 0.5;
  const double mean_square = (weight * offset.square()).sum() / weight.sum();
  const Eigen::ArrayXd curve = offset.square() - mean_square;
  const Eigen::VectorXd linear = rate_hz * weight * offset / (weight * offset.square()).sum();
  const Eigen::VectorXd square =
      2.0 * rate_hz * rate_hz * weight * curve / (weight * curve.square()).sum();
  Values result(frames);
  for (Eigen::Index f = 0; f < frames; ++f) {
    const auto window = padded.middleCols(f, 2 * half + 1);
    const double energy =
        (window * linear).squaredNorm() + kTurnS * kTurnS * (window * square).squaredNorm();
    result[f] = std::sqrt(energy / kPartCount);
  }
  return result;
}

/// The least of the values within `half` frames of each.
Values eroded(const Values& values, Eigen::Index half) {
  Values result(values.size());
  for (Eigen::Index f = 0; f < values.size(); ++f) {
    const Eigen::Index begin = std::max<Eigen::Index>(f - half, 0);
    const Eigen::Index end = std::min(f + half + 1, values.size());
    result[f] = values.segment(begin, end - begin).minCoeff();
  }
  return result;
}

/// All that the descriptors of any range of frames are made of.
struct Kinematics {
  Eigen::MatrixXd positions;   ///< 3 K x F relative to the pelvis' path over ground, m
  Eigen::MatrixXd velocities;  ///< of these, smoothed, m/s
  Values body_speed;           ///< F, of the moving mass, travel included, m/s
  PartRows speed;              ///< K x F, of the parts for Flow, travel included, m/s
  Values pace;                 ///< F, root mean square of these, m/s
  Values least_speed;          ///< F, the least windowed_speed of the windows that hold the frame
};

void check(Eigen::Index frames, bool finite, double rate_hz) {
  if (frames < 1)
    throw base::Error(base::ErrorKind::kData, "observer: no frame (needs at least 1)");
  if (!finite) {
    throw base::Error(base::ErrorKind::kData,
                      "observer: the pose matrix has values that are not finite");
  }
  if (!(rate_hz > 0.0) || !std::isfinite(rate_hz)) {
    throw base::Error(
        base::ErrorKind::kUsage,
        "observer: frame rate of " + std::to_string(rate_hz) + " Hz (must be positive and finite)");
  }
}

/// Joint positions of a motion that can be measured.
Eigen::MatrixXd checked_positions(const motion::PoseMatrix& pose) {
  check(pose.frame_count(),
        pose.angles.allFinite() && pose.height.allFinite() && pose.steps.allFinite(),
        pose.frame_rate_hz);
  return motion::standard_joint_positions(pose);
}

Kinematics kinematics_of(const Eigen::MatrixXd& joints, double rate) {
  const Eigen::MatrixXd positions = part_positions(joints);
  const auto velocities_at = [&](const Eigen::MatrixXd& rows, double cutoff) {
    return derivative(math::low_pass(rows, rate, cutoff), rate);
  };
  Kinematics k;
  k.positions = relative_to_root(positions);
  double cutoff = kMostCutoffHz;
  k.velocities = velocities_at(k.positions, cutoff);
  for (int step = 0; step < kCutoffSteps; ++step) {
    cutoff = cutoff_hz(quickness(k.positions, k.velocities));
    k.velocities = velocities_at(k.positions, cutoff);
  }
  k.body_speed =
      ((mass_shares().transpose() * norms(velocities_at(positions, cutoff)).cwiseAbs2()).array() +
       kSpeedFloor * kSpeedFloor)
          .sqrt()
          .transpose();
  k.speed = norms(velocities_at(positions, kFlowCutoffHz));
  k.pace = (k.speed.colwise().squaredNorm().array() / kPartCount + kSpeedFloor * kSpeedFloor)
               .sqrt()
               .transpose();
  const auto half = std::max<Eigen::Index>(1, std::lround(kStopHalfWindowS * rate));
  k.least_speed = eroded(windowed_speed(positions, rate, half), half);
  return k;
}

/// Mean over the time that the frames cover. The first frame is the movement's first moment, the
/// last up to a frame's duration before its end: F frames cover those of F - 1/2 on average, so
/// each end counts three quarters. (Counted whole, both ends add rest to a short clip at a low
/// rate.)
double time_mean(const Values& values) {
  const Eigen::Index last = values.size() - 1;
  return (values.sum() - 0.25 * (values[0] + values[last])) / (static_cast<double>(last) + 0.5);
}

/// Flow: of the body's speed and the least of the windows'.
double hesitation(const Values& speed, const Values& least_speed) {
  const double pace = typical(speed);
  const double threshold = kMotionShare * kMotionShare * pace * pace + kStillSpeed * kStillSpeed;
  const double in_motion = 1.0 - time_mean((-least_speed.square() / threshold).exp());
  return -std::log(in_motion + kLeastMotion);
}

/// Flow: mean over parts of log (typical speed / power mean of order 1/2): go and stop against
/// going on. A hold lowers the power mean alone.
double unevenness(const Eigen::Ref<const PartRows>& speed) {
  double sum = 0.0;
  for (int k = 0; k < kPartCount; ++k) {
    const Values s = speed.row(k).transpose().array() + kUnevenFloor;
    sum +=
        std::log(typical(s, s - kUnevenFloor + kSpeedFloor)) - 2.0 * std::log(time_mean(s.sqrt()));
  }
  return sum / kPartCount;
}

/// Descriptors of the frames [begin, begin + count).
Descriptors describe_range(const Kinematics& k, Eigen::Index begin, Eigen::Index count) {
  Descriptors d;
  d.time = quickness(k.positions.middleCols(begin, count), k.velocities.middleCols(begin, count));
  d.weight = 2.0 * std::log(typical(k.body_speed.segment(begin, count))) - d.time;
  d.flow = hesitation(k.pace.segment(begin, count), k.least_speed.segment(begin, count)) +
           unevenness(k.speed.middleCols(begin, count));
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
  return describe(checked_positions(pose), pose.frame_rate_hz);
}

Descriptors describe(const Eigen::MatrixXd& joint_positions, double frame_rate_hz) {
  check(joint_positions.cols(), joint_positions.allFinite(), frame_rate_hz);
  const Kinematics k = kinematics_of(joint_positions, frame_rate_hz);
  return describe_range(k, 0, k.body_speed.size());
}

Eigen::Matrix3Xd describe_over_time(const motion::PoseMatrix& pose, double window_s) {
  if (!(window_s > 0.0) || !std::isfinite(window_s)) {
    throw base::Error(base::ErrorKind::kUsage, "observer: window of " + std::to_string(window_s) +
                                                   " s (must be positive and finite)");
  }
  const Kinematics k = kinematics_of(checked_positions(pose), pose.frame_rate_hz);
  const Eigen::Index frames = k.body_speed.size();
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
