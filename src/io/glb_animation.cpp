#include "io/glb_animation.h"

#include <array>
#include <cmath>
#include <cstring>

#include "laban/base/error.h"
#include "laban/math/rotation.h"

#include "io/key_reduction.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Quaterniond;
using nlohmann::json;

// Of scales and weights, which are about 1: less shows in no mesh.
constexpr double kWeightTolerance = 1e-3;
constexpr double kShortMost = 32767.0;

template <typename T, typename Count>
void append(std::string& bytes, const T* values, Count count) {
  bytes.append(reinterpret_cast<const char*>(values), static_cast<std::size_t>(count) * sizeof(T));
}

std::array<std::int16_t, 4> to_short(const Quaterniond& q) {
  std::array<std::int16_t, 4> value{};
  for (std::size_t i = 0; i < 4; ++i) {
    value[i] = static_cast<std::int16_t>(
        std::lround(q.coeffs()[static_cast<Eigen::Index>(i)] * kShortMost));
  }
  return value;
}

/// A rotation as a player gets it back.
Quaterniond from_short(const std::array<std::int16_t, 4>& value) {
  return Quaterniond(value[3], value[0], value[1], value[2]).normalized();
}
Quaterniond from_float(const Quaterniond& q) {
  return q.cast<float>().cast<double>().normalized();
}

const char* vector_type(Eigen::Index rows) {
  return rows == 3 ? "VEC3" : rows == 4 ? "VEC4" : "SCALAR";
}

json accessor(std::size_t view, std::size_t begin, int component, std::size_t count,
              const char* type) {
  json made = {
      {"bufferView", view}, {"componentType", component}, {"count", count}, {"type", type}};
  if (begin > 0) made["byteOffset"] = begin;
  return made;
}

}  // namespace

std::vector<std::string> GlbCompactOptions::problems() const {
  std::vector<std::string> found;
  const auto require = [&](double value, const char* name) {
    if (value > 0.0 && std::isfinite(value)) return;
    found.push_back("GlbCompactOptions::" + std::string(name) + " = " + std::to_string(value) +
                    " (must be > 0)");
  };
  require(rotation_tolerance_rad, "rotation_tolerance_rad");
  require(translation_tolerance_m, "translation_tolerance_m");
  return found;
}

std::size_t append_view(json& asset, std::string& binary, std::string_view bytes) {
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  json& views = asset["bufferViews"];
  views.push_back({{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}});
  binary += bytes;
  return views.size() - 1;
}

GlbAnimation::GlbAnimation(int frame_count, double frame_rate_hz, const GlbWriteOptions& options)
    : frame_count_(frame_count), frame_rate_hz_(frame_rate_hz), options_(options) {
  if (options_.compact) {
    const std::vector<std::string> problems = options_.compact->problems();
    if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
  }
  for (int f = 0; f < frame_count; ++f) {
    times_s_.push_back(static_cast<float>(static_cast<double>(f) / frame_rate_hz));
    all_keys_.push_back(f);
    if (f > 0 && !(times_s_.back() > times_s_[times_s_.size() - 2])) {
      throw Error(ErrorKind::kData, "GLB: frame " + std::to_string(f) +
                                        " has no float32 time of its own; cut the clip into "
                                        "shorter ones");
    }
  }
}

double GlbAnimation::time_of(int key) const {
  return static_cast<double>(times_s_[static_cast<std::size_t>(key)]);
}

std::size_t GlbAnimation::input_of(const std::vector<int>& keys) {
  const auto [place, is_new] = known_inputs_.emplace(keys, inputs_.size());
  if (!is_new) return place->second;
  inputs_.push_back({times_.size(), keys});
  for (const int key : keys) append(times_, &times_s_[static_cast<std::size_t>(key)], 1);
  return place->second;
}

void GlbAnimation::add_floats(Track track, const std::vector<int>& keys,
                              const Eigen::Ref<const Eigen::MatrixXf>& values) {
  track.input = input_of(keys);
  track.begin = floats_.size();
  track.type = track.path == std::string_view("weights") ? "SCALAR" : vector_type(values.rows());
  track.count =
      keys.size() *
      (track.path == std::string_view("weights") ? static_cast<std::size_t>(values.rows()) : 1);
  for (const int key : keys) append(floats_, values.col(key).data(), values.rows());
  tracks_.push_back(track);
}

template <typename Same, typename Fits>
std::vector<int> GlbAnimation::keys_of(const Same& same_as_first, const Fits& fits) {
  bool still = !tracks_.empty();  // the first track lasts as long as the clip
  for (int f = 1; still && f < frame_count_; ++f) still = same_as_first(f);
  return still ? std::vector<int>{0} : reduce_keys(frame_count_, fits);
}

