#include "laban/manifold/map_path.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <utility>

#include "laban/base/error.h"
#include "laban/manifold/map_spline.h"
#include "laban/manifold/markov_chain.h"
#include "laban/math/rotation.h"
#include "laban/math/statistics.h"
#include "laban/motion/foot_lock.h"
#include "laban/motion/retarget.h"
#include "laban/motion/standard_body.h"

#include "manifold/pose_channels.h"
#include "manifold/solve_pose.h"

namespace laban::manifold {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Index;
using Eigen::Matrix2Xd;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using motion::kStandardJointCount;
using motion::StandardJoint;

// ---- timing ----

/// A spline with the time at which the body is at each of many points along it.
struct TimedCurve {
  std::vector<double> parameters;
  std::vector<double> times_s;  // ascending from 0
  Matrix2Xd points;
};

/// The median of the speeds that the map knows at the captures' own places.
double median_speed(const PoseManifold& manifold) {
  // Every so many: a median needs no more than a few hundred.
  const Index step = std::max<Index>(1, manifold.points.cols() / 200);
  std::vector<double> speeds;
  for (Index n = 0; n < manifold.points.cols(); n += step) {
    speeds.push_back(manifold.generator.at(manifold.points.col(n), kTimingRows)[kSpeedRow]);
  }
  const double median = math::median(speeds);
  // Captures that stand still: any speed will do.
  constexpr double kLeastSpeed = 0.05;  // m/s
  return std::max(kLeastSpeed, median);
}

TimedCurve timed(const PoseManifold& manifold, const MapSpline& spline) {
  constexpr double kStep = 0.25;        // map units
  constexpr double kWholeMap_s = 60.0;  // the least time over all of the map, where no joint moves
  const Region plane = manifold.region();
  const double usual = median_speed(manifold);
  TimedCurve curve;
  Eigen::VectorXd before;
  const auto add = [&](double u) {
    const Vector2d point = inside(plane, spline.at(u));
    const Eigen::VectorXd now = manifold.generator.at(point, kTimingRows);
    double time = 0.0;
    if (before.size() > 0) {
      const double speed =
          std::clamp(0.5 * (now[kSpeedRow] + before[kSpeedRow]), usual / 3.0, usual * 3.0);
      const Vector2d last = curve.points.col(curve.points.cols() - 1);
      time = curve.times_s.back() +
             mean_joint_distance(now.head(kPoseRowCount), before.head(kPoseRowCount)) / speed +
             1e-3 * kWholeMap_s * (point - last).norm() / plane.high.maxCoeff();
    }
    before = now;
    curve.parameters.push_back(u);
    curve.times_s.push_back(time);
    curve.points.conservativeResize(2, curve.points.cols() + 1);
    curve.points.rightCols<1>() = point;
  };
  add(0.0);
  const auto& knots = spline.knots();
  for (Index k = 1; k < knots.size(); ++k) {
    // Between two knots the spline is about as long as the straight line.
    const double line = (spline.at(knots[k]) - spline.at(knots[k - 1])).norm();
    const int steps = std::max(4, static_cast<int>(std::ceil(line / kStep)));
    for (int i = 1; i <= steps; ++i) {
      add(knots[k - 1] + (knots[k] - knots[k - 1]) * i / steps);
    }
  }
  return curve;
}

/// The curve's parameter at a time, linear between its samples.
double parameter_at(const TimedCurve& curve, double time_s) {
  const auto after = std::upper_bound(curve.times_s.begin(), curve.times_s.end(), time_s);
  if (after == curve.times_s.begin()) return curve.parameters.front();
  if (after == curve.times_s.end()) return curve.parameters.back();
  const auto k = static_cast<std::size_t>(after - curve.times_s.begin());
  const double share = (time_s - curve.times_s[k - 1]) / (curve.times_s[k] - curve.times_s[k - 1]);
  return curve.parameters[k - 1] + share * (curve.parameters[k] - curve.parameters[k - 1]);
}

Matrix2Xd frames_along(const PoseManifold& manifold, const MapSpline& spline,
                       const TimedCurve& curve, double duration_s, int frames) {
  Matrix2Xd points(2, frames);
  for (int f = 0; f < frames; ++f) {
    const double time = frames > 1 ? duration_s * f / (frames - 1.0) : 0.0;
    points.col(f) = inside(manifold.region(), spline.at(parameter_at(curve, time)));
  }
  return points;
}

/// The frame at which the path is nearest to each waypoint, in order.
std::vector<int> frames_of_waypoints(const MapSpline& spline, const TimedCurve& curve,
                                     double duration_s, int frames) {
  std::vector<int> passed;
  for (Index k = 0; k < spline.knots().size(); ++k) {
    const auto at = std::lower_bound(curve.parameters.begin(), curve.parameters.end(),
                                     spline.knots()[k] - 1e-12);
    const double time = curve.times_s[static_cast<std::size_t>(at - curve.parameters.begin())];
    if (time > duration_s + 1e-12) break;
    const double share = duration_s > 0.0 ? time / duration_s : 0.0;
    passed.push_back(static_cast<int>(std::lround(share * (frames - 1.0))));
  }
  return passed;
}

// ---- walks ----

/// Transitions between different primitives only: what remains once each row's stay is taken out.
TransitionMatrix leaving(const Primitives& primitives) {
  MatrixXd counts = primitives.counts;
  counts.diagonal().setZero();
  return transition_matrix(counts);
}

/// Noise has no business on the diagonal of a matrix that knows no stay.
TransitionMatrix perturbed_leaving(const TransitionMatrix& matrix, double scale, base::Rng& rng) {
  TransitionMatrix noisy = perturbed(matrix, scale, rng);
  noisy.diagonal().setZero();
  return noisy;
}

/// The primitive whose pose is nearest to that of `from`, other than `from` and `left`.
int nearest_pose(const Primitives& primitives, int from, int left) {
  int nearest = from;
  double least = std::numeric_limits<double>::infinity();
  for (int j = 0; j < primitives.count(); ++j) {
    if (j == from || (j == left && primitives.count() > 2)) continue;
    const double distance =
        (primitives.coordinates.col(from) - primitives.coordinates.col(j)).norm();
    if (distance >= least) continue;
    least = distance;
    nearest = j;
  }
  return nearest;
}

/// Ways over the map from node to node along which poses change least: a straight line may cross a
/// fold, where poses far from each other lie side by side.
class ShortestWays {
 public:
  explicit ShortestWays(const PoseManifold& manifold)
      : rows_(manifold.som.rows), columns_(manifold.som.columns) {
    Matrix2Xd nodes(2, static_cast<Index>(rows_) * columns_);
    for (int node = 0; node < nodes.cols(); ++node) nodes.col(node) = manifold.som.position(node);
    poses_ = manifold.generator.at_all(nodes).topRows(kPoseRowCount);
  }

