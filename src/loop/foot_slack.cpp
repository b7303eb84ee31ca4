#include "loop/foot_slack.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "laban/base/error.h"

namespace laban::loop {
namespace {

using Eigen::Index;
using Frames = std::vector<BodyFrame>;

/// A foot moves half freely at this speed, leg lengths a second: between what standing feet of
/// captures wander at and what walking ones swing at.
constexpr double kHalfFree = 0.5;
/// What a foot that stands still gives, of what a swinging one does.
constexpr double kStandingSlack = 0.02;
/// Slack changes over so much of an overlap, to either side: a foot does not leap.
constexpr double kSmoothing = 0.1;

/// Paths of the rows named, 3 x N each.
struct Paths {
  std::array<Eigen::Matrix3Xd, 2> feet;
  std::array<Eigen::Matrix3Xd, 2> toes;
};

Paths paths_of(const BodyRows& rows, const Frames& frames) {
  Paths paths;
  for (std::size_t side = 0; side < 2; ++side) {
    paths.feet[side].resize(3, std::ssize(frames));
    paths.toes[side].resize(3, std::ssize(frames));
  }
  for (Index t = 0; t < std::ssize(frames); ++t) {
    const Eigen::Matrix3Xd places = positions(rows, frames[static_cast<std::size_t>(t)]);
    for (std::size_t side = 0; side < 2; ++side) {
      paths.feet[side].col(t) = places.col(rows.feet[2 * side]);
      paths.toes[side].col(t) = places.col(rows.toes[side]);
    }
  }
  return paths;
}

/// Mean of the steps around each, weighted by a tent of `reach` to either side.
Eigen::VectorXd smoothed(const Eigen::VectorXd& values, Index reach) {
  Eigen::VectorXd result(values.size());
  for (Index t = 0; t < values.size(); ++t) {
    double sum = 0.0;
    double weights = 0.0;
    for (Index k = -reach; k <= reach; ++k) {
      const Index at = t + k;
      if (at < 0 || at >= values.size()) continue;
      const auto weight = static_cast<double>(reach + 1 - std::abs(k));
      sum += weight * values[at];
      weights += weight;
    }
    result[t] = sum / weights;
  }
  return result;
}

}  // namespace

FeetOverSeam feet_over_seam(const BodyRows& rows, const Frames& outgoing, const Frames& incoming,
                            const JoinedWindow& window, int blend_frames, double frame_rate_hz) {
  const Index N = std::ssize(window.frames);
  LABAN_CHECK(std::ssize(outgoing) == N && std::ssize(incoming) == N && N >= 2);
  const Paths a = paths_of(rows, outgoing);
  const Paths b = paths_of(rows, incoming);
  const Paths x = paths_of(rows, window.frames);
  const double half_free_m = kHalfFree * rows.leg_length_m / frame_rate_hz;
  FeetOverSeam over;
  for (std::size_t side = 0; side < 2; ++side) {
    const int own = window.switch_frames[static_cast<std::size_t>(rows.feet[2 * side])];
    Eigen::Matrix3Xd steps(3, N - 1);
    Eigen::VectorXd stands(N - 1);
    for (Index t = 0; t + 1 < N; ++t) {
      const double out = outgoing_share(static_cast<double>(t) + 0.5, own, blend_frames);
      steps.col(t) = out * (a.toes[side].col(t + 1) - a.toes[side].col(t)) +
                     (1.0 - out) * (b.toes[side].col(t + 1) - b.toes[side].col(t));
      // By speed, not by contact: floors of captures are not level, and their contacts have gaps.
      const auto still = [&](const Eigen::Matrix3Xd& toe) {
        const double free = (toe.col(t + 1) - toe.col(t)).norm() / half_free_m;
        return 1.0 / (1.0 + free * free);
      };
      stands[t] = out * still(a.toes[side]) + (1.0 - out) * still(b.toes[side]);
    }
    Eigen::VectorXd slack = (1.0 - stands.array()) + kStandingSlack;
    slack = smoothed(slack, std::max<Index>(1, std::lround(kSmoothing * static_cast<double>(N))));
    for (Index t = 0; t + 1 < N; ++t) {
      // No step changes at the overlap's ends, where captured ones go on.
      const double sine =
          std::sin(std::numbers::pi * (static_cast<double>(t) + 0.5) / static_cast<double>(N - 1));
      slack[t] *= sine * sine;
    }
    slack /= slack.sum();
    const Eigen::Vector3d missing =
        b.toes[side].col(N - 1) - a.toes[side].col(0) - steps.rowwise().sum();
    over.slide_m += std::hypot(missing.x(), missing.z()) * slack.dot(stands);
    Eigen::Vector3d toe = a.toes[side].col(0);
    over.goals[side] = x.feet[side];
    for (Index t = 1; t + 1 < N; ++t) {
      toe += steps.col(t - 1) + slack[t - 1] * missing;
      over.goals[side].col(t) += toe - x.toes[side].col(t);
    }
  }
  return over;
}

}  // namespace laban::loop
