#include "laban/transfer/play_choice.h"

#include <algorithm>

#include "laban/blend/space_time_interpolation.h"
#include "laban/motion/calm.h"

namespace laban::transfer {
namespace {

/// A blend may have so many times its parents' mean jerk, and at any moment so many times the
/// largest of theirs.
constexpr double kMostJerk = 1.2;
constexpr double kMostLocalJerk = 1.0;

/// Time warps for a blend at `alpha` in which no clip plays faster than `fastest` times: with
/// s = dq/dp and b beyond [0, 1], clip i plays at 1 / ((1 + b) s - b) where alpha = 1 + b, so
/// s >= (1 / fastest + b) / (1 + b); the same of clip j where alpha = -b.
align::TimeWarpOptions calm_warp(double alpha, double fastest) {
  const double beyond = std::max({0.0, -alpha, alpha - 1.0});
  align::TimeWarpOptions warp;
  warp.max_slope = std::min((1.0 + beyond) / (1.0 / fastest + beyond), align::kMaxWarpSlope);
  return warp;
}

/// A blend without the jerks that quick play and extrapolation make of its parents' trembling.
/// Where a time warp changes pace a blend may jerk for a moment: there it is held to what its
/// parents do at most.
motion::PoseMatrix calmed(const motion::PoseMatrix& pose, const motion::PoseMatrix& parent_i,
                          const motion::PoseMatrix& parent_j) {
  const double usual = 0.5 * (motion::rms_jerk_m_s3(parent_i) + motion::rms_jerk_m_s3(parent_j));
  const double largest = std::max(motion::local_jerk_m_s3(parent_i).maxCoeff(),
                                  motion::local_jerk_m_s3(parent_j).maxCoeff());
  return motion::calm_locally(
      motion::calm(pose, kMostJerk * usual),
      Eigen::RowVectorXd::Constant(pose.frame_count(), kMostLocalJerk * largest));
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
  return {calmed(made.pose, pose_i, pose_j), std::move(contacts)};
}

}  // namespace laban::transfer
