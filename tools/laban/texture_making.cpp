#include "texture_making.h"

#include <algorithm>
#include <map>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/reach.h"
#include "laban/motion/retarget.h"
#include "laban/texture/texton_synthesis.h"

namespace laban::cli {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::MatrixXd;

/// A motion's frames beside another texton's stay as they are.
constexpr int kMeeting = 2;

/// How far the work has come once a path is drawn.
constexpr double kDrawn = 0.5;
/// Over which what a texton cannot show of a pinned frame comes and goes.
constexpr int kRampFrames = 30;

/// Hips first, for all other places are told from them; elbows and knees last, for they go where
/// hands and feet leave them room.
void in_order_of_reach(std::vector<JointPin>& pins) {
  std::ranges::stable_sort(pins, {}, [](const JointPin& pin) {
    return std::pair(motion::is_limb_middle(pin.joint), motion::index_of(pin.joint));
  });
}

/// One observation with joints where their pins want them; all other joints, and steps, as before.
Eigen::VectorXd reached(const texture::MotionTexture& texture, const Eigen::VectorXd& observation,
                        std::vector<JointPin> pins) {
  const motion::Humanoid& humanoid = texture.rig.humanoid;
  motion::Clip clip = texture::play_observations(texture, observation, {.hold_feet = false});
  const auto hips = static_cast<std::size_t>(humanoid.mapped(motion::StandardJoint::kHips)->joint);
  in_order_of_reach(pins);
  for (const JointPin& pin : pins) {
    const motion::ModelPose pose = motion::forward_kinematics(clip, 0);
    const Eigen::Vector3d target =
        pose.positions.col(static_cast<Eigen::Index>(hips)) + pose.rotations[hips] * pin.place;
    clip = motion::reach(clip, 0, humanoid, pin.joint, target);
  }
  const MatrixXd moved = texture::on_branches_near(
      texture.space, texture::observe(texture.space, motion::to_pose_matrix(clip, humanoid)),
      observation);
  Eigen::VectorXd result = observation;
  for (const JointPin& pin : pins) {
    for (const motion::StandardJoint turned : motion::turned_for(pin.joint)) {
      const Eigen::Index row = 3 * motion::index_of(turned);
      result.segment<3>(row) = moved.block<3, 1>(row, 0);
    }
    if (pin.joint == motion::StandardJoint::kHips)
      result(motion::kAngleRowCount) = moved(motion::kAngleRowCount, 0);
  }
  return result;
}

void check_pin(const JointPin& pin, std::size_t block, std::size_t blocks, int length) {
  const int first = block == 0 ? 0 : kMeeting;
  const int last = length - 1 - (block + 1 == blocks ? 0 : kMeeting);
  if (pin.frame < first || pin.frame > last) {
    throw Error(ErrorKind::kUsage,
                fmt::format("a pin at frame {} of texton {} of the path: it can be pinned at its "
                            "frames {} to {}, beside which others meet it",
                            pin.frame, block, first, last));
  }
}

Eigen::Matrix3Xd path_of(const texture::MotionTexture& texture,
                         const Eigen::Ref<const MatrixXd>& observations) {
  return motion::planar_path(
      texture::poses_of(texture.space, observations, texture.frame_rate_hz, texture.leg_length_m));
}

/// How far a pin moves the hips over the ground: x and z in the heading frame, leg lengths.
Eigen::Vector2d hips_shift(const texture::MotionTexture& texture,
                           const Eigen::VectorXd& observation, const JointPin& pin) {
  const motion::Clip clip = texture::play_observations(texture, observation, {.hold_feet = false});
  const int hips = texture.rig.humanoid.mapped(motion::StandardJoint::kHips)->joint;
  const Eigen::Vector3d shift =
      motion::forward_kinematics(clip, 0).rotations[static_cast<std::size_t>(hips)] * pin.place;
  return Eigen::Vector2d(shift.x(), shift.z()) / texture.leg_length_m;
}

/// Leads the path of an edited texton through where pins want the hips, and otherwise where it led
/// before the edit: poses tell height alone, paths are sums of their steps.
void lead_hips(const texture::MotionTexture& texture, const std::vector<JointPin>& pins,
               const Eigen::Ref<const MatrixXd>& original, MatrixXd& edited) {
  const Eigen::Matrix3Xd before = path_of(texture, original);
  Eigen::Matrix3Xd path = path_of(texture, edited);
  const auto length = static_cast<int>(path.cols());
  const Eigen::Matrix2Xd back = before.topRows<2>() - path.topRows<2>();
  std::map<int, Eigen::Vector2d> moves;
  for (const int end : {0, 1, length - 2, length - 1}) moves[end] = back.col(end);
  for (const JointPin& pin : pins) {
    if (pin.joint != motion::StandardJoint::kHips) continue;
    const Eigen::Vector2d shift = hips_shift(texture, original.col(pin.frame), pin);
    // About +Y a positive turn takes z to x.
    moves[pin.frame] = back.col(pin.frame) + Eigen::Rotation2Dd(-before(2, pin.frame)) * shift;
  }
  std::vector<int> frames;
  MatrixXd values(2, std::ssize(moves));
  for (const auto& [frame, move] : moves) {
    values.col(std::ssize(frames)) = move;
    frames.push_back(frame);
  }
  path.topRows<2>() += texture::ramp_between(length, frames, values, kRampFrames);
  edited.block(texture::kStepRow, 1, 3, length - 1) =
      texture.space.scale.tail<3>().asDiagonal() * motion::planar_steps(path).rightCols(length - 1);
}

/// Solves a texton of the path anew through its pins.
PinnedTexton pin_texton(const texture::MotionTexture& texture, const TextonBlock& block,
                        Eigen::Ref<MatrixXd> observations, std::vector<int>& pinned_frames) {
  std::map<int, std::vector<JointPin>> by_frame;
  for (const JointPin& pin : block.pins) by_frame[pin.frame].push_back(pin);
  std::vector<texture::PinnedFrame> frames;
  for (const auto& [frame, pins] : by_frame) {
    frames.push_back({frame, reached(texture, observations.col(frame), pins)});
    pinned_frames.push_back(frame);
  }
  texture::EditedTexton edited =
      texture::edit_texton(texture.textons[static_cast<std::size_t>(block.planned.texton)],
                           observations, frames, kRampFrames);
  if (std::ranges::count(block.pins, motion::StandardJoint::kHips, &JointPin::joint) > 0)
    lead_hips(texture, block.pins, observations, edited.observations);
  observations = edited.observations;
  return {0, edited.state_deviations, edited.residual_deviations};
}

}  // namespace

