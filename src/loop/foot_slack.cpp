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

/// Both motions' own steps by their shares, and how much of them is a standing foot's.
struct Steps {
  Eigen::Matrix3Xd steps;  // 3 x (N - 1)
  Eigen::VectorXd stands;  // 0 .. 1
};

Steps steps_of(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b,
               const Eigen::VectorXd& outgoing_shares, double half_free_m) {
  Steps mean{Eigen::Matrix3Xd(3, outgoing_shares.size()), Eigen::VectorXd(outgoing_shares.size())};
  for (Index t = 0; t < outgoing_shares.size(); ++t) {
    const double out = outgoing_shares[t];
    const Eigen::Vector3d a_step = a.col(t + 1) - a.col(t);
    const Eigen::Vector3d b_step = b.col(t + 1) - b.col(t);
    mean.steps.col(t) = out * a_step + (1.0 - out) * b_step;
    // By speed, not by contact: floors of captures are not level, and their contacts have gaps.
    const auto still = [&](const Eigen::Vector3d& step) {
      const double free = step.norm() / half_free_m;
      return 1.0 / (1.0 + free * free);
    };
    mean.stands[t] = out * still(a_step) + (1.0 - out) * still(b_step);
  }
  return mean;
}

/// How freely each step may change.
Eigen::VectorXd slack_of(const Eigen::VectorXd& stands) {
  const auto count = static_cast<double>(stands.size());
  Eigen::VectorXd slack = (1.0 - stands.array()) + kStandingSlack;
  slack = smoothed(slack, std::max<Index>(1, std::lround(kSmoothing * (count + 1.0))));
  for (Index t = 0; t < slack.size(); ++t) {
    // No step changes at the overlap's ends, where captured ones go on.
    const double sine = std::sin(std::numbers::pi * (static_cast<double>(t) + 0.5) / count);
    slack[t] *= sine * sine;
  }
  return slack;
}

/// The path d, zero at both ends, of least sum |d(t+1) - d(t) - steps(t)|^2 / slack(t) + pull
/// |d(t)|^2: a tridiagonal system, solved by elimination. 3 x (steps + 1).
Eigen::Matrix3Xd rebuilt(const Eigen::Matrix3Xd& steps, const Eigen::VectorXd& slack, double pull) {
  const Index unknowns = steps.cols() - 1;
  const Eigen::VectorXd weights = slack.cwiseInverse();
  Eigen::VectorXd diagonal(unknowns);
  Eigen::Matrix3Xd d = Eigen::Matrix3Xd::Zero(3, steps.cols() + 1);
  for (Index k = 0; k < unknowns; ++k) {
    diagonal[k] = weights[k] + weights[k + 1] + pull;
    d.col(k + 1) = weights[k] * steps.col(k) - weights[k + 1] * steps.col(k + 1);
    if (k == 0) continue;
    const double factor = weights[k] / diagonal[k - 1];
    diagonal[k] -= factor * weights[k];
    d.col(k + 1) += factor * d.col(k);
  }
  for (Index k = unknowns; k-- > 0;) {
    d.col(k + 1) = (d.col(k + 1) + weights[k + 1] * d.col(k + 2)) / diagonal[k];
  }
  return d;
}

}  // namespace

std::array<Eigen::VectorXd, 2> step_shares(const BodyRows& rows,
                                           const std::vector<int>& switch_frames,
                                           int overlap_frames, int blend_frames) {
  std::array<Eigen::VectorXd, 2> shares;
  for (std::size_t side = 0; side < 2; ++side) {
    const int own = switch_frames[static_cast<std::size_t>(rows.feet[2 * side])];
    shares[side].resize(overlap_frames - 1);
    for (Index t = 0; t < shares[side].size(); ++t) {
      shares[side][t] = outgoing_share(static_cast<double>(t) + 0.5, own, blend_frames);
    }
  }
  return shares;
}

void note_added_steps(const BodyRows& rows, const Frames& outgoing, const Frames& incoming,
                      const std::array<Eigen::VectorXd, 2>& outgoing_shares, Frames& frames) {
  const Paths a = paths_of(rows, outgoing);
  const Paths b = paths_of(rows, incoming);
  const Paths x = paths_of(rows, frames);
  for (std::size_t side = 0; side < 2; ++side) {
    const auto step = [&](const Paths& paths, Index t) -> Eigen::Vector3d {
      return paths.toes[side].col(t + 1) - paths.toes[side].col(t);
    };
    for (Index t = 0; t + 1 < std::ssize(frames); ++t) {
      const double out = outgoing_shares[side][t];
      frames[static_cast<std::size_t>(t + 1)].added_steps.col(static_cast<Index>(side)) =
          step(x, t) - out * step(a, t) - (1.0 - out) * step(b, t);
    }
  }
}

FeetOverSeam feet_over_seam(const BodyRows& rows, const Frames& outgoing, const Frames& incoming,
                            const JoinedWindow& window, int blend_frames, double frame_rate_hz,
                            double pull_per_s) {
  const Index N = std::ssize(window.frames);
  LABAN_CHECK(std::ssize(outgoing) == N && std::ssize(incoming) == N && N >= 2);
  const Paths a = paths_of(rows, outgoing);
  const Paths b = paths_of(rows, incoming);
  const Paths x = paths_of(rows, window.frames);
  const auto shares = step_shares(rows, window.switch_frames, static_cast<int>(N), blend_frames);
  const double pull = std::pow(pull_per_s / frame_rate_hz, 2.0);
  FeetOverSeam over;
  for (std::size_t side = 0; side < 2; ++side) {
    const Steps mean = steps_of(a.toes[side], b.toes[side], shares[side],
                                kHalfFree * rows.leg_length_m / frame_rate_hz);
    const Eigen::Matrix3Xd& toe = x.toes[side];
    const Eigen::Matrix3Xd wanted = mean.steps - (toe.rightCols(N - 1) - toe.leftCols(N - 1));
    const Eigen::Matrix3Xd path = rebuilt(wanted, slack_of(mean.stands), pull);
    over.goals[side] = x.feet[side] + path;
    const Eigen::Matrix3Xd added = path.rightCols(N - 1) - path.leftCols(N - 1) - wanted;
    for (Index t = 0; t + 1 < N; ++t) {
      over.slide_m += std::hypot(added(0, t), added(2, t)) * mean.stands[t];
    }
  }
  return over;
}

}  // namespace laban::loop
