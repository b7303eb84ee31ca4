#include "io/travel.h"

namespace laban::io {
namespace {

// Far above what a stretching spine or a sliding shoulder blade moves, far below a step.
constexpr double kTravelM = 0.05;

}  // namespace

std::vector<bool> travelling_joints(const motion::Clip& clip) {
  const auto count = static_cast<std::size_t>(clip.joint_count());
  std::vector<bool> travels(count, false);
  if (!clip.has_translations()) return travels;
  for (std::size_t j = 1; j < count; ++j) {
    const int joint = static_cast<int>(j);
    Eigen::Vector3d least = clip.translation(0, joint);
    Eigen::Vector3d most = least;
    for (int f = 1; f < clip.frame_count(); ++f) {
      least = least.cwiseMin(clip.translation(f, joint));
      most = most.cwiseMax(clip.translation(f, joint));
    }
    travels[j] = (most - least).maxCoeff() > kTravelM;
  }
  return travels;
}

}  // namespace laban::io
