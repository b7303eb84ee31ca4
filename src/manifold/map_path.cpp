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

// ---- ways over the map ----

/// Whether a motion from one point to another is to leave the map between them: their poses are
/// alike, but the map has a fold there, so that the line between them passes through others. A map
/// of a cycle cannot be without.
bool lies_across_a_fold(const PoseManifold& manifold, const Vector2d& a, const Vector2d& b) {
  constexpr double kAlike = 0.1;   // metres a joint
  constexpr double kDetour = 2.0;  // so many times as far by the map
  constexpr double kProbe = 1.0;   // map units
  const auto steps = static_cast<Index>(std::ceil((b - a).norm() / kProbe));
  if (steps < 2) return false;
  Matrix2Xd line(2, steps + 1);
  for (Index n = 0; n <= steps; ++n) {
    line.col(n) = a + (b - a) * (static_cast<double>(n) / static_cast<double>(steps));
  }
  const MatrixXd poses = manifold.generator.at_all(line, kPoseRowCount);
  const double direct = mean_joint_distance(poses.col(0), poses.col(steps));
  double around = 0.0;
  for (Index n = 1; n <= steps; ++n) {
    around += mean_joint_distance(poses.col(n - 1), poses.col(n));
  }
  return direct < kAlike && around > kDetour * direct;
}

/// A place to pass, and the time since the one before if a capture tells it.
struct Stop {
  Vector2d place;
  std::optional<double> seconds;
};

/// Stops in order, in pieces: between two pieces lies a fold of the map.
struct Route {
  std::vector<std::vector<Stop>> pieces;
  std::vector<std::pair<std::size_t, std::size_t>> marks;  ///< piece and place of each waypoint
};

/// Adds a stop; one where the last is passes it once, as MapSpline does, so that its knots are the
/// stops. @returns whether a fold lies before it.
bool add_place(const PoseManifold& manifold, Route& route, const Vector2d& place,
               std::optional<double> seconds = std::nullopt) {
  if (route.pieces.empty()) {
    route.pieces.push_back({{place, std::nullopt}});
    return false;
  }
  const Vector2d last = route.pieces.back().back().place;
  if ((place - last).norm() < 1e-9) return false;
  const bool folded = lies_across_a_fold(manifold, last, place);
  if (folded) route.pieces.emplace_back();
  route.pieces.back().push_back({place, seconds});
  return folded;
}

void mark_place(Route& route) {
  route.marks.emplace_back(route.pieces.size() - 1, route.pieces.back().size() - 1);
}

Matrix2Xd places_of(const std::vector<Stop>& stops) {
  Matrix2Xd places(2, std::ssize(stops));
  for (std::size_t n = 0; n < stops.size(); ++n) places.col(static_cast<Index>(n)) = stops[n].place;
  return places;
}

// ---- timing ----

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

/// Splines through a route's pieces, with the time at which the body is at each of many points.
class TimedCurve {
 public:
  TimedCurve(const PoseManifold& manifold, const Route& route)
      : manifold_(manifold), usual_(median_speed(manifold)) {
    for (const auto& stops : route.pieces) {
      splines_.emplace_back(places_of(stops));
      add_spline(stops);
    }
    for (const auto& [piece, place] : route.marks) {
      marks_s_.push_back(knot_times_s_[piece][place]);
    }
  }

  [[nodiscard]] double duration_s() const { return samples_.back().time_s; }

  /// The path's frames, the last at `duration_s`.
  [[nodiscard]] MapPath path(double duration_s, int frames) const {
    MapPath path;
    path.points.resize(2, frames);
    std::size_t last_piece = 0;
    for (int f = 0; f < frames; ++f) {
      const auto [piece, u] = at(frames > 1 ? duration_s * f / (frames - 1.0) : 0.0);
      path.points.col(f) = inside(manifold_.region(), splines_[piece].at(u));
      if (piece != last_piece) path.cuts.push_back(f);
      last_piece = piece;
    }
    for (const double time : marks_s_) {
      if (time > duration_s + 1e-12) break;
      const double share = duration_s > 0.0 ? time / duration_s : 0.0;
      path.passed.push_back(static_cast<int>(std::lround(share * (frames - 1.0))));
    }
    return path;
  }

 private:
  struct Place {
    std::size_t piece = 0;
    double u = 0.0;  // parameter of its spline
  };
  struct Sample {
    Place place;
    double time_s = 0.0;  // ascending from 0
  };

