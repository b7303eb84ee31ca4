#include "laban/motion/foot_lock.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "laban/base/error.h"
#include "laban/math/low_pass.h"
#include "laban/math/statistics.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_body.h"

#include "motion/place_feet.h"

namespace laban::motion {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// A point in contact moves slower than this on the standard body, m/s: what is as fast is a blend
/// of a standing foot with a swinging one.
constexpr double kFastestContact = 0.5;
/// At the ends of a stance a foot that is faster than this, m/s on the standard body, and than this
/// multiple of its median speed there, comes or goes, for so long at most, seconds.
constexpr double kLeaving = 0.1;
constexpr double kLeavingOverMedian = 2.0;
constexpr double kLongestLeavingS = 0.15;
/// Half-width of the roll from heel to toe, seconds.
constexpr double kRollS = 0.04;
/// A stance goes on over gaps shorter than this, seconds.
constexpr double kShortestGapS = 0.08;
/// A stance shorter than this is none, seconds.
constexpr double kShortestStanceS = 0.1;
/// Above its level in a stance by more than this, a foot lifts or lands, metres.
constexpr double kLiftedM = 0.01;
/// A step at a join takes this long, seconds, and lifts the foot by its share of the way, metres.
constexpr double kStepS = 0.3;
constexpr double kLiftShare = 0.15;
constexpr double kLeastLift = 0.02;
constexpr double kMostLift = 0.07;
/// A swinging foot clears the floor by this share of its way, at least and at most so much, metres:
/// toes of walking adults clear it by one to three centimetres.
constexpr double kClearanceShare = 0.1;
constexpr double kLeastClearance = 0.005;
constexpr double kMostClearance = 0.03;
/// A captured swing is lifted clear in full where so much of its way was added to it.
constexpr double kLengthened = 0.25;
/// How long the height of the floor takes from one part to the next, seconds: as long as most of a
/// join's own offset (JoinOptions::halflife_s).
constexpr double kRampS = 0.3;
/// Half of the range of heights, metres, over which a sinking point begins to be raised; it ends up
/// this much below the floor at most.
constexpr double kSoftFloorM = 0.005;
/// Reach over time of the lowering of the pelvis, seconds.
constexpr double kPelvisS = 0.12;
/// Corrections have nothing above this: a step swings at 2 Hz.
constexpr double kCutoffHz = 6.5;

/// From 0 at 0 to 1 at 1 with no velocity and no acceleration at either end.
double smootherstep(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
}

/// Cubic from (a, slope da) at 0 to (b, slope db) at 1.
Vector3d hermite(const Vector3d& a, const Vector3d& da, const Vector3d& b, const Vector3d& db,
                 double x) {
  const double x2 = x * x;
  const double x3 = x2 * x;
  return (2.0 * x3 - 3.0 * x2 + 1.0) * a + (x3 - 2.0 * x2 + x) * da + (3.0 * x2 - 2.0 * x3) * b +
         (x3 - x2) * db;
}

/// Frames [begin, end) in which a foot stands.
struct Stance {
  Index begin = 0;
  Index end = 0;
  bool steps_here = false;  ///< reached by a step at a join: the swing before it is lifted
};

/// One foot: its two points, how it touches the ground, and the correction.
struct Foot {
  Eigen::Matrix3Xd heel, toe;         // 3 x F, model space, on the shifted body
  std::vector<bool> heel_on, toe_on;  // in contact
  Eigen::RowVectorXd toe_share;       // 1 the toe carries, 0 the heel
  std::vector<Stance> stances;
  std::optional<Eigen::Matrix3Xd> added;  // steps that were not captured, 3 x F, metres
  Eigen::Matrix3Xd offset;                // 3 x F, metres

  [[nodiscard]] Index frames() const { return heel.cols(); }
  [[nodiscard]] bool on(Index f) const {
    return heel_on[static_cast<std::size_t>(f)] || toe_on[static_cast<std::size_t>(f)];
  }
};

/// Everything in frames and metres of this clip.
struct Scale {
  double rate_hz;
  double body;  // leg length over the standard body's

