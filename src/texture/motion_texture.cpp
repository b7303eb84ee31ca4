#include "laban/texture/motion_texture.h"

#include <cmath>

#include "laban/motion/foot_contacts.h"
#include "laban/motion/retarget.h"

namespace laban::texture {

motion::PoseMatrix standing_on_floor(const TextureRig& rig, motion::PoseMatrix pose) {
  if (!rig.floor) return pose;
  motion::RetargetOptions options;
  options.start = motion::PlanarPose{};
  const motion::Clip played = motion::from_pose_matrix(pose, rig.humanoid, rig.stance, options);
  const auto floor = motion::find_foot_contacts(played, rig.humanoid).floor;
  if (floor) pose.height.array() += (rig.floor->toe_m - floor->toe_m) / rig.humanoid.leg_length_m();
  return pose;
}

std::vector<int> segments_of(const MotionTexture& texture, int texton) {
  std::vector<int> found;
  for (int s = 0; s < static_cast<int>(texture.segments.size()); ++s)
    if (texture.segments[static_cast<std::size_t>(s)].texton == texton) found.push_back(s);
  return found;
}

double pose_distance(const MotionTexture& texture, const Segment& segment,
                     const Eigen::Ref<const Eigen::MatrixXd>& frames) {
  double squares = 0.0;
  for (Eigen::Index f = 0; f < 2; ++f) {
    squares +=
        offset_between(texture.space, texture.observations.col(segment.begin + f), frames.col(f))
            .squaredNorm();
  }
  return std::sqrt(squares);
}

Eigen::MatrixXd transition_matrix(const MotionTexture& texture) {
  Eigen::MatrixXd matrix = texture.transition_counts;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    const double sum = matrix.row(row).sum();
    if (sum > 0.0) matrix.row(row) /= sum;
  }
  return matrix;
}

}  // namespace laban::texture