  void add_spline(const std::vector<Stop>& stops) {
    constexpr double kStep = 0.25;  // map units
    const std::size_t piece = splines_.size() - 1;
    const MapSpline& spline = splines_.back();
    const auto& knots = spline.knots();
    const std::size_t before = samples_.size();
    add({piece, 0.0});
    stretch(before, stops.front().seconds);
    knot_times_s_.push_back({duration_s()});
    for (Index k = 1; k < knots.size(); ++k) {
      // Between two knots the spline is about as long as the straight line.
      const double line = (spline.at(knots[k]) - spline.at(knots[k - 1])).norm();
      const int steps = std::max(4, static_cast<int>(std::ceil(line / kStep)));
      const std::size_t begin = samples_.size();
      for (int i = 1; i <= steps; ++i) {
        add({piece, knots[k - 1] + (knots[k] - knots[k - 1]) * i / steps});
      }
      stretch(begin, stops[static_cast<std::size_t>(k)].seconds);
      knot_times_s_.back().push_back(duration_s());
    }
  }

  /// Gives the samples from `begin` on the time that a capture took, if one tells it.
  void stretch(std::size_t begin, std::optional<double> seconds) {
    if (!seconds || begin == 0) return;
    const double start = samples_[begin - 1].time_s;
    const double factor = *seconds / (duration_s() - start);
    if (!std::isfinite(factor)) return;  // no pose changes: the map's time is as good
    for (std::size_t n = begin; n < samples_.size(); ++n) {
      samples_[n].time_s = start + factor * (samples_[n].time_s - start);
    }
  }

  void add(const Place& place) {
    constexpr double kLeastAUnit_s = 1e-3;  // a map unit, where no joint moves
    const Region plane = manifold_.region();
    const Vector2d point = inside(plane, splines_[place.piece].at(place.u));
    const Eigen::VectorXd now = manifold_.generator.at(point, kTimingRows);
    double time = 0.0;
    if (!samples_.empty()) {
      const double speed =
          std::clamp(0.5 * (now[kSpeedRow] + before_[kSpeedRow]), usual_ / 3.0, usual_ * 3.0);
      const bool crosses = place.piece != samples_.back().place.piece;
      const double way = crosses ? 0.0 : (point - last_).norm();
      const double moved =
          mean_joint_distance(now.head(kPoseRowCount), before_.head(kPoseRowCount));
      time = duration_s() + std::max(moved / speed, kLeastAUnit_s * way);
    }
    before_ = now;
    last_ = point;
    samples_.push_back({place, time});
  }

  /// Where the curve is at a time, linear between samples; between two pieces at the nearer end.
  [[nodiscard]] Place at(double time_s) const {
    const auto after =
        std::upper_bound(samples_.begin(), samples_.end(), time_s,
                         [](double time, const Sample& sample) { return time < sample.time_s; });
    if (after == samples_.begin()) return samples_.front().place;
    if (after == samples_.end()) return samples_.back().place;
    const Sample& b = *after;
    const Sample& a = *(after - 1);
    const double share = (time_s - a.time_s) / (b.time_s - a.time_s);
    if (a.place.piece != b.place.piece) return share < 0.5 ? a.place : b.place;
    return {a.place.piece, a.place.u + share * (b.place.u - a.place.u)};
  }

  const PoseManifold& manifold_;
  double usual_;  // m/s
  std::vector<MapSpline> splines_;
  std::vector<std::vector<double>> knot_times_s_;  // of each spline
  std::vector<Sample> samples_;
  std::vector<double> marks_s_;
  Eigen::VectorXd before_;  // at the last sample
  Vector2d last_ = Vector2d::Zero();
};

// ---- walks ----

/// Transitions between different primitives only: what remains once each row's stay is taken out.
TransitionMatrix leaving(const Primitives& primitives) {
  MatrixXd counts = primitives.counts;
  counts.diagonal().setZero();
  return transition_matrix(counts);
}

/// What follows a primitive, given the one before it: as captured, where captures came the same
/// way. A cluster may hold the left and the right step; only where the walk comes from tells them
/// apart.
class Followers {
 public:
  explicit Followers(const PoseManifold& manifold) : matrix_(leaving(manifold.primitives)) {
    const std::vector<int>& labels = manifold.primitives.labels;
    const auto& takes = manifold.take_begins;
    std::vector<int> stays;
    for (std::size_t f = 0; f < labels.size(); ++f) {
      if (std::find(takes.begin(), takes.end(), static_cast<int>(f)) != takes.end()) stays.clear();
      if (!stays.empty() && stays.back() == labels[f]) continue;
      stays.push_back(labels[f]);
      if (stays.size() < 3) continue;
      auto& row = rows_[{stays[stays.size() - 3], stays[stays.size() - 2]}];
      if (row.size() == 0) row = Eigen::RowVectorXd::Zero(matrix_.cols());
      row[labels[f]] += 1.0;
    }
    for (auto& [from, row] : rows_) row /= row.sum();
  }

