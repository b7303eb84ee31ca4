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
/// A join of parts that do not fit may bend this share of what the parts do, where offsets may take
/// their time (JoinOptions::longest_halflife_s): in the parts hardly every joint bends most at
/// once.
constexpr double kCalmShare = 0.5;
/// Reach of JoinOptions::most_jerk_share on either side of a join, seconds.
constexpr double kCalmReachS = 0.5;
/// y t after which an offset has died away: (1 + 16) e^-16, some 2e-6 of it, is left.
constexpr double kDiedAway = 16.0;

/// (1 + x) e^-x = 1/2: half-life of the spring below times its rate.
constexpr double kHalfway = 1.6783469900166605;
/// What an ordinary movement of a joint, and of the hips' height, bends by: rad/s^2, leg
/// lengths/s^2.
constexpr double kUsualTurn = 20.0;
constexpr double kUsualRise = 10.0;
/// Of the steps, changes per second: leg lengths/s (over seconds), radians/s.
constexpr double kUsualStep = 2.0;

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

/// How fast offsets decay.
struct Decay {
  double halflife_frames;
  double longest_frames;
  double rate_hz;

  [[nodiscard]] bool is_adaptive() const { return longest_frames > halflife_frames; }
  /// The spring for an offset whose first two samples are that long and that far apart, in motion
  /// that may bend by `limit`: a spring bends by y^2 x + 2 y v at most.
  [[nodiscard]] Spring spring(double length, double change, double limit,
                              double usual_per_s2) const {
    if (!is_adaptive()) return Spring(halflife_frames);
    const double bend = std::max(limit, usual_per_s2 / (rate_hz * rate_hz));
    return with_rate(bend / (change + std::sqrt(change * change + length * bend)));
  }
  /// The same for steps, which are velocities: from rest an offset changes by y x / e a frame.
  [[nodiscard]] Spring step_spring(double length, double limit) const {
    if (!is_adaptive() || length == 0.0) return Spring(halflife_frames);
    const double change = std::max(limit, kUsualStep / (rate_hz * rate_hz));
    return with_rate(std::numbers::e * change / length);
  }

 private:
  [[nodiscard]] Spring with_rate(double y) const {
    return Spring(std::clamp(kHalfway / y, halflife_frames, longest_frames));
  }
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
  Index begin;                    // frame of `out` that shows frame 0 of `after`
  Index reach;                    // frames on either side whose own bends count
  double tolerance = kTolerance;  // share of these that the join may bend
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
  return seam.tolerance * std::max(largest_bend(before, before.cols() - seam.reach, before.cols()),
                                   largest_bend(after, 0, seam.reach));
}

/// Whether poses and velocities continue over a seam as they would inside one motion.
bool fits(const Seam& seam, const PoseMatrix& out) {
  const auto continues = [&](const Neighbours& n, double limit) {
    return (n.next - 2.0 * n.last + n.before_last).norm() <= limit &&
           (n.after_next - 2.0 * n.next + n.last).norm() <= limit;
  };
  for (Index row = 0; row < kAngleRowCount; row += 3) {
    const auto part = seam.after.angles.middleRows<3>(row);
    Neighbours n = neighbours_of(out.angles.middleRows<3>(row), part, seam.begin);
    const Vector3d step = n.after_next - n.next;
    n.next = math::nearest_branch(n.next, n.last);
    n.after_next = n.next + step;
    if (!continues(n, bend_limit(seam, seam.before.angles.middleRows<3>(row), part))) return false;
  }
  return continues(neighbours_of(out.height, seam.after.height, seam.begin),
                   bend_limit(seam, seam.before.height, seam.after.height));
}

/// Frames from a seam outwards: the one next to it is 0.
struct Side {
  Index nearest;    ///< frame of the output
  Index direction;  ///< 1 behind the seam, -1 before it
  Index count;
  [[nodiscard]] Index frame(Index k) const { return nearest + direction * k; }
  /// Frames that a spring's offset moves.
  [[nodiscard]] Index moved_by(const Spring& spring) const {
    return std::min(count, spring.reach());
  }
};