  [[nodiscard]] Index frames(double seconds) const {
    return std::max<Index>(1, std::lround(seconds * rate_hz));
  }
};

/// Velocity of a point at a frame, m/s.
Vector3d velocity(const Eigen::Matrix3Xd& path, Index f, const Scale& scale) {
  const Index before = std::max<Index>(f - 1, 0);
  const Index after = std::min<Index>(f + 1, path.cols() - 1);
  if (after == before) return Vector3d::Zero();
  return (path.col(after) - path.col(before)) *
         (scale.rate_hz / static_cast<double>(after - before));
}
/// Its part over the ground.
double ground_speed(const Eigen::Matrix3Xd& path, Index f, const Scale& scale) {
  const Vector3d v = velocity(path, f, scale);
  return std::hypot(v.x(), v.z());
}

/// Contacts of a point that it can make: it moves slower than kFastestContact.
std::vector<bool> possible_contacts(const FootContacts& contacts, FootPoint point,
                                    const Eigen::Matrix3Xd& path, const Scale& scale) {
  const Index frames = path.cols();
  std::vector<bool> on(static_cast<std::size_t>(frames), false);
  for (Index f = 0; f < frames; ++f) {
    on[static_cast<std::size_t>(f)] = contacts.touches(point, static_cast<int>(f)) &&
                                      ground_speed(path, f, scale) < kFastestContact * scale.body;
  }
  return on;
}

/// One frame has no velocity to hold, and a touch is no stance.
Index shortest_stance(const Scale& scale) {
  return std::max<Index>(2, scale.frames(kShortestStanceS));
}

void trim(const Foot& foot, const Scale& scale, Stance& stance);

std::vector<Stance> stances_of(const Foot& foot, const Scale& scale) {
  std::vector<Stance> all;
  for (Index f = 0; f < foot.frames(); ++f) {
    if (!foot.on(f)) continue;
    if (!all.empty() && f - all.back().end < scale.frames(kShortestGapS)) {
      all.back().end = f + 1;
    } else {
      all.push_back({f, f + 1, false});
    }
  }
  for (Stance& stance : all) trim(foot, scale, stance);
  const Index shortest = shortest_stance(scale);
  std::erase_if(all, [&](const Stance& stance) { return stance.end - stance.begin < shortest; });
  return all;
}

/// Cuts off the ends of a stance in which the foot already lifts or leaves, or still comes or
/// lands: held down there, it would be dragged low over the ground after it.
void trim(const Foot& foot, const Scale& scale, Stance& stance) {
  std::vector<double> heights[2];
  const auto point = [&](Index f) -> const Eigen::Matrix3Xd& {
    return foot.toe_on[static_cast<std::size_t>(f)] ? foot.toe : foot.heel;
  };
  for (Index f = stance.begin; f < stance.end; ++f) {
    if (foot.on(f))
      heights[foot.toe_on[static_cast<std::size_t>(f)] ? 1 : 0].push_back(point(f)(1, f));
  }
  std::array<double, 2> levels{};
  for (std::size_t n = 0; n < 2; ++n)
    levels[n] = heights[n].empty() ? 0.0 : math::median(heights[n]);
  const auto leaves = [&](Index f) {
    const double level = levels[foot.toe_on[static_cast<std::size_t>(f)] ? 1 : 0];
    return !foot.on(f) || point(f)(1, f) - level > kLiftedM * scale.body;
  };
  while (stance.end - stance.begin > 2 && leaves(stance.begin)) ++stance.begin;
  while (stance.end - stance.begin > 2 && leaves(stance.end - 1)) --stance.end;
  // A foot that is held while it already travels would have to hurry after it; one that slides all
  // the time is to be held.
  std::vector<double> speeds;
  for (Index f = stance.begin; f < stance.end; ++f)
    speeds.push_back(velocity(point(f), f, scale).norm());
  const double most = std::max(kLeaving * scale.body, kLeavingOverMedian * math::median(speeds));
  const auto travels = [&](Index f) { return velocity(point(f), f, scale).norm() > most; };
  const Index shortest = shortest_stance(scale);
  const Index longest = scale.frames(kLongestLeavingS);
  const Index last_begin = std::min(stance.begin + longest, stance.end - shortest);
  while (stance.begin < last_begin && travels(stance.begin)) ++stance.begin;
  const Index first_end = std::max(stance.end - longest, stance.begin + shortest);
  while (stance.end > first_end && travels(stance.end - 1)) --stance.end;
}

/// How much of a stance the toe carries: 1 where it is in contact, smoothed over kRollS.
Eigen::RowVectorXd toe_shares(const Foot& foot, const Scale& scale) {
  const Index reach = scale.frames(kRollS);
  Eigen::RowVectorXd share = Eigen::RowVectorXd::Ones(foot.frames());
  for (const Stance& stance : foot.stances) {
    Eigen::RowVectorXd raw(stance.end - stance.begin);
    double last = 1.0;
    for (Index f = stance.begin; f < stance.end; ++f) {
      if (foot.on(f)) last = foot.toe_on[static_cast<std::size_t>(f)] ? 1.0 : 0.0;
      raw(f - stance.begin) = last;  // a bridged gap goes on as before
    }
    for (Index k = 0; k < raw.size(); ++k) {
      double sum = 0.0;
      double weights = 0.0;
      for (Index l = std::max<Index>(k - reach, 0); l <= std::min(k + reach, raw.size() - 1); ++l) {
        const double weight = static_cast<double>(reach + 1 - std::abs(k - l));
        sum += weight * raw(l);
        weights += weight;
      }
      share(stance.begin + k) = sum / weights;
    }
  }
  return share;
}

/// Travel over ground, from 0 at the stance's first frame, of the point that carries the foot.
Eigen::Matrix3Xd drift_of(const Foot& foot, const Stance& stance) {
  Eigen::Matrix3Xd drift = Eigen::Matrix3Xd::Zero(3, stance.end - stance.begin);
  for (Index k = 1; k < drift.cols(); ++k) {
    const Index f = stance.begin + k;
    const double share = 0.5 * (foot.toe_share(f) + foot.toe_share(f - 1));
    Vector3d step = share * (foot.toe.col(f) - foot.toe.col(f - 1)) +
                    (1.0 - share) * (foot.heel.col(f) - foot.heel.col(f - 1));
    step.y() = 0.0;
    drift.col(k) = drift.col(k - 1) + step;
  }
  return drift;
}

/// How far a foot that stays on the ground over a join would slide there; 0 if it does not stay.
double slide_over(const Foot& foot, Index join, const Scale& scale) {
  for (const Stance& stance : foot.stances) {
    if (stance.begin + 1 >= join || stance.end <= join + 1) continue;
    const Eigen::Matrix3Xd drift = drift_of(foot, stance);
    const Index before = join - 1 - stance.begin;
    const Index after = std::min(join + scale.frames(kStepS) - stance.begin, drift.cols() - 1);
    return (drift.col(after) - drift.col(before)).norm();
  }
  return 0.0;
}

/// Takes [begin, end) out of the stances of a foot; what stands after it is reached by a step.
void cut_stances(Foot& foot, Index begin, Index end) {
  std::vector<Stance> all;
  for (const Stance& stance : foot.stances) {
    if (stance.end <= begin || stance.begin >= end) {
      all.push_back(stance);
      continue;
    }
    if (begin - stance.begin >= 2) all.push_back({stance.begin, begin, stance.steps_here});
    if (stance.end - end >= 2) all.push_back({end, stance.end, true});
  }
  foot.stances = std::move(all);
}

/// Lets feet that would slide too far over joins step there, one after the other.
int take_steps(std::array<Foot, 2>& feet, const FootLockOptions& options, const Scale& scale) {
  int steps = 0;
  const Index step = scale.frames(kStepS);
  for (const int join : options.joins) {
    std::array<double, 2> slides = {slide_over(feet[0], join, scale),
                                    slide_over(feet[1], join, scale)};
    const std::size_t first = slides[0] >= slides[1] ? 0 : 1;
    Index begin = join;
    for (const std::size_t side : {first, 1 - first}) {
      if (slides[side] <= options.longest_slide_m * scale.body) continue;
      cut_stances(feet[side], begin, begin + step);
      begin += step;  // never both feet off the ground
      ++steps;
    }
  }
  return steps;
}

/// Writes the correction of one stance: the carrying point stands still, on the floor or, where
/// steps were added to a capture, as high as it is.
void hold(Foot& foot, const Stance& stance, const FootFloor& floor, const FootLockOptions& options,
          const Scale& scale) {
  const Eigen::Matrix3Xd drift = drift_of(foot, stance);
  const Vector3d middle = drift.rowwise().mean();
  Eigen::Matrix3Xd offset = (-drift).colwise() + middle;
  const double farthest = std::sqrt(offset.colwise().squaredNorm().maxCoeff());
  const double limit = options.farthest_m * scale.body;
  if (farthest > limit) offset *= limit / farthest;
  for (Index k = 0; k < offset.cols() && !foot.added; ++k) {
    const Index f = stance.begin + k;
    const double share = foot.toe_share(f);
    offset(1, k) =
        share * (floor.toe_m - foot.toe(1, f)) + (1.0 - share) * (floor.heel_m - foot.heel(1, f));
  }
  foot.offset.middleCols(stance.begin, offset.cols()) = offset;
}

/// Correction and its change a frame at the border of a stance.
struct Border {
  Vector3d value;
  Vector3d slope;
};

Border entry_of(const Foot& foot, const Stance& stance) {
  return {foot.offset.col(stance.begin),
          foot.offset.col(stance.begin + 1) - foot.offset.col(stance.begin)};
}
Border exit_of(const Foot& foot, const Stance& stance) {
  return {foot.offset.col(stance.end - 1),
          foot.offset.col(stance.end - 1) - foot.offset.col(stance.end - 2)};
}

/// Fills the frames between two held ones `from` and `to` (both exclusive).
void swing(Foot& foot, Index from, const Border& a, Index to, const Border& b) {
  const auto length = static_cast<double>(to - from);
  for (Index f = from + 1; f < to; ++f) {
    foot.offset.col(f) = hermite(a.value, a.slope * length, b.value, b.slope * length,
                                 static_cast<double>(f - from) / length);
  }
}

/// Eases the correction in and out between the stances.
void ease(Foot& foot, double ease_s, const Scale& scale) {
  const Index reach = scale.frames(ease_s);
  const Border rest{Vector3d::Zero(), Vector3d::Zero()};
  const std::size_t count = foot.stances.size();
  for (std::size_t n = 0; n <= count; ++n) {
    const bool after_any = n > 0;
    const bool before_any = n < count;
    const Index from = after_any ? foot.stances[n - 1].end - 1 : -1;
    const Index to = before_any ? foot.stances[n].begin : foot.frames();
    if (after_any && before_any && to - from < 2 * reach) {
      swing(foot, from, exit_of(foot, foot.stances[n - 1]), to, entry_of(foot, foot.stances[n]));
      continue;
    }
    // Beyond the clip's ends the easing goes on unseen.
    if (after_any) {
      const Border exit = exit_of(foot, foot.stances[n - 1]);
      for (Index f = from + 1; f < std::min(from + reach, to); ++f) {
        foot.offset.col(f) =
            hermite(exit.value, exit.slope * static_cast<double>(reach), rest.value, rest.slope,
                    static_cast<double>(f - from) / static_cast<double>(reach));
      }
    }
    if (before_any) {
      const Border entry = entry_of(foot, foot.stances[n]);
      for (Index f = std::max(to - reach + 1, from + 1); f < to; ++f) {
        foot.offset.col(f) =
            hermite(rest.value, rest.slope, entry.value, entry.slope * static_cast<double>(reach),
                    1.0 - static_cast<double>(to - f) / static_cast<double>(reach));
      }
    }
  }
}

/// Lifts the foot where it steps at a join.
void lift_steps(Foot& foot, const Scale& scale) {
  for (std::size_t n = 1; n < foot.stances.size(); ++n) {
    if (!foot.stances[n].steps_here) continue;
    const Index from = foot.stances[n - 1].end - 1;
    const Index to = foot.stances[n].begin;
    const Vector3d way =
        foot.toe.col(to) + foot.offset.col(to) - foot.toe.col(from) - foot.offset.col(from);
    const double lift = std::clamp(kLiftShare * std::hypot(way.x(), way.z()),
                                   kLeastLift * scale.body, kMostLift * scale.body);
    for (Index f = from + 1; f < to; ++f) {
      const double x = static_cast<double>(f - from) / static_cast<double>(to - from);
      const double sine = std::sin(std::numbers::pi * x);
      foot.offset(1, f) += lift * sine * sine;
    }
  }
}

/// How far a point that sinks by `depth` is raised: smooth, none above the floor.
double raise(double depth) {
  // Twice the width below the floor it is raised by all but the width.
  const double x = depth;
  if (x <= 0.0) return 0.0;
  return x >= 2.0 * kSoftFloorM ? x - kSoftFloorM : x * x / (4.0 * kSoftFloorM);
}

/// Lifts the toes of a foot on its way from one stance to the next to where it swings free, if it
/// does not get there by itself: what a blend mixes of two swings, or a held foot hurries after,
/// would drag. Rises and falls within a quarter of the way; a short way is not lifted, and a
/// captured one only as far as steps were added to it.
void clear_swings(Foot& foot, const FootFloor& floor, const Scale& scale) {
  const std::size_t count = foot.stances.size();
  for (std::size_t n = 0; count > 0 && n <= count; ++n) {
    const bool after_any = n > 0;
    const bool before_any = n < count;
    const Index from = after_any ? foot.stances[n - 1].end - 1 : 0;
    const Index to = before_any ? foot.stances[n].begin : foot.frames() - 1;
    if (to - from < 3) continue;
    const Vector3d way =
        foot.toe.col(to) + foot.offset.col(to) - foot.toe.col(from) - foot.offset.col(from);
    const double clearance =
        std::min(kClearanceShare * std::hypot(way.x(), way.z()), kMostClearance * scale.body);
    if (clearance < kLeastClearance * scale.body) continue;
    const Index inside = to - from;
    const double lift =
        foot.added ? std::min(1.0, foot.added->middleCols(from + 1, inside).rowwise().sum().norm() /
                                       (kLengthened * std::hypot(way.x(), way.z())))
                   : 1.0;
    const double quarter = 0.25 * static_cast<double>(to - from);
    for (Index f = from + 1; f < to; ++f) {
      // At the clip's ends too: there the foot may stand on what is not shown.
      const double rise = smootherstep(static_cast<double>(f - from) / quarter);
      const double fall = smootherstep(static_cast<double>(to - f) / quarter);
      const double height = foot.toe(1, f) + foot.offset(1, f) - floor.toe_m;
      foot.offset(1, f) += lift * std::min(rise, fall) * raise(clearance + kSoftFloorM - height);
    }
  }
}

/// Keeps toes above the floor, and heels off contact too.
void keep_above(Foot& foot, const FootFloor& floor) {
  std::vector<bool> stands(static_cast<std::size_t>(foot.frames()), false);
  for (const Stance& stance : foot.stances) {
    for (Index f = stance.begin; f < stance.end; ++f) stands[static_cast<std::size_t>(f)] = true;
  }
  for (Index f = 0; f < foot.frames(); ++f) {
    const double y = foot.offset(1, f);
    double up = raise(floor.toe_m - foot.toe(1, f) - y);
    if (!stands[static_cast<std::size_t>(f)])
      up = std::max(up, raise(floor.heel_m - foot.heel(1, f) - y));
    foot.offset(1, f) += up;
  }
}

/// Median height of the points in contact in frames [begin, end).
std::optional<double> level_of(const std::array<Foot, 2>& feet, bool toes, Index begin, Index end) {
  std::vector<double> heights;
  for (const Foot& foot : feet) {
    for (Index f = begin; f < end; ++f) {
      if ((toes ? foot.toe_on : foot.heel_on)[static_cast<std::size_t>(f)])
        heights.push_back((toes ? foot.toe : foot.heel)(1, f));
    }
  }
  if (heights.empty()) return std::nullopt;
  return math::median(heights);
}

FootFloor floor_of(const std::array<Foot, 2>& feet) {
  const auto toe = level_of(feet, true, 0, feet[0].frames());
  const auto heel = level_of(feet, false, 0, feet[0].frames());
  return {heel.value_or(toe.value_or(0.0)), toe.value_or(heel.value_or(0.0))};
}

/// By how much the whole body is to be raised in every frame, so that each part stands on the
/// floor; a part in which no foot stands goes with its neighbour.
Eigen::RowVectorXd body_shift(const std::array<Foot, 2>& feet, const FootFloor& floor,
                              const FootLockOptions& options, const Scale& scale) {
  const Index frames = feet[0].frames();
  if (options.added_steps) return Eigen::RowVectorXd::Zero(frames);
  std::vector<Index> borders = {0};
  if (options.level_parts) {
    borders.insert(borders.end(), options.joins.begin(), options.joins.end());
  }
  borders.push_back(frames);
  std::vector<std::optional<double>> shifts;
  for (std::size_t n = 0; n + 1 < borders.size(); ++n) {
    // Just after a join heights still come from the part before.
    const Index settled =
        n == 0 ? borders[n] : std::min(borders[n] + scale.frames(kRampS), borders[n + 1] - 1);
    std::optional<double> shift;
    for (const Index begin : {settled, borders[n]}) {
      if (shift) break;
      if (const auto toe = level_of(feet, true, begin, borders[n + 1])) {
        shift = floor.toe_m - *toe;
      } else if (const auto heel = level_of(feet, false, begin, borders[n + 1])) {
        shift = floor.heel_m - *heel;
      }
    }
    shifts.push_back(shift);
  }
  for (std::size_t n = 1; n < shifts.size(); ++n) {
    if (!shifts[n]) shifts[n] = shifts[n - 1];
  }
  for (std::size_t n = shifts.size() - 1; n > 0; --n) {
    if (!shifts[n - 1]) shifts[n - 1] = shifts[n];
  }
  Eigen::RowVectorXd shift(frames);
  for (std::size_t n = 0; n < shifts.size(); ++n) {
    const double before = shifts[n == 0 ? 0 : n - 1].value_or(0.0);
    for (Index f = borders[n]; f < borders[n + 1]; ++f) {
      const double x = static_cast<double>(f - borders[n]) / (kRampS * scale.rate_hz);
      shift(f) = before + smootherstep(x) * (shifts[n].value_or(0.0) - before);
    }
  }
  return shift;
}

/// Moving maximum, then a symmetric average of the same reach: smooth, and nowhere below `values`.
Eigen::RowVectorXd smooth_envelope(const Eigen::RowVectorXd& values, Index reach) {
  const Index count = values.size();
  const auto windowed = [&](const Eigen::RowVectorXd& row, Index width, bool maximum) {
    Eigen::RowVectorXd result(count);
    for (Index f = 0; f < count; ++f) {
      double sum = 0.0;
      double largest = 0.0;
      for (Index k = -width; k <= width; ++k) {
        const double value = row(std::clamp<Index>(f + k, 0, count - 1));
        sum += value;
        largest = std::max(largest, value);
      }
      result(f) = maximum ? largest : sum / static_cast<double>(2 * width + 1);
    }
    return result;
  };
  const Index half = std::max<Index>(reach / 2, 1);
  const Eigen::RowVectorXd widened = windowed(values, 2 * half, true);
  return windowed(windowed(widened, half, false), half, false);
}

/// How far the pelvis goes down in every frame so that no foot is out of reach, at most `deepest`.
Eigen::RowVectorXd lowering(std::span<const ModelPose> poses, const std::array<LegJoints, 2>& legs,
                            const std::array<Foot, 2>& feet, double deepest, const Scale& scale) {
  Eigen::RowVectorXd needed = Eigen::RowVectorXd::Zero(feet[0].frames());
  for (Index f = 0; f < needed.size(); ++f) {
    for (std::size_t side = 0; side < 2; ++side) {
      needed(f) = std::max(needed(f), lowering_to_reach(poses[static_cast<std::size_t>(f)],
                                                        legs[side], feet[side].offset.col(f)));
    }
  }
  return smooth_envelope(needed.cwiseMin(deepest), scale.frames(kPelvisS));
}

/// The clip as it is written: rotations, and offsets of root or hips.
struct Draft {
  Eigen::Matrix3Xd root;
  std::vector<Quaterniond> rotations;
  Eigen::Matrix3Xd translations;
};

Draft draft_of(const Clip& clip) {
  Draft draft{clip.root_positions(), {}, {}};
  const int joints = clip.joint_count();
  for (int f = 0; f < clip.frame_count(); ++f) {
    const auto local = clip.rotations(f);
    draft.rotations.insert(draft.rotations.end(), local.begin(), local.end());
  }
  if (clip.has_translations()) {
    draft.translations.resize(3, static_cast<Index>(clip.frame_count()) * joints);
    for (int f = 0; f < clip.frame_count(); ++f) {
      for (int j = 0; j < joints; ++j)
        draft.translations.col(static_cast<Index>(f) * joints + j) = clip.translation(f, j);
    }
  }
  return draft;
}

/// Raises the body at one frame: the hips where they animate their position, else the root.
void raise_body(Draft& draft, const Clip& clip, const Humanoid& humanoid, const ModelPose& pose,
                int frame, double up) {
  const int hips = humanoid.mapped(StandardJoint::kHips)->joint;
  const Index column = static_cast<Index>(frame) * clip.joint_count();
  if (hips == 0 || !clip.has_translations()) {
    draft.root(1, frame) += up;
    if (clip.has_translations()) draft.translations(1, column) += up;
    return;
  }
  const int parent = clip.skeleton().joint(hips).parent;
  draft.translations.col(column + hips) +=
      pose.rotations[static_cast<std::size_t>(parent)].conjugate() * Vector3d(0.0, up, 0.0);
}

std::vector<ModelPose> model_poses(const Clip& clip) {
  std::vector<ModelPose> poses;
  for (int f = 0; f < clip.frame_count(); ++f) poses.push_back(forward_kinematics(clip, f));
  return poses;
}

void require_fit(const Clip& clip, const Humanoid& humanoid, const FootContacts& contacts,
                 const FootLockOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  if (clip.joint_count() != humanoid.rig_joint_count()) {
    throw Error(ErrorKind::kUsage, "lock_feet: the clip has " + std::to_string(clip.joint_count()) +
                                       " joints, the humanoid was made for " +
                                       std::to_string(humanoid.rig_joint_count()));
  }
  if (contacts.frame_count() != clip.frame_count() ||
      std::abs(contacts.frame_rate_hz - clip.frame_rate_hz()) > 1e-6 * clip.frame_rate_hz()) {
    throw Error(ErrorKind::kData,
                "lock_feet: contacts of " + std::to_string(contacts.frame_count()) + " frames at " +
                    std::to_string(contacts.frame_rate_hz) + " Hz for a clip of " +
                    std::to_string(clip.frame_count()) + " at " +
                    std::to_string(clip.frame_rate_hz()) + " Hz (resample the contacts)");
  }
  for (std::size_t side = 0; options.added_steps && side < 2; ++side) {
    const Eigen::Matrix3Xd& steps = (*options.added_steps)[side];
    if (steps.cols() != clip.frame_count() || !steps.allFinite()) {
      throw Error(ErrorKind::kData, "lock_feet: " + std::to_string(steps.cols()) +
                                        " added steps for " + std::to_string(clip.frame_count()) +
                                        " frames (must be as many, and finite)");
    }
  }
  if (!options.joins.empty() &&
      (options.joins.front() < 1 || options.joins.back() >= clip.frame_count())) {
    throw Error(ErrorKind::kUsage, "FootLockOptions::joins must lie inside the clip");
  }
}

/// Where both feet are and touch the ground.
std::array<Foot, 2> feet_of(const Clip& clip, const Humanoid& humanoid,
                            const FootContacts& contacts, const FootLockOptions& options,
                            const Scale& scale) {
  FootPaths paths = foot_paths(clip, humanoid);
  std::array<Foot, 2> feet;
  for (std::size_t side = 0; side < 2; ++side) {
    Foot& foot = feet[side];
    foot.heel = std::move(paths.points[2 * side]);
    foot.toe = std::move(paths.points[2 * side + 1]);
    foot.heel_on = possible_contacts(contacts, static_cast<FootPoint>(2 * side), foot.heel, scale);
    foot.toe_on =
        possible_contacts(contacts, static_cast<FootPoint>(2 * side + 1), foot.toe, scale);
    foot.offset = Eigen::Matrix3Xd::Zero(3, clip.frame_count());
    if (options.added_steps) foot.added = (*options.added_steps)[side];
  }
  return feet;
}

/// The corrections of both feet, the body being raised by `shift`. @returns steps taken.
int correct(std::array<Foot, 2>& feet, const Eigen::RowVectorXd& shift, const FootFloor& floor,
            const FootLockOptions& options, const Scale& scale) {
  for (Foot& foot : feet) {
    foot.heel.row(1) += shift;
    foot.toe.row(1) += shift;
    foot.stances = stances_of(foot, scale);
    foot.toe_share = toe_shares(foot, scale);
  }
  const int steps = take_steps(feet, options, scale);
  for (Foot& foot : feet) {
    for (const Stance& stance : foot.stances) hold(foot, stance, floor, options, scale);
    ease(foot, options.ease_s, scale);
    lift_steps(foot, scale);
    clear_swings(foot, floor, scale);
    if (!foot.added) keep_above(foot, floor);
    foot.offset = math::low_pass(foot.offset, scale.rate_hz, kCutoffHz);
  }
  return steps;
}

}  // namespace

