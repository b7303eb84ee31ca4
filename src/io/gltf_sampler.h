#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "io/gltf_model.h"

namespace laban::io {

/// A channel as a function of time (glTF 2.0, appendix C): held before its first key and after its
/// last. A time within float32's precision of a key gives that key exactly.
class GltfSampler {
 public:
  GltfSampler() = default;
  /// `binary` must outlive the sampler.
  GltfSampler(const GltfChannel& channel, std::string_view binary)
      : channel_(channel), binary_(binary) {}

  /// Puts the channel's `width` numbers at a time into `values`; a rotation is a unit quaternion.
  void sample(double time_s, double* values) const;

  [[nodiscard]] Eigen::Vector3d vector(double time_s) const {
    Eigen::Vector3d value;
    sample(time_s, value.data());
    return value;
  }
  [[nodiscard]] Eigen::Quaterniond rotation(double time_s) const {
    Eigen::Quaterniond value;
    sample(time_s, value.coeffs().data());
    return value;
  }
  [[nodiscard]] const GltfChannel& channel() const noexcept { return channel_; }

 private:
  [[nodiscard]] double time_of(std::size_t key) const;
  /// A key's value (part 1), or the tangent that comes in (0) or goes out (2) of a spline's key.
  void read_key(std::size_t key, int part, double* values) const;
  void interpolate(std::size_t key, double share, double span_s, double* values) const;

  GltfChannel channel_;
  std::string_view binary_;
};

/// Where a node stands: `linear` turns and scales, `rotation` is the turn alone (the product of the
/// rotations on the way, which is what a joint shows wherever scales are uniform).
struct GltfPlace {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

/// The animated translation, rotation and scale of every node.
class GltfPlayer {
 public:
  /// Both must outlive the player.
  GltfPlayer(const GltfModel& model, std::string_view binary);

  /// The channel of a node's path, or nullptr.
  [[nodiscard]] const GltfSampler* find(int node, GltfPath path) const;
  [[nodiscard]] Eigen::Vector3d scale(int node, double time_s) const;
  /// A node's place within its parent's, at a time of the animation.
  [[nodiscard]] GltfPlace place(int node, const GltfPlace& parent, double time_s) const;
  /// A node's place when nothing is animated.
  [[nodiscard]] GltfPlace default_place(int node, const GltfPlace& parent) const;

 private:
  const GltfModel& model_;
  std::vector<GltfSampler> samplers_;
  std::vector<std::array<int, 4>> by_node_;  // samplers of a node's paths, -1 for none
};

}  // namespace laban::io
