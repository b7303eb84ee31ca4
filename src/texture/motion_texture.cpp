#include "laban/texture/motion_texture.h"

#include <cmath>

namespace laban::texture {

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