  /// Nodes between two places, both ends left out, every few of them: the spline rounds the rest.
  [[nodiscard]] std::vector<Vector2d> between(const Vector2d& from, const Vector2d& to) const {
    constexpr std::size_t kEvery = 4;
    std::vector<int> way = shortest(node_at(from), node_at(to));
    std::vector<Vector2d> places;
    for (std::size_t n = kEvery; n + kEvery / 2 < way.size(); n += kEvery) {
      places.emplace_back(way[n] % columns_, way[n] / columns_);
    }
    return places;
  }

 private:
  [[nodiscard]] int node_at(const Vector2d& place) const {
    const auto at = [](double value, int count) {
      return std::clamp(static_cast<int>(std::lround(value)), 0, count - 1);
    };
    return at(place.y(), rows_) * columns_ + at(place.x(), columns_);
  }

  /// Dijkstra over the eight neighbours of each node; ties go to the node of lower number.
  [[nodiscard]] std::vector<int> shortest(int from, int to) const {
    const auto count = static_cast<std::size_t>(rows_) * static_cast<std::size_t>(columns_);
    std::vector<double> cost(count, std::numeric_limits<double>::infinity());
    std::vector<int> before(count, -1);
    using Entry = std::pair<double, int>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    cost[static_cast<std::size_t>(from)] = 0.0;
    open.emplace(0.0, from);
    while (!open.empty()) {
      const auto [here_cost, here] = open.top();
      open.pop();
      if (here == to) break;
      if (here_cost > cost[static_cast<std::size_t>(here)]) continue;
      const int row = here / columns_;
      const int column = here % columns_;
      for (int r = std::max(0, row - 1); r <= std::min(rows_ - 1, row + 1); ++r) {
        for (int c = std::max(0, column - 1); c <= std::min(columns_ - 1, column + 1); ++c) {
          const int next = r * columns_ + c;
          if (next == here) continue;
          const double way = here_cost + (poses_.col(here) - poses_.col(next)).norm();
          if (way >= cost[static_cast<std::size_t>(next)]) continue;
          cost[static_cast<std::size_t>(next)] = way;
          before[static_cast<std::size_t>(next)] = here;
          open.emplace(way, next);
        }
      }
    }
    std::vector<int> way{to};
    while (way.back() != from) way.push_back(before[static_cast<std::size_t>(way.back())]);
    std::reverse(way.begin(), way.end());
    return way;
  }

