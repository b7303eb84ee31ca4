#include "loop/seam_search.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "laban/base/error.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"

#include "loop/foot_slack.h"
#include "loop/led_feet.h"

namespace laban::loop {
namespace {

// Places tried in full: cut, smoothed and measured.
constexpr int kTried = 12;
// A foot that stands in one clip and not in the other, metres.
constexpr double kContactPenaltyM = 0.05;
constexpr double kStandingWeight = 10.0;
// Of the clip, by one seam.
constexpr double kMostLeftOut = 2.0 / 3.0;
// A slide of 1 cm a frame is as bad as joints this many centimetres off all captured frames.
constexpr double kSlideWeight = 2.0;
// Seams beside the best are worth playing up to this multiple of what it is off.
constexpr double kMuchWorse = 1.5;
/// A frame as places of the overlap are compared: heading and place on the ground left out.
struct ComparedFrame {
  std::vector<Eigen::Quaterniond> rotations;  // of the hips the tilt
  double height_m = 0.0;
  Eigen::Vector2d velocity_m_s;  // in the heading frame
  double yaw_rate = 0.0;         // radians a second
  Eigen::Vector4d contacts;
};

std::vector<ComparedFrame> compared(const std::vector<BodyFrame>& frames, std::size_t begin,
                                    std::size_t count, double frame_rate_hz) {
  std::vector<ComparedFrame> result;
  for (std::size_t f = begin; f < begin + count; ++f) {
    const BodyFrame& frame = frames[f];
    ComparedFrame one;
    one.rotations = frame.rotations;
    const double yaw = math::heading_of(frame.rotations[0]);
    one.rotations[0] = math::yaw_rotation(-yaw) * frame.rotations[0];
    one.height_m = frame.hips.y();
    one.contacts = frame.contacts;
    const BodyFrame& before = frames[f > 0 ? f - 1 : f];
    const BodyFrame& after = frames[std::min(f + 1, frames.size() - 1)];
    const double time_s = (f > 0 && f + 1 < frames.size() ? 2.0 : 1.0) / frame_rate_hz;
    const Eigen::Vector3d velocity = math::yaw_rotation(-yaw) * (after.hips - before.hips) / time_s;
    one.velocity_m_s = {velocity.x(), velocity.z()};
    const double turned =
        math::heading_of(after.rotations[0]) - math::heading_of(before.rotations[0]);
    one.yaw_rate = math::nearest_angle(turned, 0.0) / time_s;
    result.push_back(std::move(one));
  }
  return result;
}

/// Metres a joint: angles times reach, height, what velocities part in `time_s`, feet.
double distance(const BodyRows& rows, const ComparedFrame& a, const ComparedFrame& b,
                double time_s) {
  double sum = 0.0;
  for (std::size_t r = 0; r < a.rotations.size(); ++r) {
    const double cosine = std::min(1.0, std::abs(a.rotations[r].dot(b.rotations[r])));
    // ||q - q'|| of the nearer sign.
    sum += rows.reach_m[static_cast<Eigen::Index>(r)] * 2.0 * std::sqrt(2.0 - 2.0 * cosine);
  }
  sum += std::abs(a.height_m - b.height_m) + time_s * (a.velocity_m_s - b.velocity_m_s).norm() +
         time_s * std::abs(a.yaw_rate - b.yaw_rate) * rows.reach_m[0];
  sum += kContactPenaltyM * (a.contacts - b.contacts).cwiseAbs().sum();
  return sum / static_cast<double>(a.rotations.size());
}

/// Places (i, j) of the overlap in the last m frames of one clip and the first m of the other.
struct Place {
  int i = 0;
  int j = 0;
  double distance_m = 0.0;
  double cost = 0.0;  // the distance, more where much of the clip is left out
};

/// Distances of all pairs of the last m frames of one clip and the first m of the other.
Eigen::MatrixXd pair_distances(const SeamTask& task, int m, int n) {
  const auto out = compared(task.outgoing, task.outgoing.size() - static_cast<std::size_t>(m),
                            static_cast<std::size_t>(m), task.frame_rate_hz);
  const auto in = compared(task.incoming, 0, static_cast<std::size_t>(m), task.frame_rate_hz);
  // Two velocities that differ part by a quarter of the overlap on average.
  const double time_s = 0.25 * n / task.frame_rate_hz;
  Eigen::MatrixXd pairs(m, m);
  for (int j = 0; j < m; ++j) {
    for (int i = 0; i < m; ++i) {
      pairs(i, j) = distance(task.rows, out[static_cast<std::size_t>(i)],
                             in[static_cast<std::size_t>(j)], time_s);
    }
  }
  return pairs;
}

/// All places of an overlap of n frames, the cheapest first.
std::vector<Place> places(const SeamTask& task, const Eigen::MatrixXd& pairs, int n) {
  const auto m = static_cast<int>(pairs.rows());
  std::vector<Place> found;
  for (int i = 0; i + n <= m; ++i) {
    for (int j = 0; j + n <= m; ++j) {
      const double distance_m = pairs.block(i, j, n, n).diagonal().mean();
      // After the overlap's middle nothing of the one is played, before it nothing of the other.
      const double left_out =
          static_cast<double>(m - i - n + j + n) / static_cast<double>(task.outgoing.size());
      found.push_back({i, j, distance_m, distance_m * (1.0 + left_out)});
    }
  }
  // A loop is to show at least a third of the clip, if the overlap allows.
  const auto shows_little = [](const Place& place) {
    return place.cost > (1.0 + kMostLeftOut) * place.distance_m;
  };
  if (!std::all_of(found.begin(), found.end(), shows_little)) std::erase_if(found, shows_little);
  std::stable_sort(found.begin(), found.end(),
                   [](const Place& a, const Place& b) { return a.cost < b.cost; });
  return found;
}

/// The best that are not near one another.
std::vector<Place> apart(const std::vector<Place>& sorted, int least, int count) {
  std::vector<Place> kept;
  for (const Place& place : sorted) {
    const bool near = std::any_of(kept.begin(), kept.end(), [&](const Place& other) {
      return std::abs(place.i - other.i) < least && std::abs(place.j - other.j) < least;
    });
    if (!near) kept.push_back(place);
    if (std::ssize(kept) == count) break;
  }
  return kept;
}

/// Mean over frames of the rms distance of the standard joints to the nearer of the two motions.
double off_captured_m(const BodyRows& rows, const std::vector<BodyFrame>& sewn,
                      const std::vector<BodyFrame>& outgoing,
                      const std::vector<BodyFrame>& incoming) {
  double sum = 0.0;
  for (std::size_t t = 0; t < sewn.size(); ++t) {
    // As seen from the hips: where over the ground a pose is taken does not matter.
    const auto pose = [&](const BodyFrame& frame) {
      Eigen::Matrix3Xd points = point_positions(rows, frame);
      points.colwise() -= Eigen::Vector3d(frame.hips.x(), 0.0, frame.hips.z());
      return points;
    };
    const Eigen::Matrix3Xd own = pose(sewn[t]);
    sum += std::min((own - pose(outgoing[t])).norm(), (own - pose(incoming[t])).norm());
  }
  return sum / static_cast<double>(sewn.size()) /
         std::sqrt(static_cast<double>(std::max<std::size_t>(1, rows.points.size())));
}

/// Sews at one place and measures the outcome.
SeamCandidate sew(const SeamTask& task, const JoinWindowOptions& options, const Place& place, int m,
                  int n) {
  const int out_begin = static_cast<int>(task.outgoing.size()) - m + place.i;
  const auto out = task.outgoing.begin() + out_begin;
  const auto in = task.incoming.begin() + place.j;
  SeamCandidate candidate;
  candidate.outgoing.assign(out, out + n);
  candidate.incoming.assign(in, in + n);
  candidate.blend_frames = blend_length(n, options.blend_frames);
  SewnSeam& seam = candidate.seam;
  seam.outgoing_from_incoming = align_overlap(task.rows, candidate.outgoing, candidate.incoming);
  for (BodyFrame& frame : candidate.incoming) frame.move(seam.outgoing_from_incoming);
  candidate.window = join_window(task.rows, candidate.outgoing, candidate.incoming, options);
  const FeetOverSeam feet =
      feet_over_seam(task.rows, candidate.outgoing, candidate.incoming, candidate.window,
                     candidate.blend_frames, task.frame_rate_hz, 0.0);
  seam.found = {out_begin, place.j, n, n, place.distance_m, candidate.window.switch_frames,
                0.0,       0.0};
  seam.join = candidate.window.switch_frames[0];
  // Of one foot, in a frame of a thirtieth of a second.
  const double slide_m = 0.5 * feet.slide_m * task.frame_rate_hz / (30.0 * n);
  seam.worth_m =
      off_captured_m(task.rows, candidate.window.frames, candidate.outgoing, candidate.incoming) +
      kSlideWeight * slide_m;
  // cost / distance is 1 + the share of the clip that is left out: a loop is to show the clip.
  const double shown = place.cost / std::max(1e-12, place.distance_m);
  seam.worth_m *= shown * shown;
  seam.frames = candidate.window.frames;
  measure_rates(task, seam);
  return candidate;
}

/// Seams of one length, best first: the good ones, at most `count`, or the best of the others.
std::vector<SeamCandidate> sew_apart(const SeamTask& task, const JoinWindowOptions& window,
                                     const Eigen::MatrixXd& pairs, int n, int count) {
  // Those that leave little out, then those that fit best.
  const auto m = static_cast<int>(pairs.rows());
  std::vector<Place> sorted = places(task, pairs, n);
  const int least_apart = std::max(1, n / 5);
  std::vector<Place> tried = apart(sorted, least_apart, std::max(kTried, count));
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Place& a, const Place& b) { return a.distance_m < b.distance_m; });
  const std::vector<Place> nearest = apart(sorted, least_apart, kTried);
  tried.insert(tried.end(), nearest.begin(), nearest.end());
  std::vector<SeamCandidate> seams;
  for (const Place& place : tried) seams.push_back(sew(task, window, place, m, n));
  std::stable_sort(seams.begin(), seams.end(), [](const SeamCandidate& a, const SeamCandidate& b) {
    return better(a.seam, b.seam);
  });
  std::vector<SeamCandidate> kept;
  for (SeamCandidate& one : seams) {
    if (std::ssize(kept) == count) break;
    const SewnSeam& seam = one.seam;
    // One place may be in both lists.
    const bool known = std::any_of(kept.begin(), kept.end(), [&](const SeamCandidate& other) {
      return std::abs(other.seam.found.out_begin - seam.found.out_begin) < least_apart &&
             std::abs(other.seam.found.in_begin - seam.found.in_begin) < least_apart;
    });
    const bool good = kept.empty() || (excess(seam) <= kGoodRates &&
                                       seam.worth_m <= kMuchWorse * kept.front().seam.worth_m);
    if (!known && good) kept.push_back(std::move(one));
  }
  return kept;
}

}  // namespace

