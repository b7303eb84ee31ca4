#include "laban/transfer/play_choice.h"

#include <algorithm>
#include <cmath>

#include "laban/blend/space_time_interpolation.h"
#include "laban/math/low_pass.h"

namespace laban::transfer {
namespace {

/// Time warps for a blend at `alpha` in which no clip plays faster than `fastest` times: with
/// s = dq/dp and b beyond [0, 1], clip i plays at 1 / ((1 + b) s - b) where alpha = 1 + b, so
/// s >= (1 / fastest + b) / (1 + b); the same of clip j where alpha = -b.
align::TimeWarpOptions calm_warp(double alpha, double fastest) {
  const double beyond = std::max({0.0, -alpha, alpha - 1.0});
  align::TimeWarpOptions warp;
  warp.max_slope = std::min((1.0 + beyond) / (1.0 / fastest + beyond), align::kMaxWarpSlope);
  return warp;
}

/// Root mean square of the third differences of all angles, per second cubed.
double jerk_of(const motion::PoseMatrix& pose) {
  const Eigen::Index count = pose.angles.cols() - 3;
  if (count < 1) return 0.0;
  const auto& x = pose.angles;
  const double squares = (x.rightCols(count) - 3.0 * x.middleCols(2, count) +
                          3.0 * x.middleCols(1, count) - x.leftCols(count))
                             .squaredNorm();
  return std::sqrt(squares / static_cast<double>(count * x.rows())) *
         std::pow(pose.frame_rate_hz, 3);
}

motion::PoseMatrix smoothed(const motion::PoseMatrix& pose, double cutoff_hz) {
  motion::PoseMatrix smooth = pose;
  smooth.angles = math::low_pass(pose.angles, pose.frame_rate_hz, cutoff_hz);
  smooth.height = math::low_pass(pose.height, pose.frame_rate_hz, cutoff_hz);
  smooth.steps = math::low_pass(pose.steps, pose.frame_rate_hz, cutoff_hz);
  smooth.steps.col(0) = smooth.steps.col(std::min<Eigen::Index>(1, smooth.steps.cols() - 1));
  return smooth;
}

/// A blend without the jerks that quick play and extrapolation make of its parents' trembling:
/// smoothed no more than brings its jerk down to theirs (joins and held feet add to it), and no
/// further than movement itself goes (the observer looks at what is below 4 Hz).
motion::PoseMatrix calmed(motion::PoseMatrix pose, const motion::PoseMatrix& parent_i,
                          const motion::PoseMatrix& parent_j) {
  constexpr double kMostJerk = 1.0;
  const double most = kMostJerk * 0.5 * (jerk_of(parent_i) + jerk_of(parent_j));
  if (jerk_of(pose) <= most) return pose;
  for (const double cutoff_hz : {12.0, 10.0, 8.0, 7.0, 6.0, 5.0, 4.0}) {
    motion::PoseMatrix smooth = smoothed(pose, cutoff_hz);
    if (jerk_of(smooth) <= most || cutoff_hz == 4.0) return smooth;
  }
  return pose;
}

motion::FootContacts contacts_of(const motion::PoseMatrix& pose) {
  return motion::find_foot_contacts(pose).contacts;
}

}  // namespace

PlayedChoice play_choice(const StyleModel& model, const BlendChoice& choice, double fastest_play) {
  const motion::PoseMatrix& pose_i =
      model.fragments[static_cast<std::size_t>(choice.fragment_i)].pose;
  if (choice.is_seed()) return {pose_i, contacts_of(pose_i)};
  const motion::PoseMatrix& pose_j =
      model.fragments[static_cast<std::size_t>(choice.fragment_j)].pose;
  blend::Blend made =
      blend::blend(align_pair(pose_i, pose_j, calm_warp(choice.alpha, fastest_play)), choice.alpha);
  motion::FootContacts contacts =
      blend::blend_contacts(made, choice.alpha, contacts_of(pose_i), contacts_of(pose_j));
  return {calmed(std::move(made.pose), pose_i, pose_j), std::move(contacts)};
}

}  // namespace laban::transfer
