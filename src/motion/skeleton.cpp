#include "laban/motion/skeleton.h"

#include "laban/base/error.h"

namespace laban::motion {
namespace {

void require(bool holds, std::size_t index, const Joint& joint, const std::string& rule) {
  if (holds) return;
  throw base::Error(base::ErrorKind::kData,
                    "skeleton: joint " + std::to_string(index) + " '" + joint.name + "': " + rule);
}

}  // namespace

Skeleton::Skeleton(std::vector<Joint> joints) : joints_(std::move(joints)) {
  if (joints_.empty()) throw base::Error(base::ErrorKind::kData, "skeleton: it has no joints");
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    require(i == 0 ? joint.parent == -1 : joint.parent >= 0, i, joint,
            "the first joint must be the only root");
    require(joint.parent < static_cast<int>(i), i, joint, "a parent must come before its children");
    require(joint.rest_offset.allFinite(), i, joint, "the rest offset must be finite");
    require(!joint.end_site || joint.end_site->allFinite(), i, joint,
            "the end site must be finite");
  }
}

std::optional<int> Skeleton::find(std::string_view name) const {
  for (int i = 0; i < joint_count(); ++i) {
    if (joint(i).name == name) return i;
  }
  return std::nullopt;
}

std::vector<int> Skeleton::children(int index) const {
  std::vector<int> found;
  for (int i = index + 1; i < joint_count(); ++i) {
    if (joint(i).parent == index) found.push_back(i);
  }
  return found;
}

}  // namespace laban::motion
