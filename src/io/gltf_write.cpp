#include <cmath>

#include "laban/base/error.h"
#include "laban/io/gltf.h"
#include "laban/math/rotation.h"
#include "laban/motion/forward_kinematics.h"

#include "io/glb_animation.h"
#include "io/gltf_asset.h"
#include "io/gltf_mend.h"
#include "io/gltf_sampler.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using nlohmann::json;

// A node that stays so near to its own transform needs no channel.
constexpr double kSameAngleRad = 1e-7;
constexpr double kSameOffset = 1e-6;  // in parts of the offset, or of one unit
// Of scales and weights, in a compact animation.
constexpr double kScaleTolerance = 1e-4;

/// Times of the source's animation that the frames of a clip show.
std::vector<double> source_times(const GltfAsset& asset, const motion::Clip& clip,
                                 std::span<const double> source_frames) {
  const auto frames = static_cast<std::size_t>(clip.frame_count());
  if (!source_frames.empty() && source_frames.size() != frames) {
    throw Error(ErrorKind::kUsage, "write_glb: " + std::to_string(source_frames.size()) +
                                       " source frames for " + std::to_string(frames) + " frames");
  }
  std::vector<double> times;
  for (std::size_t f = 0; f < frames; ++f) {
    const double played_s = source_frames.empty() ? static_cast<double>(f) / clip.frame_rate_hz()
                                                  : source_frames[f] / asset.frame_rate_hz;
    if (!std::isfinite(played_s)) {
      throw Error(ErrorKind::kUsage,
                  "write_glb: source frame " + std::to_string(f) + " is not finite");
    }
    times.push_back(asset.begin_s + played_s);
  }
  return times;
}

/// Local transforms of one joint's node over the clip.
struct NodeTrack {
  std::vector<Quaterniond> rotations;
  Eigen::MatrixXd translations;  // 3 x F, the file's unit
  double scale_above = 1.0;      // metres per unit of `translations`
};

/// Turns a clip on an asset's skeleton back into what its nodes do.
class NodeSolver {
 public:
  NodeSolver(const GltfAsset& asset, const GltfPlayer& player, int frames)
      : asset_(asset), player_(player), places_(asset.joints.size()), tracks_(asset.joints.size()) {
    joint_of_.assign(asset.model.nodes.size(), -1);
    for (std::size_t j = 0; j < tracks_.size(); ++j) {
      joint_of_[at(asset.joints[j].node)] = static_cast<int>(j);
      tracks_[j].rotations.resize(at(frames));
      tracks_[j].translations.resize(3, frames);
    }
  }

  void solve(const motion::ModelPose& pose, int frame, double time_s) {
    GltfPlace above;
    for (const int node : asset_.ancestors) above = player_.place(node, above, time_s);
    for (std::size_t j = 0; j < places_.size(); ++j) {
      const GltfJoint& joint = asset_.joints[j];
      const GltfPlace& parent = j == 0 ? above : places_[parent_of(joint.node)];
      solve_joint(j, parent, pose.rotations[j] * joint.rest_rotation,
                  pose.positions.col(static_cast<Eigen::Index>(j)) / asset_.unit_m, frame, time_s);
    }
  }

  [[nodiscard]] std::vector<NodeTrack>& tracks() noexcept { return tracks_; }

 private:
  [[nodiscard]] std::size_t parent_of(int node) const {
    return at(joint_of_[at(asset_.model.nodes[at(node)].parent)]);
  }

  void solve_joint(std::size_t j, const GltfPlace& parent, const Quaterniond& model_from_node,
                   const Vector3d& position, int frame, double time_s) {
    const int node = asset_.joints[j].node;
    NodeTrack& track = tracks_[j];
    const Eigen::FullPivLU<Eigen::Matrix3d> linear(parent.linear);
    // Below a scale of nothing every offset is as good.
    const Vector3d offset = linear.isInvertible()
                                ? Vector3d(linear.solve(position - parent.position))
                                : asset_.model.nodes[at(node)].translation;
    Quaterniond local = (parent.rotation.conjugate() * model_from_node).normalized();
    if (frame > 0) local = math::same_hemisphere(local, track.rotations[at(frame - 1)]);
    track.rotations[at(frame)] = local;
    track.translations.col(frame) = offset;
    track.scale_above = asset_.unit_m * std::cbrt(std::abs(parent.linear.determinant()));
    places_[j].rotation = model_from_node;
    places_[j].position = position;
    places_[j].linear =
        parent.linear * local.toRotationMatrix() * player_.scale(node, time_s).asDiagonal();
  }

  const GltfAsset& asset_;
  const GltfPlayer& player_;
  std::vector<int> joint_of_;
  std::vector<GltfPlace> places_;
  std::vector<NodeTrack> tracks_;
};

bool turns(const GltfNode& node, const NodeTrack& track) {
  for (const Quaterniond& q : track.rotations) {
    if (math::angle_between(q, node.rotation) > kSameAngleRad) return true;
  }
  return false;
}

bool moves(const GltfNode& node, const NodeTrack& track) {
  const double same =
      kSameOffset * std::max(node.translation.norm(), 1.0 / track.scale_above * 1e-1);
  return (track.translations.colwise() - node.translation).colwise().norm().maxCoeff() > same;
}