void GlbAnimation::add_compact_rotations(int node, std::span<const Quaterniond> rotations) {
  const double tolerance = options_.compact->rotation_tolerance_rad;
  std::vector<std::array<std::int16_t, 4>> shorts;
  std::vector<Quaterniond> decoded;
  bool short_enough = true;
  for (const Quaterniond& q : rotations) {
    shorts.push_back(to_short(q));
    decoded.push_back(from_short(shorts.back()));
    short_enough = short_enough && math::angle_between(q, decoded.back()) <= tolerance;
  }
  if (!short_enough) {
    for (std::size_t f = 0; f < decoded.size(); ++f) decoded[f] = from_float(rotations[f]);
  }
  const auto near = [&](int frame, const Quaterniond& drawn) {
    return math::angle_between(rotations[static_cast<std::size_t>(frame)], drawn) <= tolerance;
  };
  const auto fits = [&](int i, int j) {
    const Quaterniond& begin = decoded[static_cast<std::size_t>(i)];
    const Quaterniond& end = decoded[static_cast<std::size_t>(j)];
    for (int f = i + 1; f < j; ++f) {
      // As a player does it: at the frame's time, between the keys' rounded ones.
      const double share = (f / frame_rate_hz_ - time_of(i)) / (time_of(j) - time_of(i));
      if (!near(f, begin.slerp(share, end))) return false;
    }
    return true;
  };
  const std::vector<int> keys = keys_of([&](int f) { return near(f, decoded.front()); }, fits);
  Track track{node, "rotation"};
  if (!short_enough) {
    Eigen::MatrixXf values(4, frame_count_);
    for (int f = 0; f < frame_count_; ++f) {
      values.col(f) = rotations[static_cast<std::size_t>(f)].coeffs().cast<float>();
    }
    return add_floats(track, keys, values);
  }
  track.input = input_of(keys);
  track.is_short = true;
  track.begin = shorts_.size();
  track.count = keys.size();
  track.type = "VEC4";
  for (const int key : keys) append(shorts_, shorts[static_cast<std::size_t>(key)].data(), 4);
  tracks_.push_back(track);
}

void GlbAnimation::add_rotations(int node, std::span<const Quaterniond> rotations) {
  if (options_.compact) return add_compact_rotations(node, rotations);
  // Eigen stores x, y, z, w, as glTF does.
  Track track{node, "rotation"};
  track.input = input_of(all_keys_);
  track.begin = floats_.size();
  track.count = rotations.size();
  track.type = "VEC4";
  floats_.resize(floats_.size() + rotations.size() * 4 * sizeof(float));
  char* to = floats_.data() + track.begin;
  for (const Quaterniond& q : rotations) {
    const Eigen::Vector4f value = q.coeffs().cast<float>();
    std::memcpy(to, value.data(), 4 * sizeof(float));
    to += 4 * sizeof(float);
  }
  tracks_.push_back(track);
}

void GlbAnimation::add_vectors(int node, const char* path,
                               const Eigen::Ref<const Eigen::MatrixXd>& values, double tolerance,
                               bool is_step) {
  const Eigen::MatrixXf rounded = values.cast<float>();
  const Track track{node, path, is_step};
  if (!options_.compact) return add_floats(track, all_keys_, rounded);
  // What a float32 cannot hold is not asked for.
  const double reached =
      tolerance + 1e-7 * std::max(1.0, values.size() > 0 ? values.cwiseAbs().maxCoeff() : 0.0);
  const auto near = [&](int frame, const Eigen::Ref<const Eigen::VectorXd>& drawn) {
    return (values.col(frame) - drawn).norm() <= reached;
  };
  const auto fits = [&](int i, int j) {
    const Eigen::VectorXd begin = rounded.col(i).cast<double>();
    const Eigen::VectorXd step = rounded.col(j).cast<double>() - begin;
    for (int f = i + 1; f < j; ++f) {
      const double share = (f / frame_rate_hz_ - time_of(i)) / (time_of(j) - time_of(i));
      if (!near(f, is_step ? begin : Eigen::VectorXd(begin + share * step))) return false;
    }
    return true;
  };
  const Eigen::VectorXd first = rounded.col(0).cast<double>();
  add_floats(track, keys_of([&](int f) { return near(f, first); }, fits), rounded);
}

void GlbAnimation::add_weights(int node, const Eigen::Ref<const Eigen::MatrixXd>& values,
                               bool is_step) {
  add_vectors(node, "weights", values, kWeightTolerance, is_step);
}

void GlbAnimation::finish(json& asset, std::string& binary) && {
  const std::size_t times_view = append_view(asset, binary, times_);
  std::size_t floats_view = 0;
  std::size_t shorts_view = 0;
  if (!floats_.empty()) floats_view = append_view(asset, binary, floats_);
  if (!shorts_.empty()) shorts_view = append_view(asset, binary, shorts_);
  json& accessors = asset["accessors"];
  const std::size_t first_input = accessors.size();
  for (const Input& input : inputs_) {
    json made = accessor(times_view, input.begin, kGltfFloat, input.keys.size(), "SCALAR");
    made["min"] = {times_s_[static_cast<std::size_t>(input.keys.front())]};
    made["max"] = {times_s_[static_cast<std::size_t>(input.keys.back())]};
    accessors.push_back(std::move(made));
  }
  json animation = {{"name", options_.animation_name},
                    {"channels", json::array()},
                    {"samplers", json::array()},
                    {"extras", {{"frame_rate_hz", frame_rate_hz_}}}};
  for (const Track& track : tracks_) {
    animation["channels"].push_back({{"sampler", animation["samplers"].size()},
                                     {"target", {{"node", track.node}, {"path", track.path}}}});
    animation["samplers"].push_back({{"input", first_input + track.input},
                                     {"output", accessors.size()},
                                     {"interpolation", track.is_step ? "STEP" : "LINEAR"}});
    json made = accessor(track.is_short ? shorts_view : floats_view, track.begin,
                         track.is_short ? kGltfShort : kGltfFloat, track.count, track.type);
    if (track.is_short) made["normalized"] = true;
    accessors.push_back(std::move(made));
  }
  json& animations = asset["animations"];
  if (!animations.is_array()) animations = json::array();
  animations.insert(animations.begin(), std::move(animation));
}

}  // namespace laban::io
