#include "texture/pose_join.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "laban/texture/texton_synthesis.h"

namespace laban::texture {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Ref;

// Offsets up to a radian take three quarters of a second.
constexpr double kUsualFadeS = 0.75;
constexpr double kShortestFadeS = 0.25;
// A cubic that leaves with speed v and comes to rest at 0 over D frames goes 4/27 D v too far. Here
// at most about 8 degrees.
constexpr double kMostSpeedTimesFade = 0.94;

int fade_frames(double size, double speed, double rate_hz) {
  const double longest = std::clamp(kUsualFadeS * size, kUsualFadeS, kLongestFadeS) * rate_hz;
  const double fade = kMostSpeedTimesFade / std::max(1e-9, speed);
  return static_cast<int>(std::lround(std::clamp(fade, kShortestFadeS * rate_hz, longest)));
}

}  // namespace

MatrixXd offsets_between(const ObservationSpace& space, const Ref<const MatrixXd>& from,
                         const Ref<const MatrixXd>& to) {
  MatrixXd offsets(from.rows(), 2);
  offsets.col(0) = offset_between(space, from.col(0), to.col(0));
  offsets.col(1) = offset_between(space, from.col(1), to.col(1), offsets.col(0));
  return offsets;
}

MatrixXd halfway(const ObservationSpace& space, const Ref<const MatrixXd>& a,
                 const Ref<const MatrixXd>& b) {
  return with_offsets(space, a, 0.5 * offsets_between(space, a, b));
}

// Two curves, one for either end, so that neither depends on how long the motion is if it is longer
// than they are.
MatrixXd joint_offset_curve(double frame_rate_hz, int length, const Ref<const MatrixXd>& ends) {
  const auto one = [&](int begin) -> MatrixXd {
    const auto end = ends.middleCols(begin == 0 ? 0 : 2, 2);
    const double speed = (end.col(1) - end.col(0)).norm();
    const double size = std::max(end.col(0).norm(), end.col(1).norm());
    const int fade = std::min(length - 3, fade_frames(size, speed, frame_rate_hz));
    return ramp_between(length, {begin, begin + 1}, end, fade);
  };
  return one(0) + one(length - 2);
}

MatrixXd offset_curve(const MotionTexture& texture, int length, const Ref<const MatrixXd>& first,
                      const Ref<const MatrixXd>& last) {
  MatrixXd curve(first.rows(), length);
  MatrixXd ends(first.rows(), 4);
  ends << first, last;
  for (Index row = 0; row < first.rows();) {
    const Index rows = row == kStepRow - 1 ? 1 : 3;  // a joint, height, steps
    curve.middleRows(row, rows) =
        joint_offset_curve(texture.frame_rate_hz, length, ends.middleRows(row, rows));
    row += rows;
  }
  return curve;
}

}  // namespace laban::texture
