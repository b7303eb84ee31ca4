#include "laban/motion/join.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/calm.h"

namespace laban::motion {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::Vector3d;

/// How much farther than the parts themselves a join may bend before it is smoothed: a smooth
/// motion's second difference at the cut exceeds the largest on either side by a per cent or so.
constexpr double kTolerance = 1.25;
/// How far from the join the parts' own bends count, in half-lives.
constexpr double kReachHalflives = 2.5;
/// Reach of JoinOptions::most_jerk_share on either side of a join, seconds.
constexpr double kCalmReachS = 0.5;
/// y t after which an offset has died away: (1 + 30) e^-30 of it is left.
constexpr double kDiedAway = 30.0;

/// (1 + x) e^-x = 1/2: half-life of the spring below times its rate.
constexpr double kHalfway = 1.6783469900166605;
/// A critically damped spring about 0, sampled a frame apart:
/// x(t) = (x0 + (v0 + y x0) t) e^(-y t).
class Spring {
 public:
  /// @param halflife_frames  after which x is half of x0 if it begins at rest.
  explicit Spring(double halflife_frames) : y_(kHalfway / halflife_frames) {}

  /// Weights of x(0) and x(1) in x(t): the spring through two given samples.
  struct Weights {
    double first;
    double second;
  };
  [[nodiscard]] Weights through_samples(double t) const {
    // x(1) e^y = x0 + slope with slope = v0 + y x0, so x(t) = (x0 + (x(1) e^y - x0) t) e^-yt.
    const double decay = std::exp(-y_ * t);
    return {(1.0 - t) * decay, t * std::exp(y_) * decay};
  }
  /// Weight of x(0) in x(t) for a start at rest.
  [[nodiscard]] double from_rest(double t) const { return (1.0 + y_ * t) * std::exp(-y_ * t); }
  /// Frames that it reaches over, at least the two samples.
  [[nodiscard]] Index reach() const { return 2 + static_cast<Index>(std::ceil(kDiedAway / y_)); }