  /// A walk from `start`, on transitions with noise of their own.
  [[nodiscard]] std::vector<int> walk(int before, int start, double perturb, base::Rng& rng) const {
    const MatrixXd noise = perturbed(matrix_, perturb, rng) - matrix_;
    const auto row = [&](int from, int state) -> Eigen::RowVectorXd {
      const auto known = rows_.find({from, state});
      const Eigen::RowVectorXd clean =
          known != rows_.end() ? known->second : Eigen::RowVectorXd(matrix_.row(state));
      return (clean + noise.row(state)).cwiseMax(0.0);
    };
    return walk_states(row, static_cast<int>(matrix_.rows()), start, before);
  }

 private:
  TransitionMatrix matrix_;
  std::map<std::pair<int, int>, Eigen::RowVectorXd>
      rows_;  // by the primitive before and the one at
};

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
    poses_ = manifold.generator.at_all(nodes, kPoseRowCount);
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

/// How captures went from one primitive to another.
class CapturedWays {
 public:
  explicit CapturedWays(const PoseManifold& manifold)
      : manifold_(manifold),
        coordinates_(
            manifold.pca.transform(manifold.generator.at_all(manifold.points, kPoseRowCount))) {
    const std::vector<int>& labels = manifold.primitives.labels;
    const auto& takes = manifold.take_begins;
    for (std::size_t f = 0; f < labels.size(); ++f) {
      const int frame = static_cast<int>(f);
      const bool begins = std::find(takes.begin(), takes.end(), frame) != takes.end();
      if (f == 0 || begins || labels[f] != labels[f - 1]) {
        stays_.push_back({labels[f], frame, frame + 1, !begins && f > 0});
      } else {
        stays_.back().end = frame + 1;
      }
    }
  }

  /// The frames from the stay in which a motion is, at its frame or the nearest pose to it, to the
  /// frame that is nearest to the centre of the next primitive; empty if no capture went there.
  /// @param frame  where the motion is; -1 if it is at no frame, but at a point of the map.
  [[nodiscard]] std::vector<int> frames(int from, int to, int frame, const Vector2d& point) const {
    const Eigen::VectorXd here = frame >= 0 ? Eigen::VectorXd(coordinates_.col(frame))
                                            : Eigen::VectorXd(manifold_.pca.transform(
                                                  manifold_.generator.at(point, kPoseRowCount)));
    int begin = -1;
    const Stay* next = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t n = 1; n < stays_.size(); ++n) {
      const Stay& stay = stays_[n - 1];
      if (stay.primitive != from || stays_[n].primitive != to || !stays_[n].follows) continue;
      // Where the motion is already, nothing has to be crossed.
      const bool inside_it = frame >= stay.begin && frame < stay.end;
      const int nearest = inside_it ? frame : nearest_frame(stay, here);
      const double distance = inside_it ? -1.0 : (coordinates_.col(nearest) - here).norm();
      if (distance >= least) continue;
      least = distance;
      begin = nearest;
      next = &stays_[n];
    }
    if (next == nullptr) return {};
    std::vector<int> way;
    const int end = nearest_frame(*next, manifold_.primitives.coordinates.col(to));
    for (int f = begin; f <= end; ++f) way.push_back(f);
    return way;
  }

 private:
  struct Stay {
    int primitive = 0;
    int begin = 0;
    int end = 0;
    bool follows = false;  // the stay before, in the same take
  };

  [[nodiscard]] int nearest_frame(const Stay& stay, const Eigen::VectorXd& at) const {
    Index nearest = 0;
    (coordinates_.middleCols(stay.begin, stay.end - stay.begin).colwise() - at)
        .colwise()
        .squaredNorm()
        .minCoeff(&nearest);
    return stay.begin + static_cast<int>(nearest);
  }

  const PoseManifold& manifold_;
  MatrixXd coordinates_;  // of the map's poses at the captures' frames
  std::vector<Stay> stays_;
};