json numbers(const double* values, std::size_t count) {
  json list = json::array();
  for (std::size_t i = 0; i < count; ++i) list.push_back(static_cast<float>(values[i]));
  return list;
}

/// An animated node may have no matrix: the same transform as translation, rotation and scale.
void split_matrix(json& node, const GltfNode& source) {
  if (node.erase("matrix") == 0) return;
  node["translation"] = numbers(source.translation.data(), 3);
  node["rotation"] = numbers(source.rotation.coeffs().data(), 4);
  node["scale"] = numbers(source.scale.data(), 3);
}

void add_joint_tracks(const GltfAsset& asset, const GltfPlayer& player, NodeSolver& solver,
                      const GlbWriteOptions& options, GlbAnimation& animation, json& nodes) {
  const double tolerance_m = options.compact ? options.compact->translation_tolerance_m : 0.0;
  for (std::size_t j = 0; j < asset.joints.size(); ++j) {
    const int index = asset.joints[j].node;
    const GltfNode& node = asset.model.nodes[at(index)];
    const NodeTrack& track = solver.tracks()[j];
    // The root is always there, so that the animation lasts as long as the clip.
    const bool has_rotation =
        j == 0 || player.find(index, GltfPath::kRotation) != nullptr || turns(node, track);
    const bool has_translation =
        j == 0 || player.find(index, GltfPath::kTranslation) != nullptr || moves(node, track);
    if (has_rotation) animation.add_rotations(index, track.rotations);
    if (has_translation) {
      const double scale = track.scale_above > 0.0 ? track.scale_above : 1.0;
      animation.add_vectors(index, "translation", track.translations, tolerance_m / scale);
    }
    if (has_rotation || has_translation) split_matrix(nodes[at(index)], node);
  }
}

/// Plays a channel that no joint of the clip replaces at the source's times.
void add_warped(const GltfSampler& sampler, const std::vector<double>& times,
                GlbAnimation& animation) {
  const GltfChannel& channel = sampler.channel();
  Eigen::MatrixXd values(channel.width, static_cast<Eigen::Index>(times.size()));
  for (std::size_t f = 0; f < times.size(); ++f) {
    sampler.sample(times[f], values.col(static_cast<Eigen::Index>(f)).data());
  }
  const bool is_step = channel.interpolation == GltfInterpolation::kStep;
  switch (channel.path) {
    case GltfPath::kRotation: {
      std::vector<Quaterniond> rotations;
      for (Eigen::Index f = 0; f < values.cols(); ++f) {
        Quaterniond q(values.col(f).data());
        if (f > 0) q = math::same_hemisphere(q, rotations.back());
        rotations.push_back(q);
      }
      return animation.add_rotations(channel.node, rotations);
    }
    case GltfPath::kTranslation:
      return animation.add_vectors(channel.node, "translation", values, kScaleTolerance, is_step);
    case GltfPath::kScale:
      return animation.add_vectors(channel.node, "scale", values, kScaleTolerance, is_step);
    case GltfPath::kWeights:
      return animation.add_weights(channel.node, values, is_step);
  }
}

void add_other_tracks(const GltfAsset& asset, const GltfPlayer& player,
                      const std::vector<double>& times, GlbAnimation& animation) {
  std::vector<bool> is_joint(asset.model.nodes.size(), false);
  for (const GltfJoint& joint : asset.joints) is_joint[at(joint.node)] = true;
  for (const GltfChannel& channel : asset.model.channels) {
    const bool replaced =
        channel.path == GltfPath::kRotation || channel.path == GltfPath::kTranslation;
    if (replaced && is_joint[at(channel.node)]) continue;
    add_warped(*player.find(channel.node, channel.path), times, animation);
  }
}

}  // namespace

std::string write_glb(const GltfAsset& asset, const motion::Clip& clip,
                      std::span<const double> source_frames, const GlbWriteOptions& options) {
  if (static_cast<std::size_t>(clip.joint_count()) != asset.joints.size()) {
    throw Error(ErrorKind::kUsage, "write_glb: the clip has " + std::to_string(clip.joint_count()) +
                                       " joints, the glTF file " +
                                       std::to_string(asset.joints.size()));
  }
  const std::vector<double> times = source_times(asset, clip, source_frames);
  const GltfPlayer player(asset.model, asset.document.binary);
  NodeSolver solver(asset, player, clip.frame_count());
  for (int f = 0; f < clip.frame_count(); ++f) {
    solver.solve(motion::forward_kinematics(clip, f), f, times[at(f)]);
  }
  json document = asset.document.json;
  GlbAnimation animation(clip.frame_count(), clip.frame_rate_hz(), options);
  add_joint_tracks(asset, player, solver, options, animation, document["nodes"]);
  add_other_tracks(asset, player, times, animation);
  std::string binary = asset.document.binary;
  mend_skinned_meshes(asset.model, document, binary);
  std::move(animation).finish(document, binary);
  if (!document.contains("buffers")) document["buffers"] = json::array({json::object()});
  document["buffers"][0]["byteLength"] = binary.size();
  document["asset"]["generator"] = "laban";
  return pack_glb(document, binary);
}

}  // namespace laban::io