 private:
  double y_;  // per frame
};

/// `value`, shortened to `limit` if it is longer.
Vector3d limited(const Vector3d& value, double limit) {
  const double length = value.norm();
  return length <= limit ? value : Vector3d(value * (limit / length));
}

/// Largest length of the second differences of D rows (D = 1 or 3) over frames [begin, end).
double largest_bend(const Eigen::Ref<const Eigen::MatrixXd>& rows, Index begin, Index end) {
  double largest = 0.0;
  for (Index f = std::max<Index>(begin, 0) + 1; f + 1 < std::min(end, rows.cols()); ++f) {
    largest = std::max(largest, (rows.col(f + 1) - 2.0 * rows.col(f) + rows.col(f - 1)).norm());
  }
  return largest;
}

/// Largest length of the first differences of D rows over frames [begin, end).
double largest_change(const Eigen::Ref<const Eigen::MatrixXd>& rows, Index begin, Index end) {
  double largest = 0.0;
  for (Index f = std::max<Index>(begin, 0) + 1; f < std::min(end, rows.cols()); ++f) {
    largest = std::max(largest, (rows.col(f) - rows.col(f - 1)).norm());
  }
  return largest;
}

/// One join: the part before (as it came), the new one, and where in the output it begins.
struct Seam {
  const PoseMatrix& before;
  const PoseMatrix& after;
  Index begin;    // frame of `out` that shows frame 0 of `after`
  Index reach;    // frames on either side whose own bends count
  Spring spring;  // by which offsets die away
};

/// Offsets of a new part's first two frames that make the join bend no more than `limit`.
struct Offsets {
  Vector3d first;
  Vector3d second;
};

/// @param last, before_last  the output's two last frames.
/// @param next, after_next   the part's two first frames as they are.
Offsets offsets_at(const Vector3d& before_last, const Vector3d& last, const Vector3d& next,
                   const Vector3d& after_next, double limit) {
  const Vector3d bend = next - 2.0 * last + before_last;
  const Vector3d first = limited(bend, limit) - bend;
  const Vector3d bend_after = after_next - 2.0 * (next + first) + last;
  return {first, limited(bend_after, limit) - bend_after};
}

/// The two frames before and after a seam; where a side has one frame only, it moves as the other
/// side does, and stands if neither can tell.
struct Neighbours {
  Vector3d before_last, last, next, after_next;
};

Neighbours neighbours_of(const Eigen::Ref<const Eigen::MatrixXd>& out,
                         const Eigen::Ref<const Eigen::MatrixXd>& part, Index begin) {
  const auto three = [](const auto& column) {
    Vector3d value = Vector3d::Zero();
    value.head(column.size()) = column;
    return value;
  };
  Neighbours n;
  n.last = three(out.col(begin - 1));
  n.next = three(part.col(0));
  const bool out_moves = begin >= 2;
  const bool part_moves = part.cols() >= 2;
  const Vector3d out_step =
      out_moves ? Vector3d(n.last - three(out.col(begin - 2))) : Vector3d(Vector3d::Zero());
  const Vector3d part_step =
      part_moves ? Vector3d(three(part.col(1)) - n.next) : Vector3d(Vector3d::Zero());
  n.before_last = n.last - (out_moves ? out_step : part_step);
  n.after_next = n.next + (part_moves ? part_step : out_step);
  return n;
}

double bend_limit(const Seam& seam, const Eigen::Ref<const Eigen::MatrixXd>& before,
                  const Eigen::Ref<const Eigen::MatrixXd>& after) {
  return kTolerance * std::max(largest_bend(before, before.cols() - seam.reach, before.cols()),
                               largest_bend(after, 0, seam.reach));
}

/// The frames on one side of a seam that its offsets reach, from the one next to it on outwards.
struct Side {
  Index nearest;    ///< frame of the output
  Index direction;  ///< 1 behind the seam, -1 before it
  Index count;
  [[nodiscard]] Index frame(Index k) const { return nearest + direction * k; }
};

/// An offset before the seam reaches over short parts.
Side side_before(const Seam& seam) {
  return {seam.begin - 1, -1, std::min(seam.begin, seam.spring.reach())};
}
Side side_behind(const Seam& seam) {
  return {seam.begin, 1, std::min<Index>(seam.after.frame_count(), seam.spring.reach())};
}

/// Offsets of both sides that together make the join bend no more than `limit`: half of what the
/// new part alone would need, and half of what the part before would.
struct SharedOffsets {
  Offsets before;
  Offsets behind;
};

SharedOffsets shared_offsets(const Neighbours& n, double limit) {
  const auto half = [](const Offsets& all) { return Offsets{0.5 * all.first, 0.5 * all.second}; };
  return {half(offsets_at(n.after_next, n.next, n.last, n.before_last, limit)),
          half(offsets_at(n.before_last, n.last, n.next, n.after_next, limit))};
}

/// Turns the frames of one side by an offset that dies away from the seam.
/// @param nearest, second  the two frames next to the seam as they are.
void turn_side(const Side& side, const Vector3d& nearest, const Vector3d& second,
               const Offsets& offsets, const Spring& spring, Eigen::Ref<Eigen::MatrixXd> rows) {
  // As rotations the offsets are free of branches: a jump never decays the long way round.
  const auto turn = [](const Vector3d& from, const Vector3d& by) {
    if (by.isZero(0.0)) return Vector3d(Vector3d::Zero());
    return math::log(math::exp(from + by) * math::exp(from).conjugate());
  };
  const Vector3d turn_nearest = turn(nearest, offsets.first);
  // Of one way round: near half a turn the second might point against the first.
  const Vector3d turn_second = math::nearest_branch(turn(second, offsets.second), turn_nearest);
  if (turn_nearest.isZero(0.0) && turn_second.isZero(0.0)) return;
  for (Index k = 0; k < side.count; ++k) {
    const auto [a, b] = spring.through_samples(static_cast<double>(k));
    const Vector3d offset = a * turn_nearest + b * turn_second;
    const Vector3d own = rows.col(side.frame(k));
    rows.col(side.frame(k)) =
        math::nearest_branch(math::log(math::exp(offset) * math::exp(own)), own);
  }
}

/// Puts frames [begin, end) on the branch of the exponential map nearest to the frame before each.
void continue_branches(Index begin, Index end, Eigen::Ref<Eigen::MatrixXd> rows) {
  for (Index f = std::max<Index>(begin, 1); f < end; ++f) {
    const Vector3d r = rows.col(f);
    rows.col(f) = math::nearest_branch(r, rows.col(f - 1));
  }
}

/// Joint rows `row` .. `row` + 2.
void join_rotation(const Seam& seam, Index row, PoseMatrix& out) {
  const auto part = seam.after.angles.middleRows<3>(row);
  auto result = out.angles.middleRows<3>(row);
  const Index count = part.cols();
  Neighbours n = neighbours_of(result, part, seam.begin);
  const Vector3d step = n.after_next - n.next;
  n.next = math::nearest_branch(n.next, n.last);
  n.after_next = count >= 2 ? math::nearest_branch(part.col(1), n.next) : Vector3d(n.next + step);
  const double limit =
      bend_limit(seam, seam.before.angles.middleRows<3>(row), seam.after.angles.middleRows<3>(row));
  const SharedOffsets offsets = shared_offsets(n, limit);
  result.middleCols(seam.begin, count) = part;
  const Side before = side_before(seam);
  turn_side(before, n.last, n.before_last, offsets.before, seam.spring, result);
  turn_side(side_behind(seam), n.next, n.after_next, offsets.behind, seam.spring, result);
  continue_branches(seam.begin - before.count, seam.begin + count, result);
}

void raise_side(const Side& side, const Offsets& offsets, const Spring& spring,
                Eigen::RowVectorXd& height) {
  for (Index k = 0; k < side.count; ++k) {
    const auto [a, b] = spring.through_samples(static_cast<double>(k));
    height(side.frame(k)) += a * offsets.first.x() + b * offsets.second.x();
  }
}

void join_height(const Seam& seam, PoseMatrix& out) {
  const Neighbours n = neighbours_of(out.height, seam.after.height, seam.begin);
  const double limit = bend_limit(seam, seam.before.height, seam.after.height);
  const SharedOffsets offsets = shared_offsets(n, limit);
  out.height.segment(seam.begin, seam.after.height.size()) = seam.after.height;
  raise_side(side_before(seam), offsets.before, seam.spring, out.height);
  raise_side(side_behind(seam), offsets.behind, seam.spring, out.height);
}

/// Steps [row, row + rows) of the new part: they are velocities, so one derivative less counts.
void join_steps(const Seam& seam, Index row, Index rows, PoseMatrix& out) {
  // Column 0 of a part's steps is no step of its own.
  const auto own = [&](const PoseMatrix& part) {
    return part.steps.block(row, 1, rows, part.steps.cols() - 1);
  };
  const auto steps_before = own(seam.before);
  const auto after = own(seam.after);
  auto result = out.steps.middleRows(row, rows);
  const bool out_moves = seam.begin >= 2;
  if (after.cols() == 0) {  // one frame: goes on as before
    result.col(seam.begin).setZero();
    if (out_moves) result.col(seam.begin) = result.col(seam.begin - 1);
    return;
  }
  result.middleCols(seam.begin + 1, after.cols()) = after;
  if (!out_moves) {
    result.col(seam.begin) = after.col(0);
    return;
  }
  Vector3d half_jump = Vector3d::Zero();  // half before the step over the join, half after it
  half_jump.head(rows) = 0.5 * (after.col(0) - result.col(seam.begin - 1));
  const double limit =
      kTolerance *
      std::max(largest_change(steps_before, steps_before.cols() - seam.reach, steps_before.cols()),
               largest_change(after, 0, seam.reach));
  const Vector3d allowed = limited(half_jump, limit);
  const Eigen::VectorXd offset = (half_jump - allowed).head(rows);  // of either side
  const auto left = [&](Index k) { return seam.spring.from_rest(static_cast<double>(k)) * offset; };
  const Side before = side_before(seam);
  for (Index k = 0; k < before.count; ++k) result.col(before.frame(k)) += left(k);
  for (Index k = 0; k < std::min(after.cols(), seam.spring.reach()); ++k)
    result.col(seam.begin + 1 + k) -= left(k);
  result.col(seam.begin) = 0.5 * (result.col(seam.begin - 1) + result.col(seam.begin + 1));
}

void require_fitting(std::span<const PoseMatrix> parts) {
  if (parts.empty()) throw Error(ErrorKind::kUsage, "concatenate: no part (must be at least one)");
  for (std::size_t n = 0; n < parts.size(); ++n) {
    const PoseMatrix& part = parts[n];
    const std::string name = "concatenate: part " + std::to_string(n);
    if (part.frame_count() < 1 || part.angles.rows() != kAngleRowCount ||
        part.height.size() != part.angles.cols() || part.steps.cols() != part.angles.cols()) {
      throw Error(ErrorKind::kData, name + " has " + std::to_string(part.angles.rows()) + " x " +
                                        std::to_string(part.angles.cols()) + " angles, " +
                                        std::to_string(part.height.size()) + " heights and " +
                                        std::to_string(part.steps.cols()) +
                                        " steps (must be 63 rows and as many of each, at least 1)");
    }
    if (part.frame_rate_hz != parts[0].frame_rate_hz) {
      throw Error(ErrorKind::kData,
                  name + " has " + std::to_string(part.frame_rate_hz) + " Hz, part 0 has " +
                      std::to_string(parts[0].frame_rate_hz) + " Hz (resample one first)");
    }
  }
}

/// Holds the jerk around joins to a share of the parts' own largest.
PoseMatrix calmed_at_joins(const PoseMatrix& joined, std::span<const PoseMatrix> parts,
                           double share) {
  const Index reach = std::lround(kCalmReachS * joined.frame_rate_hz);
  Eigen::RowVectorXd most =
      Eigen::RowVectorXd::Constant(joined.frame_count(), std::numeric_limits<double>::infinity());
  double before = local_jerk_m_s3(parts[0]).maxCoeff();
  Index join = parts[0].frame_count();
  for (std::size_t n = 1; n < parts.size(); ++n) {
    const double after = local_jerk_m_s3(parts[n]).maxCoeff();
    const Index begin = std::max<Index>(join - reach, 0);
    const Index end = std::min<Index>(join + reach, joined.frame_count());
    auto around = most.segment(begin, end - begin);
    around = around.cwiseMin(share * std::max(before, after));
    before = after;
    join += parts[n].frame_count();
  }
  return calm_locally(joined, most);
}

}  // namespace