  int rows_;
  int columns_;
  MatrixXd poses_;  // of the nodes
};

/// The places a walk goes through, and which of them are its primitives' own.
struct Route {
  std::vector<Vector2d> places;
  std::vector<std::size_t> marks;
};

/// As MapSpline does, which passes repeated points once: so its knots are these places.
void add_place(Route& route, const Vector2d& place) {
  if ((place - route.places.back()).norm() >= 1e-9) route.places.push_back(place);
}

/// From `start` to the centres of the primitives after the first, by the shortest ways.
Route route_of(const Primitives& primitives, const std::vector<int>& states, const Vector2d& start,
               const ShortestWays& ways) {
  Route route{{start}, {0}};
  std::map<std::pair<int, int>, std::vector<Vector2d>> known;
  for (std::size_t t = 1; t < states.size(); ++t) {
    const Vector2d center = primitives.centers.col(states[t]);
    std::vector<Vector2d> way;
    if (t == 1) {
      way = ways.between(start, center);
    } else {
      const auto [found, fresh] = known.try_emplace({states[t - 1], states[t]});
      if (fresh) found->second = ways.between(primitives.centers.col(states[t - 1]), center);
      way = found->second;
    }
    for (const Vector2d& place : way) add_place(route, place);
    add_place(route, center);
    route.marks.push_back(route.places.size() - 1);
  }
  return route;
}

Matrix2Xd columns_of(const std::vector<Vector2d>& places) {
  Matrix2Xd columns(2, std::ssize(places));
  for (std::size_t n = 0; n < places.size(); ++n) columns.col(static_cast<Index>(n)) = places[n];
  return columns;
}

// ---- playing ----

// A bone turns about itself no faster, radians a second. Captures turn a straight arm about itself
// by half a turn from one frame to the next where their angles flip; a map that has learnt both
// sides would flip with them.
constexpr double kMostTurn = 12.0;

/// Heel and toe of both feet, rows as motion::FootPoint: 3 x 4. The heel lies behind the foot joint
/// by 0.3 of the foot's length, as high as the toe joint (motion/foot_contacts.h).
Eigen::Matrix<double, 3, 4> foot_points(const MapPose& pose) {
  const motion::Skeleton& body = *motion::standard_skeleton();
  Eigen::Matrix<double, 3, 4> points;
  const auto put = [&](int column, StandardJoint foot, StandardJoint toe) {
    const int f = motion::index_of(foot);
    const Vector3d to_toe = body.joint(motion::index_of(toe)).rest_offset;
    const Vector3d to_heel(0.0, to_toe.y(), -0.3 * to_toe.norm());
    points.col(column) =
        pose.positions.col(f) + pose.rotations[static_cast<std::size_t>(f)] * to_heel;
    points.col(column + 1) = pose.positions.col(motion::index_of(toe));
  };
  put(motion::index_of(motion::FootPoint::kLeftHeel), StandardJoint::kLeftFoot,
      StandardJoint::kLeftToe);
  put(motion::index_of(motion::FootPoint::kRightHeel), StandardJoint::kRightFoot,
      StandardJoint::kRightToe);
  return points;
}

Eigen::Vector4d contacts_at(const MapPose& pose) {
  return pose.channels.segment<4>(kContactRow).cwiseMax(0.0).cwiseMin(1.0);
}

Vector2d turned(const Vector2d& xz, double yaw) {
  const Vector3d p = math::yaw_rotation(yaw) * Vector3d(xz.x(), 0.0, xz.y());
  return {p.x(), p.z()};
}

/// The planar step from one pose to the next, in the map's heading frame of the first: metres on
/// the standard body, radians.
Vector3d step_between(const MapPose& a, const MapPose& b, double dt_s, Travel travel) {
  if (travel == Travel::kNone) return Vector3d::Zero();
  const Eigen::VectorXd known = 0.5 * (a.channels.segment(kVelocityRow, kPoseRowCount) +
                                       b.channels.segment(kVelocityRow, kPoseRowCount));
  const Eigen::VectorXd moved = b.channels.head(kPoseRowCount) - a.channels.head(kPoseRowCount);
  // Along with the captures 1, against them -1; nothing where they go both ways.
  constexpr double kStill = 0.3;  // m/s, length of the whole pose's velocity
  const double along =
      std::clamp(moved.dot(known) / (dt_s * (known.squaredNorm() + kStill * kStill)), -2.0, 2.0);
  Vector3d step =
      0.5 * along * dt_s * (a.channels.segment<3>(kStepRow) + b.channels.segment<3>(kStepRow));
  step.head<2>() *= motion::kStandardLegLengthM;
  if (travel == Travel::kPrimitives) return step;
  const auto from = foot_points(a);
  const auto to = foot_points(b);
  const Eigen::Vector4d weights = contacts_at(a).cwiseMin(contacts_at(b));
  const double free = 1.0 - weights.maxCoeff();
  Vector2d sum = free * step.head<2>();
  double total = free;
  for (int point = 0; point < motion::kFootPointCount; ++point) {
    const Vector2d held(from(0, point), from(2, point));
    const Vector2d now(to(0, point), to(2, point));
    sum += weights[point] * (held - turned(now, step.z()));
    total += weights[point];
  }
  step.head<2>() = sum / total;
  return step;
}

/// The poses of a path as a pose matrix, on a root path that `travel` gives.
motion::PoseMatrix pose_matrix_of(const std::vector<MapPose>& poses, double rate_hz,
                                  double leg_length_m, Travel travel) {
  const auto frames = static_cast<Index>(poses.size());
  motion::PoseMatrix result;
  result.frame_rate_hz = rate_hz;
  result.leg_length_m = leg_length_m;
  result.angles.resize(motion::kAngleRowCount, frames);
  result.height.resize(frames);
  Matrix3Xd path(3, frames);
  Vector3d at = Vector3d::Zero();  // x, z metres on the standard body; yaw of the map's heading
  for (Index f = 0; f < frames; ++f) {
    const MapPose& pose = poses[static_cast<std::size_t>(f)];
    if (f > 0) {
      const Vector3d step =
          step_between(poses[static_cast<std::size_t>(f - 1)], pose, 1.0 / rate_hz, travel);
      at.head<2>() += turned(step.head<2>(), at.z());
      at.z() += step.z();
    }
    // Inverse kinematics may turn the hips a little about the vertical: that is heading, not tilt.
    const double heading = math::heading_of(pose.rotations[0]);
    path.col(f) << at.head<2>() / motion::kStandardLegLengthM, at.z() + heading;
    result.height[f] = pose.positions(1, 0) / motion::kStandardLegLengthM;
    for (int s = 0; s < kStandardJointCount; ++s) {
      const int parent = motion::kStandardParents[static_cast<std::size_t>(s)];
      const Eigen::Quaterniond above = parent < 0
                                           ? math::yaw_rotation(heading)
                                           : pose.rotations[static_cast<std::size_t>(parent)];
      const Vector3d r = math::log(above.conjugate() * pose.rotations[static_cast<std::size_t>(s)]);
      result.angles.block<3, 1>(3 * s, f) =
          f == 0 ? r : math::nearest_branch(r, result.angles.block<3, 1>(3 * s, f - 1));
    }
  }
  result.steps = motion::planar_steps(path);
  return result;
}

/// The rig's stance at every frame, its free joints as the map says.
motion::Clip source_of(const ManifoldRig& rig, const std::vector<MapPose>& poses, double rate_hz) {
  const int joints = rig.stance.joint_count();
  std::vector<Eigen::Quaterniond> rotations;
  Matrix3Xd roots(3, std::ssize(poses));
  Matrix3Xd translations;
  if (rig.stance.has_translations()) translations.resize(3, std::ssize(poses) * joints);
  for (std::size_t f = 0; f < poses.size(); ++f) {
    const std::size_t begin = rotations.size();
    const auto stance = rig.stance.rotations(0);
    rotations.insert(rotations.end(), stance.begin(), stance.end());
    for (std::size_t e = 0; e < rig.free_joints.size(); ++e) {
      rotations[begin + static_cast<std::size_t>(rig.free_joints[e])] =
          from_two_axes(poses[f].channels.segment<6>(kFreeJointRow + 6 * static_cast<int>(e)));
    }
    roots.col(static_cast<Index>(f)) = rig.stance.root_positions().col(0);
    for (int j = 0; j < joints && rig.stance.has_translations(); ++j) {
      translations.col(static_cast<Index>(begin) + j) = rig.stance.translation(0, j);
    }
  }
  return {rig.stance.shared_skeleton(), rate_hz, std::move(roots), std::move(rotations),
          std::move(translations)};
}

motion::FootContacts contacts_of(const std::vector<MapPose>& poses, double rate_hz) {
  motion::FootContacts contacts{rate_hz, Eigen::Matrix4Xd(4, std::ssize(poses))};
  for (std::size_t f = 0; f < poses.size(); ++f) {
    contacts.share.col(static_cast<Index>(f)) = contacts_at(poses[f]);
  }
  return contacts;
}

}  // namespace

