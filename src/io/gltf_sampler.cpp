#include "io/gltf_sampler.h"

#include <cmath>

namespace laban::io {
namespace {

// Key times are float32, ours are not: nearer than this, in parts of the time, they are one.
// Without it a long clip's keys would be missed by up to 1e-4 of a frame.
constexpr double kTimePrecision = 1.5e-7;
constexpr double kSameTimeS = 1e-9;

}  // namespace

double GltfSampler::time_of(std::size_t key) const {
  double time = 0.0;
  channel_.times.read(binary_, key, &time);
  return time;
}

void GltfSampler::read_key(std::size_t key, int part, double* values) const {
  const bool is_spline = channel_.interpolation == GltfInterpolation::kCubicSpline;
  const std::size_t element = is_spline ? 3 * key + static_cast<std::size_t>(part) : key;
  if (channel_.path != GltfPath::kWeights) {
    channel_.values.read(binary_, element, values);
    return;
  }
  const auto width = static_cast<std::size_t>(channel_.width);
  for (std::size_t i = 0; i < width; ++i) {
    channel_.values.read(binary_, element * width + i, values + i);
  }
}

void GltfSampler::sample(double time_s, double* values) const {
  const double same = kTimePrecision * std::abs(time_s) + kSameTimeS;
  // The last key not after the time.
  std::size_t low = 0;
  std::size_t high = channel_.key_count();
  while (high - low > 1) {
    const std::size_t middle = low + (high - low) / 2;
    (time_of(middle) <= time_s + same ? low : high) = middle;
  }
  const double begin = time_of(low);
  const bool is_last = low + 1 == channel_.key_count();
  if (is_last || time_s <= begin + same || channel_.interpolation == GltfInterpolation::kStep) {
    read_key(low, 1, values);
  } else {
    const double span = time_of(low + 1) - begin;  // > 0: the next key lies after the time
    interpolate(low, (time_s - begin) / span, span, values);
  }
  if (channel_.path != GltfPath::kRotation) return;
  Eigen::Map<Eigen::Vector4d> q(values);
  // A spline may pass through nothing between two keys; there any rotation is as good.
  if (!(q.norm() > 1e-9)) q = Eigen::Vector4d::UnitW();
  q.normalize();
}

void GltfSampler::interpolate(std::size_t key, double share, double span_s, double* values) const {
  const auto width = static_cast<Eigen::Index>(channel_.width);
  if (channel_.path == GltfPath::kRotation &&
      channel_.interpolation == GltfInterpolation::kLinear) {
    Eigen::Quaterniond here;
    Eigen::Quaterniond next;
    read_key(key, 1, here.coeffs().data());
    read_key(key + 1, 1, next.coeffs().data());
    Eigen::Map<Eigen::Vector4d> turned(values);
    turned = here.normalized().slerp(share, next.normalized()).coeffs();
    return;
  }
  Eigen::VectorXd next(width);
  Eigen::Map<Eigen::VectorXd> result(values, width);
  read_key(key, 1, values);
  read_key(key + 1, 1, next.data());
  if (channel_.interpolation == GltfInterpolation::kLinear) {
    result += share * (next - result);
    return;
  }
  // Appendix C.4: p(t) = (2t^3 - 3t^2 + 1) v_k + d (t^3 - 2t^2 + t) b_k + (-2t^3 + 3t^2) v_k+1
  //                      + d (t^3 - t^2) a_k+1, with d the time between the keys.
  Eigen::VectorXd out(width);
  Eigen::VectorXd in(width);
  read_key(key, 2, out.data());
  read_key(key + 1, 0, in.data());
  const double t = share;
  const double t2 = t * t;
  const double t3 = t2 * t;
  result = ((2.0 * t3 - 3.0 * t2 + 1.0) * result + span_s * (t3 - 2.0 * t2 + t) * out +
            (3.0 * t2 - 2.0 * t3) * next + span_s * (t3 - t2) * in)
               .eval();
}

GltfPlayer::GltfPlayer(const GltfModel& model, std::string_view binary) : model_(model) {
  by_node_.assign(model.nodes.size(), {-1, -1, -1, -1});
  for (const GltfChannel& channel : model.channels) {
    by_node_[static_cast<std::size_t>(channel.node)][static_cast<std::size_t>(channel.path)] =
        static_cast<int>(samplers_.size());
    samplers_.emplace_back(channel, binary);
  }
}

const GltfSampler* GltfPlayer::find(int node, GltfPath path) const {
  const int found = by_node_[static_cast<std::size_t>(node)][static_cast<std::size_t>(path)];
  return found < 0 ? nullptr : &samplers_[static_cast<std::size_t>(found)];
}

Eigen::Vector3d GltfPlayer::scale(int node, double time_s) const {
  const GltfSampler* sampler = find(node, GltfPath::kScale);
  return sampler != nullptr ? sampler->vector(time_s)
                            : model_.nodes[static_cast<std::size_t>(node)].scale;
}

GltfPlace GltfPlayer::place(int node, const GltfPlace& parent, double time_s) const {
  const GltfNode& source = model_.nodes[static_cast<std::size_t>(node)];
  const GltfSampler* moving = find(node, GltfPath::kTranslation);
  const GltfSampler* turning = find(node, GltfPath::kRotation);
  const Eigen::Vector3d offset = moving != nullptr ? moving->vector(time_s) : source.translation;
  GltfPlace made;
  made.position = parent.position + parent.linear * offset;
  const Eigen::Quaterniond turn = turning != nullptr ? turning->rotation(time_s) : source.rotation;
  made.rotation = (parent.rotation * turn).normalized();
  if (turning == nullptr && find(node, GltfPath::kScale) == nullptr) {
    made.linear = parent.linear * source.linear;
  } else {
    made.linear = parent.linear * turn.toRotationMatrix() * scale(node, time_s).asDiagonal();
  }
  return made;
}

GltfPlace GltfPlayer::default_place(int node, const GltfPlace& parent) const {
  const GltfNode& source = model_.nodes[static_cast<std::size_t>(node)];
  return {(parent.rotation * source.rotation).normalized(), parent.linear * source.linear,
          parent.position + parent.linear * source.translation};
}

}  // namespace laban::io