texture::PathMotion draw_path(const texture::MotionTexture& texture, const TextureChoices& choices,
                              const texture::PathEnds& ends, base::Progress* progress) {
  std::vector<texture::PlannedTexton> path;
  for (const TextonBlock& block : choices.path) path.push_back(block.planned);
  return texture::synthesize_path(texture, path, ends, choices.options, progress);
}

MadeTexture play_path(const texture::MotionTexture& texture, const TextureChoices& choices,
                      texture::PathMotion motion, const texture::PathEnds& ends,
                      const motion::PlanarPose& start, base::Progress* progress) {
  texture::PlayOptions playing{.hold_feet = choices.options.hold_feet, .start = start};
  if (ends.from) playing.kept_frames = {0, static_cast<int>(motion.observations.cols()) - 1};
  std::vector<PinnedTexton> pinned;
  for (std::size_t n = 0; n < choices.path.size(); ++n) {
    const TextonBlock& block = choices.path[n];
    if (block.pins.empty()) continue;
    const texture::TextonPart& part = motion.parts[n];
    const auto length = static_cast<int>(part.end - part.begin);
    for (const JointPin& pin : block.pins) check_pin(pin, n, choices.path.size(), length);
    std::vector<int> frames;
    pinned.push_back(
        pin_texton(texture, block, motion.observations.middleCols(part.begin, length), frames));
    pinned.back().part = static_cast<int>(n);
    for (const int frame : frames)
      playing.kept_frames.push_back(static_cast<int>(part.begin) + frame);
  }
  std::sort(playing.kept_frames.begin(), playing.kept_frames.end());
  return {texture::play_observations(texture, motion.observations, playing, progress),
          std::move(motion.parts), std::move(pinned)};
}

MadeTexture make_texture(const texture::MotionTexture& texture, const TextureChoices& choices,
                         const texture::PathEnds& ends, const motion::PlanarPose& start,
                         base::Progress* progress) {
  base::ProgressPart drawing(progress, 0.0, kDrawn);
  base::ProgressPart playing(progress, kDrawn, 1.0);
  return play_path(texture, choices, draw_path(texture, choices, ends, &drawing), ends, start,
                   &playing);
}

}  // namespace laban::cli