MapPath path_through(const PoseManifold& manifold, const Eigen::Ref<const Matrix2Xd>& waypoints,
                     std::optional<int> frames) {
  if (frames && *frames < 1) {
    throw Error(ErrorKind::kUsage,
                "path_through: frames = " + std::to_string(*frames) + " (must be >= 1)");
  }
  Matrix2Xd places = waypoints;
  for (Index n = 0; n < places.cols(); ++n) {
    places.col(n) = inside(manifold.region(), places.col(n));
  }
  const MapSpline spline(places);
  const TimedCurve curve = timed(manifold, spline);
  const double duration_s = curve.times_s.back();
  const int count =
      frames.value_or(1 + static_cast<int>(std::lround(duration_s * manifold.frame_rate_hz)));
  MapPath path;
  path.points = frames_along(manifold, spline, curve, duration_s, count);
  path.passed = frames_of_waypoints(spline, curve, duration_s, count);
  return path;
}

std::vector<std::string> WalkOptions::problems() const {
  std::vector<std::string> found;
  if (!(seconds > 0.0 && seconds <= 3600.0)) {
    found.push_back("WalkOptions::seconds = " + std::to_string(seconds) +
                    " (must be above 0, at most 3600)");
  }
  if (!(perturb >= 0.0 && std::isfinite(perturb))) {
    found.push_back("WalkOptions::perturb = " + std::to_string(perturb) + " (must be >= 0)");
  }
  return found;
}

