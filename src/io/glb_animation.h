#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "laban/io/glb.h"

namespace laban::io {

/// Numbers of the glTF 2.0 specification.
inline constexpr int kGltfShort = 5122;
inline constexpr int kGltfUnsignedShort = 5123;
inline constexpr int kGltfFloat = 5126;

/// Appends bytes to a binary chunk, aligned to 4, and the buffer view that describes them to the
/// JSON; returns its index.
std::size_t append_view(nlohmann::json& asset, std::string& binary, std::string_view bytes);

/// Builds one animation of a GLB, track by track, each with a value a frame.
class GlbAnimation {
 public:
  /// @throws Error{kUsage} if `options.compact` has problems; Error{kData} if float32 cannot tell
  /// the
  ///         times of two frames apart.
  GlbAnimation(int frame_count, double frame_rate_hz, const GlbWriteOptions& options);

  /// Neighbours in one hemisphere, please: LINEAR goes the short way, but not all players do.
  void add_rotations(int node, std::span<const Eigen::Quaterniond> rotations);
  /// @param values     3 x F: translations or scales.
  /// @param tolerance  in their unit, for a compact animation.
  void add_vectors(int node, const char* path, const Eigen::Ref<const Eigen::MatrixXd>& values,
                   double tolerance, bool is_step = false);
  /// @param values  K x F weights of morph targets.
  void add_weights(int node, const Eigen::Ref<const Eigen::MatrixXd>& values, bool is_step = false);

  /// Appends data, views and accessors, and puts the animation before those that are there.
  void finish(nlohmann::json& asset, std::string& binary) &&;

 private:
  /// What an accessor will point at: bytes of one of the three blocks.
  struct Track {
    int node = 0;
    const char* path = "";
    bool is_step = false;
    std::size_t input = 0;  // index in inputs_
    bool is_short = false;  // int16 in shorts_, else float32 in floats_
    std::size_t begin = 0;
    std::size_t count = 0;
    const char* type = "";
  };
  struct Input {
    std::size_t begin = 0;  // in times_
    std::vector<int> keys;
  };

  [[nodiscard]] double time_of(int key) const;
  [[nodiscard]] std::size_t input_of(const std::vector<int>& keys);
  void add_floats(Track track, const std::vector<int>& keys,
                  const Eigen::Ref<const Eigen::MatrixXf>& values);
  void add_compact_rotations(int node, std::span<const Eigen::Quaterniond> rotations);
  /// The keys of a compact track; one alone where nothing ever moves.
  template <typename Same, typename Fits>
  [[nodiscard]] std::vector<int> keys_of(const Same& same_as_first, const Fits& fits);

  int frame_count_;
  double frame_rate_hz_;
  GlbWriteOptions options_;
  std::vector<float> times_s_;  // of all frames
  std::vector<int> all_keys_;
  std::map<std::vector<int>, std::size_t> known_inputs_;
  std::vector<Input> inputs_;
  std::vector<Track> tracks_;
  std::string times_, floats_, shorts_;
};

}  // namespace laban::io