std::vector<std::string> FootLockOptions::problems() const {
  std::vector<std::string> list;
  const auto require = [&](bool good, const std::string& text) {
    if (!good) list.push_back("FootLockOptions::" + text);
  };
  require(!floor || (std::isfinite(floor->heel_m) && std::isfinite(floor->toe_m)),
          "floor must be finite");
  require(std::is_sorted(joins.begin(), joins.end()), "joins must ascend");
  require(ease_s > 0.0 && std::isfinite(ease_s), "ease_s must be > 0");
  require(longest_slide_m >= 0.0, "longest_slide_m must be >= 0");
  require(farthest_m >= 0.0 && std::isfinite(farthest_m), "farthest_m must be >= 0");
  require(deepest_m >= 0.0 && std::isfinite(deepest_m), "deepest_m must be >= 0");
  return list;
}

LockedFeet lock_feet(const Clip& given, const Humanoid& humanoid, const FootContacts& contacts,
                     const FootLockOptions& options) {
  require_fit(given, humanoid, contacts, options);
  if (!contacts.any()) return {given, 0, 0, 0.0, 0.0};
  const std::array<LegJoints, 2> legs = legs_of(humanoid, model_poses(given));
  const Clip clip = mend_knees(given, legs);
  const Scale scale{clip.frame_rate_hz(), humanoid.leg_length_m() / kStandardLegLengthM};
  std::array<Foot, 2> feet = feet_of(clip, humanoid, contacts, options, scale);
  const FootFloor floor = options.floor.value_or(floor_of(feet));
  const Eigen::RowVectorXd shift = body_shift(feet, floor, options, scale);
  LockedFeet locked{clip, 0, correct(feet, shift, floor, options, scale), 0.0, 0.0};

  const int frames = clip.frame_count();
  const std::vector<ModelPose> poses = model_poses(clip);
  const Eigen::RowVectorXd lowered =
      lowering(poses, legs, feet, options.deepest_m * scale.body, scale);
  Draft draft = draft_of(clip);
  std::array<Eigen::Matrix3Xd, 2> goals;
  for (Eigen::Matrix3Xd& path : goals) path.resize(3, frames);
  for (int f = 0; f < frames; ++f) {
    const ModelPose& pose = poses[static_cast<std::size_t>(f)];
    raise_body(draft, clip, humanoid, pose, f, shift(f) - lowered(f));
    for (std::size_t side = 0; side < 2; ++side) {
      goals[side].col(f) = pose.positions.col(legs[side].foot) + feet[side].offset.col(f) +
                           shift(f) * Vector3d::UnitY();
    }
  }
  for (const Foot& foot : feet) {
    locked.stances += static_cast<int>(foot.stances.size());
    locked.farthest_m =
        std::max(locked.farthest_m, std::sqrt(foot.offset.colwise().squaredNorm().maxCoeff()));
  }
  locked.deepest_m = lowered.maxCoeff();
  const Clip raised(clip.shared_skeleton(), clip.frame_rate_hz(), std::move(draft.root),
                    std::move(draft.rotations), std::move(draft.translations));
  locked.clip = place_feet(raised, legs, goals);
  return locked;
}

}  // namespace laban::motion