int first_flowing_frame(const motion::Clip& clip, const motion::Humanoid& humanoid) {
  constexpr double kLeap = 1.5;
  constexpr int kMostLeading = 3;
  const Eigen::Matrix3Xd all = motion::joint_positions(clip);
  const Eigen::Index joints = clip.joint_count();
  const auto step = [&](Eigen::Index f) {
    double sum = 0.0;
    for (Eigen::Index j = 0; j < joints; ++j) {
      if (!humanoid.played_by(static_cast<int>(j))) continue;
      sum += (all.col((f + 1) * joints + j) - all.col(f * joints + j)).squaredNorm();
    }
    return std::sqrt(sum);
  };
  // What is left must still be long enough to be sewn.
  if (clip.frame_count() < 8 + 2 * kMostLeading) return 0;
  double largest = 0.0;
  for (int f = kMostLeading; f + 1 < clip.frame_count(); ++f) largest = std::max(largest, step(f));
  int first = kMostLeading;
  while (first > 0 && step(first - 1) <= kLeap * largest) --first;
  return first;
}

motion::Capture flowing(const motion::Capture& capture, int first_frame) {
  if (first_frame == 0) return capture;
  return {capture.clip.slice(first_frame, capture.clip.frame_count()), capture.humanoid};
}

PlanarMotion align_overlap(const BodyRows& rows, std::span<const BodyFrame> outgoing,
                           std::span<const BodyFrame> incoming) {
  // A point of the ground as the complex number z + i x: a turn by yaw is a factor exp(i yaw).
  using Complex = std::complex<double>;
  Complex a_sum;
  Complex b_sum;
  Complex product;
  double weight_sum = 0.0;
  const double n = static_cast<double>(outgoing.size());
  for (std::size_t t = 0; t < outgoing.size(); ++t) {
    const double bell = std::sin(std::numbers::pi * (static_cast<double>(t) + 0.5) / n);
    const Eigen::Matrix3Xd a_points = positions(rows, outgoing[t]);
    const Eigen::Matrix3Xd b_points = positions(rows, incoming[t]);
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(rows.count());
    for (const int row : rows.points) weights[row] = 1.0;
    for (std::size_t p = 0; p < rows.feet.size(); ++p) {
      const auto point = static_cast<Eigen::Index>(p);
      weights[rows.feet[p]] +=
          kStandingWeight * std::min(outgoing[t].contacts[point], incoming[t].contacts[point]);
    }
    for (Eigen::Index r = 0; r < rows.count(); ++r) {
      const double weight = bell * weights[r];
      if (weight == 0.0) continue;
      const Complex a(a_points(2, r), a_points(0, r));
      const Complex b(b_points(2, r), b_points(0, r));
      a_sum += weight * a;
      b_sum += weight * b;
      product += weight * a * std::conj(b);
      weight_sum += weight;
    }
  }
  const Complex covariance = product - a_sum * std::conj(b_sum) / weight_sum;
  PlanarMotion motion;
  motion.yaw = std::abs(covariance) > 1e-12 ? std::arg(covariance) : 0.0;
  const Complex shift = (a_sum - std::polar(1.0, motion.yaw) * b_sum) / weight_sum;
  motion.shift = {shift.imag(), 0.0, shift.real()};
  return motion;
}