/// From `start` over the primitives after the first: as captures went from one to the next, and
/// where none did, by the shortest way to its centre.
Route route_of(const PoseManifold& manifold, const std::vector<int>& states, const Vector2d& start,
               const ShortestWays& ways, const CapturedWays& captured) {
  // The spline rounds what lies between: captures tremble from frame to frame.
  constexpr double kPlacesPerSecond = 30.0;
  const int every = std::max(1, static_cast<int>(manifold.frame_rate_hz / kPlacesPerSecond));
  Route route;
  static_cast<void>(add_place(manifold, route, start));
  mark_place(route);
  int frame = -1;
  for (std::size_t t = 1; t < states.size(); ++t) {
    const Vector2d here = route.pieces.back().back().place;
    const std::vector<int> known = captured.frames(states[t - 1], states[t], frame, here);
    int passed = frame;  // by the capture that the way before followed, if it is this one
    for (std::size_t n = 0; n < known.size(); ++n) {
      const Vector2d place = manifold.points.col(known[n]);
      const bool last = n + 1 == known.size();
      const bool breaks =
          !last && lies_across_a_fold(manifold, place, manifold.points.col(known[n + 1]));
      const bool broke =
          n > 0 && lies_across_a_fold(manifold, manifold.points.col(known[n - 1]), place);
      if (last || breaks || broke || n % static_cast<std::size_t>(every) == 0) {
        const bool goes_on = passed >= 0 && (n > 0 || passed == known.front());
        const bool folded = add_place(
            manifold, route, place,
            goes_on ? std::optional((known[n] - passed) / manifold.frame_rate_hz) : std::nullopt);
        // A walk does not wait at a fold: what poses differ by fades while it goes on.
        if (folded && !goes_on) route.pieces.back().back().seconds = 1.0 / manifold.frame_rate_hz;
        passed = known[n];
      }
    }
    frame = known.empty() ? -1 : known.back();
    if (known.empty()) {
      const Vector2d center = manifold.primitives.centers.col(states[t]);
      for (const Vector2d& place : ways.between(here, center)) {
        static_cast<void>(add_place(manifold, route, place));
      }
      static_cast<void>(add_place(manifold, route, center));
    }
    mark_place(route);
  }
  return route;
}

// ---- playing ----

// A bone turns about itself no faster, radians a second. Captures turn a straight arm about itself
// by half a turn from one frame to the next where their angles flip; a map that has learnt both
// sides would flip with them.
constexpr double kMostTurn = 12.0;

/// How far playing has come, by and by: poses of the map, rotations, the clip, feet held.
constexpr double kPosesFound = 0.3;
constexpr double kPosesSolved = 0.6;
constexpr double kOnRig = 0.8;

/// What the map says along a path, without a jump where it goes on elsewhere: what the poses differ
/// by there fades within 0.15 s, or to the end, as in motion/join.h.
MatrixXd smooth_channels(const PoseManifold& manifold, const MapPath& path) {
  constexpr double kFade_s = 0.15;
  MatrixXd channels = manifold.generator.at_all(path.points);
  for (const int cut : path.cuts) {
    if (cut < 1 || cut >= channels.cols()) continue;
    // The last frame is what was asked for.
    const Index fade =
        std::min<Index>(std::lround(kFade_s * manifold.frame_rate_hz), channels.cols() - 1 - cut);
    // Goes on at the speed it had, so that velocities do not jump either.
    Eigen::VectorXd offset = channels.col(cut - 1) - channels.col(cut);
    if (cut > 1) offset += channels.col(cut - 1) - channels.col(cut - 2);
    for (Index n = 0; n < fade; ++n) {
      const double u = static_cast<double>(n) / static_cast<double>(fade);
      channels.col(cut + n) += (1.0 - u * u * (3.0 - 2.0 * u)) * offset;
    }
  }
  return channels;
}

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