std::vector<std::string> JoinOptions::problems() const {
  std::vector<std::string> list;
  if (!(halflife_s > 0.0 && std::isfinite(halflife_s))) {
    list.push_back("JoinOptions::halflife_s = " + std::to_string(halflife_s) +
                   " (must be a finite number > 0)");
  }
  if (most_jerk_share && !(*most_jerk_share > 0.0 && std::isfinite(*most_jerk_share))) {
    list.push_back("JoinOptions::most_jerk_share = " + std::to_string(*most_jerk_share) +
                   " (must be a finite number > 0)");
  }
  return list;
}

PoseMatrix concatenate(std::span<const PoseMatrix> parts, const JoinOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  require_fitting(parts);
  PoseMatrix out = parts[0];
  Index count = 0;
  for (const PoseMatrix& part : parts) count += part.frame_count();
  out.angles.conservativeResize(Eigen::NoChange, count);
  out.height.conservativeResize(count);
  out.steps.conservativeResize(Eigen::NoChange, count);
  const double halflife_frames = options.halflife_s * out.frame_rate_hz;
  Index begin = parts[0].frame_count();
  for (std::size_t n = 1; n < parts.size(); ++n) {
    // At least the five frames that have three second differences.
    const Seam seam{parts[n - 1], parts[n], begin,
                    std::max<Index>(5, std::lround(kReachHalflives * halflife_frames)),
                    Spring(halflife_frames)};
    for (Index row = 0; row < kAngleRowCount; row += 3) join_rotation(seam, row, out);
    join_height(seam, out);
    join_steps(seam, 0, 2, out);
    join_steps(seam, 2, 1, out);
    begin += parts[n].frame_count();
  }
  if (parts.size() > 1 && count > 1) out.steps.col(0) = out.steps.col(1);
  return options.most_jerk_share ? calmed_at_joins(out, parts, *options.most_jerk_share) : out;
}

}  // namespace laban::motion