std::vector<SewnSeam> find_seams(const SeamTask& task, const SeamOptions& options, int count) {
  const int shortest = static_cast<int>(std::min(task.outgoing.size(), task.incoming.size()));
  const bool same = &task.outgoing == &task.incoming;
  const int wanted = std::max(options.texton_frames,
                              static_cast<int>(std::lround(options.texton_s * task.frame_rate_hz)));
  // Both ends of one clip must not overlap: T >= 2 m.
  const int m = std::min(wanted, same ? shortest / 2 : shortest);
  const int n = m >= options.texton_frames ? options.overlap_frames
                                           : std::min(options.overlap_frames, std::max(4, m / 2));
  LABAN_CHECK(m >= n && n >= 4);
  const JoinWindowOptions window{options.metric, std::min(options.blend_frames, n - 2),
                                 options.poisson, options.joint_weight, options.screening};
  const Eigen::MatrixXd pairs = pair_distances(task, m, n);
  const SeamJudge judge(task);
  const auto sewn = [&](int length, int blend) {
    JoinWindowOptions with = window;
    with.blend_frames = std::clamp(blend, 1, length - 2);
    std::vector<SewnSeam> seams;
    for (SeamCandidate& candidate : sew_apart(task, with, pairs, length, count)) {
      lead_feet(task, judge, with, candidate);
      seams.push_back(std::move(candidate.seam));
    }
    return seams;
  };
  std::vector<SewnSeam> best = sewn(n, window.blend_frames);
  // Too quick: over a longer overlap or blend the same difference is smaller, and a shorter one may
  // find room in a calm moment.
  const int longer = std::min(m, 2 * n);
  const int shorter = std::max(4, n / 2);
  for (const auto& [length, blend] :
       {std::array{longer, window.blend_frames * longer / n}, std::array{n, n - 2},
        std::array{longer, longer - 2}, std::array{shorter, shorter - 2}}) {
    if (excess(best.front()) <= 1.0) break;
    std::vector<SewnSeam> others = sewn(length, blend);
    if (excess(others.front()) < excess(best.front())) best = std::move(others);
  }
  return best;
}

}  // namespace laban::loop