/// An offset before the seam reaches over short parts.
Side side_before(const Seam& seam) {
  return {seam.begin - 1, -1, seam.begin};
}
Side side_behind(const Seam& seam) {
  return {seam.begin, 1, seam.after.frame_count()};
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
/// @returns how many frames it turned.
Index turn_side(const Side& side, const Vector3d& nearest, const Vector3d& second,
                const Offsets& offsets, double limit, const Decay& decay,
                Eigen::Ref<Eigen::MatrixXd> rows) {
  // As rotations the offsets are free of branches: a jump never decays the long way round.
  const auto turn = [](const Vector3d& from, const Vector3d& by) {
    if (by.isZero(0.0)) return Vector3d(Vector3d::Zero());
    return math::log(math::exp(from + by) * math::exp(from).conjugate());
  };
  const Vector3d turn_nearest = turn(nearest, offsets.first);
  // Of one way round: near half a turn the second might point against the first.
  const Vector3d turn_second = math::nearest_branch(turn(second, offsets.second), turn_nearest);
  if (turn_nearest.isZero(0.0) && turn_second.isZero(0.0)) return 0;
  const Spring spring =
      decay.spring(turn_nearest.norm(), (turn_second - turn_nearest).norm(), limit, kUsualTurn);
  const Index moved = side.moved_by(spring);
  for (Index k = 0; k < moved; ++k) {
    const auto [a, b] = spring.through_samples(static_cast<double>(k));
    const Vector3d offset = a * turn_nearest + b * turn_second;
    const Vector3d own = rows.col(side.frame(k));
    rows.col(side.frame(k)) =
        math::nearest_branch(math::log(math::exp(offset) * math::exp(own)), own);
  }
  return moved;
}

/// Puts frames [begin, end) on the branch of the exponential map nearest to the frame before each.
void continue_branches(Index begin, Index end, Eigen::Ref<Eigen::MatrixXd> rows) {
  for (Index f = std::max<Index>(begin, 1); f < end; ++f) {
    const Vector3d r = rows.col(f);
    rows.col(f) = math::nearest_branch(r, rows.col(f - 1));
  }
}

/// Joint rows `row` .. `row` + 2.
void join_rotation(const Seam& seam, const Decay& decay, Index row, PoseMatrix& out) {
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
  const Index turned =
      turn_side(side_before(seam), n.last, n.before_last, offsets.before, limit, decay, result);
  turn_side(side_behind(seam), n.next, n.after_next, offsets.behind, limit, decay, result);
  continue_branches(seam.begin - turned, seam.begin + count, result);
}

void raise_side(const Side& side, const Offsets& offsets, double limit, const Decay& decay,
                Eigen::RowVectorXd& height) {
  const Spring spring = decay.spring(offsets.first.norm(), (offsets.second - offsets.first).norm(),
                                     limit, kUsualRise);
  for (Index k = 0; k < side.moved_by(spring); ++k) {
    const auto [a, b] = spring.through_samples(static_cast<double>(k));
    height(side.frame(k)) += a * offsets.first.x() + b * offsets.second.x();
  }
}

void join_height(const Seam& seam, const Decay& decay, PoseMatrix& out) {
  const Neighbours n = neighbours_of(out.height, seam.after.height, seam.begin);
  const double limit = bend_limit(seam, seam.before.height, seam.after.height);
  const SharedOffsets offsets = shared_offsets(n, limit);
  out.height.segment(seam.begin, seam.after.height.size()) = seam.after.height;
  raise_side(side_before(seam), offsets.before, limit, decay, out.height);
  raise_side(side_behind(seam), offsets.behind, limit, decay, out.height);
}

/// Steps [row, row + rows) of the new part: they are velocities, so one derivative less counts.
void join_steps(const Seam& seam, const Decay& decay, Index row, Index rows, PoseMatrix& out) {
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
      seam.tolerance *
      std::max(largest_change(steps_before, steps_before.cols() - seam.reach, steps_before.cols()),
               largest_change(after, 0, seam.reach));
  const Vector3d allowed = limited(half_jump, limit);
  const Eigen::VectorXd offset = (half_jump - allowed).head(rows);  // of either side
  const Spring spring = decay.step_spring(offset.norm(), limit);
  const auto left = [&](Index k) { return spring.from_rest(static_cast<double>(k)) * offset; };
  const Side before = side_before(seam);
  for (Index k = 0; k < before.moved_by(spring); ++k) result.col(before.frame(k)) += left(k);
  for (Index k = 0; k < std::min(after.cols(), spring.reach()); ++k)
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
  if (longest_halflife_s &&
      !(*longest_halflife_s >= halflife_s && std::isfinite(*longest_halflife_s))) {
    list.push_back("JoinOptions::longest_halflife_s = " + std::to_string(*longest_halflife_s) +
                   " (must be a finite number >= halflife_s)");
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
  const Decay decay{halflife_frames,
                    options.longest_halflife_s.value_or(options.halflife_s) * out.frame_rate_hz,
                    out.frame_rate_hz};
  Index begin = parts[0].frame_count();
  for (std::size_t n = 1; n < parts.size(); ++n) {
    // At least the five frames that have three second differences.
    Seam seam{parts[n - 1], parts[n], begin,
              std::max<Index>(5, std::lround(kReachHalflives * halflife_frames))};
    if (decay.is_adaptive() && !fits(seam, out)) seam.tolerance = kCalmShare;
    for (Index row = 0; row < kAngleRowCount; row += 3) join_rotation(seam, decay, row, out);
    join_height(seam, decay, out);
    join_steps(seam, decay, 0, 2, out);
    join_steps(seam, decay, 2, 1, out);
    begin += parts[n].frame_count();
  }
  if (parts.size() > 1 && count > 1) out.steps.col(0) = out.steps.col(1);
  return options.most_jerk_share ? calmed_at_joins(out, parts, *options.most_jerk_share) : out;
}

}  // namespace laban::motion
