#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

namespace laban::motion {

/// One joint of a skeleton at rest.
struct Joint {
  std::string name;
  int parent = -1;  ///< index of the parent joint, -1 for the root
  Eigen::Vector3d rest_offset = Eigen::Vector3d::Zero();  ///< from the parent, parent space, metres
  /// Where the bone of a leaf joint ends, joint space, metres; absent where the file gives none.
  std::optional<Eigen::Vector3d> end_site;
};

/// A tree of named joints with rest offsets; every rest rotation is the identity. Immutable; clips
/// share one through shared_ptr<const Skeleton>.
///
/// Invariant: at least one joint; joint 0 is the only root; a parent comes before its children; all
/// offsets are finite. Names may repeat (files do); the first joint of a name is found by it.
class Skeleton {
 public:
  /// @throws Error{kData} naming the first joint that breaks the invariant.
  explicit Skeleton(std::vector<Joint> joints);

  [[nodiscard]] int joint_count() const noexcept { return static_cast<int>(joints_.size()); }
  [[nodiscard]] const Joint& joint(int index) const {
    return joints_.at(static_cast<std::size_t>(index));
  }
  [[nodiscard]] const std::vector<Joint>& joints() const noexcept { return joints_; }
  /// The first joint of that exact name, if any.
  [[nodiscard]] std::optional<int> find(std::string_view name) const;
  /// Children of a joint, in joint order.
  [[nodiscard]] std::vector<int> children(int index) const;

 private:
  std::vector<Joint> joints_;
};

}  // namespace laban::motion
