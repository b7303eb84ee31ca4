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

/// Rows of an observation that tell of a limb: of the joint it ends with and the two above, which
/// stand before it in the order of standard joints.
Eigen::Index first_row_of_limb(motion::StandardJoint end) {
  return 3 * (motion::index_of(end) - 2);
}
constexpr Eigen::Index kLimbRows = 9;

motion::Clip with_rotations(const motion::Clip& clip, std::vector<Eigen::Quaterniond> rotations) {
  Eigen::Matrix3Xd translations;
  if (clip.has_translations()) {
    translations.resize(3, clip.joint_count());
    for (int j = 0; j < clip.joint_count(); ++j) translations.col(j) = clip.translation(0, j);
  }
  return {clip.shared_skeleton(), clip.frame_rate_hz(), clip.root_positions(), std::move(rotations),
          std::move(translations)};
}

/// One observation with limbs where their pins want them; all other joints, and steps, as before.
Eigen::VectorXd reached(const texture::MotionTexture& texture, const Eigen::VectorXd& observation,
                        const std::vector<JointPin>& pins) {
  const motion::Humanoid& humanoid = texture.rig.humanoid;
  motion::Clip clip = texture::play_observations(texture, observation, {.hold_feet = false});
  const auto hips = static_cast<std::size_t>(humanoid.mapped(motion::StandardJoint::kHips)->joint);
  for (const JointPin& pin : pins) {
    const motion::ModelPose pose = motion::forward_kinematics(clip, 0);
    const Eigen::Vector3d target =
        pose.positions.col(static_cast<Eigen::Index>(hips)) + pose.rotations[hips] * pin.place;
    clip = with_rotations(clip, motion::reach(clip, 0, humanoid, pin.joint, target));
  }
  const MatrixXd moved = texture::on_branches_near(
      texture.space, texture::observe(texture.space, motion::to_pose_matrix(clip, humanoid)),
      observation);
  Eigen::VectorXd result = observation;
  for (const JointPin& pin : pins) {
    const Eigen::Index row = first_row_of_limb(pin.joint);
    result.segment<kLimbRows>(row) = moved.block<kLimbRows, 1>(row, 0);
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
  const texture::EditedTexton edited = texture::edit_texton(
      texture.textons[static_cast<std::size_t>(block.planned.texton)], observations, frames);
  observations = edited.observations;
  return {0, edited.state_deviations, edited.residual_deviations};
}

}  // namespace

MadeTexture make_texture(const texture::MotionTexture& texture, const TextureChoices& choices,
                         const texture::PathEnds& ends, const motion::PlanarPose& start,
                         base::Progress* progress) {
  std::vector<texture::PlannedTexton> path;
  for (const TextonBlock& block : choices.path) path.push_back(block.planned);
  base::ProgressPart solving(progress, 0.0, 0.5);
  texture::PathMotion motion =
      texture::synthesize_path(texture, path, ends, choices.options, &solving);
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
  base::ProgressPart showing(progress, 0.5, 1.0);
  return {texture::play_observations(texture, motion.observations, playing, &showing),
          std::move(motion.parts), std::move(pinned)};
}

}  // namespace laban::cli