/// The rig's stance at every frame, its free joints as the map says, but without their flips.
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
      const auto joint = static_cast<std::size_t>(rig.free_joints[e]);
      const Eigen::Quaterniond wanted =
          from_two_axes(poses[f].channels.segment<6>(kFreeJointRow + 6 * static_cast<int>(e)));
      Eigen::Quaterniond& rotation = rotations[begin + joint];
      rotation = f == 0
                     ? wanted
                     : turned_towards(rotations[begin - static_cast<std::size_t>(joints) + joint],
                                      wanted, kMostTurn / rate_hz);
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
  if (waypoints.cols() < 1 || !waypoints.allFinite()) {
    throw Error(ErrorKind::kData, "path_through: " + std::to_string(waypoints.cols()) +
                                      " points (must be at least one, and finite)");
  }
  Route route;
  for (Index n = 0; n < waypoints.cols(); ++n) {
    static_cast<void>(add_place(manifold, route, inside(manifold.region(), waypoints.col(n))));
    mark_place(route);
  }
  const TimedCurve curve(manifold, route);
  const double duration_s = curve.duration_s();
  return curve.path(
      duration_s,
      frames.value_or(1 + static_cast<int>(std::lround(duration_s * manifold.frame_rate_hz))));
}

MapPath path_along(const PoseManifold& manifold, const Eigen::Ref<const Matrix2Xd>& points) {
  MapPath path;
  path.points.resize(2, points.cols());
  for (Index f = 0; f < points.cols(); ++f) {
    path.points.col(f) = inside(manifold.region(), points.col(f));
    if (f > 0 && lies_across_a_fold(manifold, path.points.col(f - 1), path.points.col(f))) {
      path.cuts.push_back(static_cast<int>(f));
    }
  }
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
                    base::Rng& rng, base::Progress* progress) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  const Followers followers(manifold);
  const ShortestWays ways(manifold);
  const CapturedWays captured(manifold);
  MapPath path;
  path.primitives = {manifold.primitive_at(start)};
  const int frames = 1 + static_cast<int>(std::lround(options.seconds * manifold.frame_rate_hz));
  double reached_s = -1.0;
  // A spline through few more places than needed: the walk doubles until its time is filled.
  for (std::size_t wanted = 16;; wanted *= 2) {
    while (path.primitives.size() < wanted) {
      const int before =
          path.primitives.size() > 1 ? path.primitives[path.primitives.size() - 2] : -1;
      const std::vector<int> more =
          followers.walk(before, path.primitives.back(), options.perturb, rng);
      path.primitives.insert(path.primitives.end(), more.begin() + 1, more.end());
      if (more.size() > 1) continue;
      path.primitives.push_back(nearest_pose(manifold.primitives, path.primitives.back(), before));
      ++path.jumps;
    }
    const TimedCurve curve(manifold, route_of(manifold, path.primitives, start, ways, captured));
    // Primitives that do not differ: twice as many take no longer, and the body stands.
    const bool stands = curve.duration_s() <= reached_s;
    reached_s = curve.duration_s();
    base::tell(progress, std::min(1.0, reached_s / options.seconds));
    if (reached_s < options.seconds && !stands) continue;
    const MapPath walked = curve.path((frames - 1.0) / manifold.frame_rate_hz, frames);
    path.points = walked.points;
    path.cuts = walked.cuts;
    path.passed = walked.passed;
    path.primitives.resize(path.passed.size());  // those that the time has reached
    return path;
  }
}

motion::Clip play(const PoseManifold& manifold, const MapPath& path, const PlayOptions& options,
                  base::Progress* progress) {
  if (path.points.cols() < 1) throw Error(ErrorKind::kData, "play: the path has no frame");
  std::vector<MapPose> poses;
  const MatrixXd channels = smooth_channels(manifold, path);
  for (Index f = 0; f < path.points.cols(); ++f) {
    base::tell(progress, kPosesFound + (kPosesSolved - kPosesFound) * static_cast<double>(f) /
                                           static_cast<double>(path.points.cols()));
    poses.push_back(solve_pose(channels.col(f), poses.empty() ? nullptr : &poses.back(),
                               kMostTurn / manifold.frame_rate_hz));
  }
  base::tell(progress, kPosesSolved);
  const ManifoldRig& rig = manifold.rig;
  const motion::PoseMatrix pose =
      pose_matrix_of(poses, manifold.frame_rate_hz, rig.humanoid.leg_length_m(), options.travel);
  motion::RetargetOptions retarget;
  retarget.start = motion::PlanarPose{};
  motion::Clip clip = motion::from_pose_matrix(
      pose, rig.humanoid, source_of(rig, poses, manifold.frame_rate_hz), retarget);
  if (!options.lock_feet || options.travel == Travel::kNone) return clip;
  base::tell(progress, kOnRig);
  motion::FootLockOptions locking;
  locking.floor = rig.floor;
  return motion::lock_feet(clip, rig.humanoid, contacts_of(poses, manifold.frame_rate_hz), locking)
      .clip;
}

}  // namespace laban::manifold