MapPath markov_path(const PoseManifold& manifold, const Vector2d& start, const WalkOptions& options,
                    base::Rng& rng) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  const TransitionMatrix matrix = leaving(manifold.primitives);
  const ShortestWays ways(manifold);
  MapPath path;
  path.primitives = {manifold.primitive_at(start)};
  const int frames = 1 + static_cast<int>(std::lround(options.seconds * manifold.frame_rate_hz));
  double reached_s = -1.0;
  // A spline through few more places than needed: the walk doubles until its time is filled.
  for (std::size_t wanted = 16;; wanted *= 2) {
    while (path.primitives.size() < wanted) {
      const std::vector<int> more =
          walk_states(perturbed_leaving(matrix, options.perturb, rng), path.primitives.back());
      path.primitives.insert(path.primitives.end(), more.begin() + 1, more.end());
      if (more.size() > 1) continue;
      const int left =
          path.primitives.size() > 1 ? path.primitives[path.primitives.size() - 2] : -1;
      path.primitives.push_back(nearest_pose(manifold.primitives, path.primitives.back(), left));
      ++path.jumps;
    }
    const Route route = route_of(manifold.primitives, path.primitives, start, ways);
    const MapSpline spline(columns_of(route.places));
    const TimedCurve curve = timed(manifold, spline);
    // Primitives that do not differ: twice as many take no longer, and the body stands.
    const bool stands = curve.times_s.back() <= reached_s;
    reached_s = curve.times_s.back();
    if (reached_s < options.seconds && !stands) continue;
    const double duration_s = (frames - 1.0) / manifold.frame_rate_hz;
    path.points = frames_along(manifold, spline, curve, duration_s, frames);
    const std::vector<int> passed = frames_of_waypoints(spline, curve, duration_s, frames);
    for (const std::size_t mark : route.marks) {
      if (mark < passed.size()) path.passed.push_back(passed[mark]);
    }
    path.primitives.resize(path.passed.size());  // those that the time has reached
    return path;
  }
}

motion::Clip play(const PoseManifold& manifold, const MapPath& path, const PlayOptions& options) {
  if (path.points.cols() < 1) throw Error(ErrorKind::kData, "play: the path has no frame");
  std::vector<MapPose> poses;
  for (Index f = 0; f < path.points.cols(); ++f) {
    poses.push_back(solve_pose(manifold.generator.at(path.points.col(f)),
                               poses.empty() ? nullptr : &poses.back(),
                               kMostTurn / manifold.frame_rate_hz));
  }
  const ManifoldRig& rig = manifold.rig;
  const motion::PoseMatrix pose =
      pose_matrix_of(poses, manifold.frame_rate_hz, rig.humanoid.leg_length_m(), options.travel);
  motion::RetargetOptions retarget;
  retarget.start = motion::PlanarPose{};
  motion::Clip clip = motion::from_pose_matrix(
      pose, rig.humanoid, source_of(rig, poses, manifold.frame_rate_hz), retarget);
  if (!options.lock_feet || options.travel == Travel::kNone) return clip;
  motion::FootLockOptions locking;
  locking.floor = rig.floor;
  return motion::lock_feet(clip, rig.humanoid, contacts_of(poses, manifold.frame_rate_hz), locking)
      .clip;
}

}  // namespace laban::manifold
