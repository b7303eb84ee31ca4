#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "laban/base/error.h"
#include "laban/io/gltf.h"

#include "io/frame_rate.h"
#include "io/gltf_asset.h"
#include "io/gltf_sampler.h"

namespace laban::io {
namespace {

using base::Error;
using base::ErrorKind;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// As for BVH: exporters repeat a rest offset with float32 noise.
constexpr double kStillM = 1e-6;
// A joint that keeps to one place this near to where it is bound rests there: inverse bind matrices
// are inverted in float32, and often written with six digits.
constexpr double kBindNoiseM = 1e-4;
// A bind matrix is rigid if its axes are so near to square and of one length.
constexpr double kRigid = 1e-3;
// Cells (a rotation each) that any file may ask for, and bytes that pay for one more.
constexpr std::size_t kFreeCells = std::size_t{1} << 20U;
constexpr std::size_t kBytesPerCell = 4;
// Keys are on a rate's frames if they are this near to them, in frames.
constexpr double kOnFrame = 0.02;
// Below it, keys are poses to be interpolated and not frames of a capture.
constexpr double kLeastSampledRateHz = 12.0;
constexpr double kDefaultRateHz = 30.0;
// Keys nearer than this are one: no rate above 1000 Hz is looked for.
constexpr double kSameKeyS = 1e-3;

/// Nodes with parents before children.
std::vector<int> parents_first(const GltfModel& model) {
  std::vector<int> order;
  order.reserve(model.nodes.size());
  for (std::size_t n = 0; n < model.nodes.size(); ++n) {
    if (model.nodes[n].parent < 0) order.push_back(static_cast<int>(n));
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (const int child : model.nodes[at(order[i])].children) order.push_back(child);
  }
  return order;
}

/// Nodes that are joints by themselves: those of skins, else those that are moved.
std::vector<bool> wanted_nodes(const GltfModel& model) {
  std::vector<bool> wanted(model.nodes.size(), false);
  for (const GltfSkin& skin : model.skins) {
    for (const int joint : skin.joints) wanted[at(joint)] = true;
  }
  if (!model.skins.empty()) return wanted;
  for (const GltfChannel& channel : model.channels) {
    if (channel.path != GltfPath::kWeights) wanted[at(channel.node)] = true;
  }
  return wanted;
}

/// The joints of a file as one tree.
struct JointTree {
  std::vector<int> ancestors;  // of the root, topmost first
  std::vector<int> joints;     // nodes, parents first
  int left_out = 0;            // joints in other trees
};

/// The joints below a root in depth-first order, children in the file's order.
std::vector<int> depth_first(const GltfModel& model, int root, const std::vector<int>& below) {
  std::vector<int> order;
  std::vector<int> open = {root};
  while (!open.empty()) {
    const int node = open.back();
    open.pop_back();
    order.push_back(node);
    const std::vector<int>& children = model.nodes[at(node)].children;
    for (auto child = children.rbegin(); child != children.rend(); ++child) {
      if (below[at(*child)] > 0) open.push_back(*child);
    }
  }
  return order;
}

/// A skin's own order of these joints, if it has all of them and no child before its parent.
std::optional<std::vector<int>> order_of_skin(const GltfModel& model,
                                              const std::vector<int>& joints) {
  for (const GltfSkin& skin : model.skins) {
    if (skin.joints.size() != joints.size() || skin.joints.front() != joints.front()) continue;
    std::vector<bool> known(model.nodes.size(), false);
    const bool parents_come_first =
        std::all_of(skin.joints.begin(), skin.joints.end(), [&](int joint) {
          known[at(joint)] = true;
          return joint == joints.front() ||
                 (model.nodes[at(joint)].parent >= 0 && known[at(model.nodes[at(joint)].parent)]);
        });
    if (parents_come_first) return skin.joints;
  }
  return std::nullopt;
}

JointTree joint_tree(const GltfModel& model, std::string_view name) {
  const std::vector<int> order = parents_first(model);
  const std::vector<bool> wanted = wanted_nodes(model);
  std::vector<int> below(model.nodes.size(), 0);  // joints at a node and below it
  for (auto node = order.rbegin(); node != order.rend(); ++node) {
    if (wanted[at(*node)]) ++below[at(*node)];
    const int parent = model.nodes[at(*node)].parent;
    if (parent >= 0) below[at(parent)] += below[at(*node)];
  }
  int total = 0;
  int root = -1;
  for (const int node : order) {
    if (model.nodes[at(node)].parent >= 0) continue;
    total += below[at(node)];
    if (root < 0 || below[at(node)] > below[at(root)]) root = node;
  }
  if (total == 0) {
    throw Error(ErrorKind::kData, std::string(name) +
                                      ": no node is animated and there is no skin, so there is no "
                                      "motion to read");
  }
  JointTree tree;
  const int count = below[at(root)];
  tree.left_out = total - count;
  // Down to the lowest node that has all joints at it or below.
  for (bool descended = true; descended && !wanted[at(root)];) {
    descended = false;
    for (const int child : model.nodes[at(root)].children) {
      if (below[at(child)] != count) continue;
      tree.ancestors.push_back(root);
      root = child;
      descended = true;
      break;
    }
  }
  tree.joints = depth_first(model, root, below);
  if (const auto order_in_skin = order_of_skin(model, tree.joints)) tree.joints = *order_in_skin;
  return tree;
}

// ---- rest pose -------------------------------------------------------------------------------

struct RestPose {
  std::vector<Vector3d> positions;  // of the file's unit
  std::vector<Quaterniond> rotations;
  bool bind_ignored = false;
};

/// Places of all nodes when nothing is animated.
std::vector<GltfPlace> default_places(const GltfModel& model, const GltfPlayer& player) {
  std::vector<GltfPlace> places(model.nodes.size());
  for (const int node : parents_first(model)) {
    const int parent = model.nodes[at(node)].parent;
    places[at(node)] = player.default_place(node, parent < 0 ? GltfPlace{} : places[at(parent)]);
  }
  return places;
}

Matrix4d matrix_of(const GltfPlace& place) {
  Matrix4d matrix = Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = place.linear;
  matrix.topRightCorner<3, 1>() = place.position;
  return matrix;
}

/// The rotation of a matrix that turns and scales uniformly; nothing if it does anything else.
std::optional<Quaterniond> rigid_rotation(const Matrix4d& matrix) {
  const Matrix3d linear = matrix.topLeftCorner<3, 3>();
  const double scale = std::cbrt(linear.determinant());
  const bool sound = matrix.allFinite() && scale > 1e-9 &&
                     (matrix.row(3) - Eigen::RowVector4d::UnitW()).norm() < 1e-5;
  if (!sound) return std::nullopt;
  const Matrix3d rotation = linear / scale;
  if ((rotation * rotation.transpose() - Matrix3d::Identity()).norm() > kRigid) return std::nullopt;
  return Quaterniond(rotation).normalized();
}

/// mesh_from_joint of a skin's bind pose; nothing if one of the matrices is not rigid.
std::optional<std::vector<Matrix4d>> bind_matrices(const GltfSkin& skin, std::string_view binary) {
  if (!skin.inverse_bind) return std::nullopt;
  std::vector<Matrix4d> matrices;
  for (std::size_t j = 0; j < skin.joints.size(); ++j) {
    Matrix4d joint_from_mesh;
    skin.inverse_bind->read(binary, j, joint_from_mesh.data());
    if (!rigid_rotation(joint_from_mesh)) return std::nullopt;
    matrices.push_back(joint_from_mesh.inverse());
  }
  return matrices;
}

/// How far joints bound by `model_from_mesh` are from where the nodes stand by themselves, at the
/// mean.
double bind_distance(const Matrix4d& model_from_mesh, const std::vector<Matrix4d>& mesh_from_joint,
                     const GltfSkin& skin, const std::vector<GltfPlace>& places) {
  double sum = 0.0;
  for (std::size_t j = 0; j < skin.joints.size(); ++j) {
    const Vector3d bound = (model_from_mesh * mesh_from_joint[j]).topRightCorner<3, 1>();
    sum += (bound - places[at(skin.joints[j])].position).norm();
  }
  return sum / static_cast<double>(skin.joints.size());
}

/// glTF does not say where the space of a skinned mesh lies when it is bound. Exporters take the
/// place of the mesh's node, or the origin; where neither comes near to the nodes (another unit or
/// up axis), the one that puts the first joint where it stands.
Matrix4d model_from_mesh(const GltfModel& model, std::size_t which,
                         const std::vector<Matrix4d>& mesh_from_joint,
                         const std::vector<GltfPlace>& places) {
  const GltfSkin& skin = model.skins[which];
  if (skin.model_from_mesh && rigid_rotation(*skin.model_from_mesh)) return *skin.model_from_mesh;
  std::vector<Matrix4d> candidates;
  for (std::size_t n = 0; n < model.nodes.size() && candidates.empty(); ++n) {
    if (model.nodes[n].skin == static_cast<int>(which)) candidates.push_back(matrix_of(places[n]));
  }
  candidates.emplace_back(Matrix4d::Identity());
  candidates.emplace_back(matrix_of(places[at(skin.joints.front())]) *
                          mesh_from_joint.front().inverse());
  std::vector<double> distances;
  for (const Matrix4d& candidate : candidates) {
    const bool usable = rigid_rotation(candidate).has_value();
    distances.push_back(usable ? bind_distance(candidate, mesh_from_joint, skin, places)
                               : std::numeric_limits<double>::infinity());
  }
  double extent = 0.0;
  for (const int joint : skin.joints) {
    extent = std::max(
        extent, (places[at(joint)].position - places[at(skin.joints.front())].position).norm());
  }
  // A character that stands in another pose than the one it was bound in is still about there.
  const double least = *std::min_element(distances.begin(), distances.end());
  const double near = std::max(2.0 * least, 0.25 * extent);
  const auto chosen =
      std::find_if(distances.begin(), distances.end(), [&](double d) { return d <= near; });
  return chosen == distances.end()
             ? Matrix4d(Matrix4d::Identity())
             : candidates[static_cast<std::size_t>(chosen - distances.begin())];
}

RestPose rest_pose(const GltfModel& model, std::string_view binary, const std::vector<int>& joints,
                   const std::vector<GltfPlace>& places) {
  std::vector<std::optional<Matrix4d>> bound(model.nodes.size());
  std::vector<std::size_t> skins(model.skins.size());
  std::iota(skins.begin(), skins.end(), std::size_t{0});
  std::stable_sort(skins.begin(), skins.end(), [&](std::size_t a, std::size_t b) {
    return model.skins[a].joints.size() > model.skins[b].joints.size();
  });
  RestPose rest;
  for (const std::size_t s : skins) {
    const auto mesh_from_joint = bind_matrices(model.skins[s], binary);
    if (!mesh_from_joint) {
      rest.bind_ignored = rest.bind_ignored || model.skins[s].inverse_bind.has_value();
      continue;
    }
    const Matrix4d from_mesh = model_from_mesh(model, s, *mesh_from_joint, places);
    for (std::size_t j = 0; j < mesh_from_joint->size(); ++j) {
      std::optional<Matrix4d>& place = bound[at(model.skins[s].joints[j])];
      if (!place) place = from_mesh * (*mesh_from_joint)[j];
    }
  }
  for (const int joint : joints) {
    const std::optional<Matrix4d>& place = bound[at(joint)];
    const auto rotation = place ? rigid_rotation(*place) : std::nullopt;
    rest.positions.push_back(rotation ? Vector3d(place->topRightCorner<3, 1>())
                                      : places[at(joint)].position);
    rest.rotations.push_back(rotation ? *rotation : places[at(joint)].rotation);
  }
  return rest;
}

// ---- time ------------------------------------------------------------------------------------

/// The times of all keys, rising, each once.
std::vector<double> key_times(const GltfModel& model, std::string_view binary) {
  std::vector<double> times;
  // Hundreds of channels share one set of keys: it is read once.
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::set<std::array<std::size_t, 3>> seen;
  for (const GltfChannel& channel : model.channels) {
    const GltfAccessor& input = channel.times;
    const std::size_t sparse = input.sparse ? input.sparse->indices_begin : kNone;
    if (!seen.insert({input.begin.value_or(kNone), input.count, sparse}).second) continue;
    for (std::size_t k = 0; k < input.count; ++k) {
      double time = 0.0;
      input.read(binary, k, &time);
      times.push_back(time);
    }
  }
  std::sort(times.begin(), times.end());
  const auto same = [](double a, double b) { return b - a < kSameKeyS; };
  times.erase(std::unique(times.begin(), times.end(), same), times.end());
  return times;
}

bool fall_on_frames(const std::vector<double>& times, double rate_hz) {
  return std::all_of(times.begin(), times.end(), [&](double time) {
    const double frame = (time - times.front()) * rate_hz;
    return std::abs(frame - std::round(frame)) <= kOnFrame;
  });
}

/// A spacing's rate, snapped if the keys allow it; nothing if they do not fall on it.
std::optional<double> sampled_rate(const std::vector<double>& times, double rate_hz) {
  if (!(rate_hz >= kLeastSampledRateHz) || !fall_on_frames(times, rate_hz)) return std::nullopt;
  const std::optional<double> whole = whole_rate_near(rate_hz);
  return whole && fall_on_frames(times, *whole) ? *whole : rate_hz;
}

double find_rate(const std::vector<double>& times) {
  if (times.size() < 2) return kDefaultRateHz;
  const double span = times.back() - times.front();
  const double mean = static_cast<double>(times.size() - 1) / span;
  if (const auto rate = sampled_rate(times, mean)) return *rate;
  double gap = span;
  for (std::size_t k = 1; k < times.size(); ++k) gap = std::min(gap, times[k] - times[k - 1]);
  if (const auto rate = sampled_rate(times, std::round(span / gap) / span)) return *rate;
  for (const double rate : {30.0, 24.0, 60.0, 25.0}) {
    if (fall_on_frames(times, rate)) return rate;
  }
  const auto fits = std::find_if(kCustomaryRatesHz.begin(), kCustomaryRatesHz.end(),
                                 [&](double rate) { return fall_on_frames(times, rate); });
  return fits == kCustomaryRatesHz.end() ? kDefaultRateHz : *fits;
}

struct Timeline {
  double begin_s = 0.0;
  double frame_rate_hz = 0.0;
  int frame_count = 1;
};

Timeline find_timeline(const GltfModel& model, std::string_view binary, std::size_t cells_a_frame,
                       std::size_t bytes, std::string_view name, std::optional<double> rate_hz) {
  const std::vector<double> times = key_times(model, binary);
  if (times.empty()) {
    fail_gltf(name, "/animations/" + std::to_string(model.animation) + "/channels",
              "none of them moves a node; choose another animation (--animation)");
  }
  Timeline timeline;
  timeline.begin_s = times.front();
  timeline.frame_rate_hz = rate_hz               ? *rate_hz
                           : model.frame_rate_hz ? *model.frame_rate_hz
                                                 : find_rate(times);
  const double frames =
      std::floor((times.back() - times.front()) * timeline.frame_rate_hz + 1e-3) + 1.0;
  const std::size_t cells = kFreeCells + bytes / kBytesPerCell;
  if (!(frames <= static_cast<double>(cells) / static_cast<double>(cells_a_frame))) {
    fail_gltf(name, "/animations/" + std::to_string(model.animation),
              std::to_string(times.back() - times.front()) + " s at " +
                  std::to_string(timeline.frame_rate_hz) + " Hz with " +
                  std::to_string(cells_a_frame) +
                  " nodes are more than is read from a file of this size; give a lower rate "
                  "(--fps)");
  }
  timeline.frame_count = static_cast<int>(frames);
  return timeline;
}

// ---- motion ----------------------------------------------------------------------------------

/// Plays an asset's joints in the space of the clip: metres, rest rotations the identity.
class JointPlayer {
 public:
  JointPlayer(const GltfAsset& asset, const GltfPlayer& player, const std::vector<int>& parents)
      : asset_(asset),
        player_(player),
        parents_(parents),
        places_(asset.joints.size()),
        local_(asset.joints.size()),
        offsets_(asset.joints.size()) {}

  void go_to(int frame) {
    const double time = asset_.begin_s + frame / asset_.frame_rate_hz;
    GltfPlace above;
    for (const int node : asset_.ancestors) above = player_.place(node, above, time);
    std::vector<Quaterniond>& turned = turned_;
    turned.resize(places_.size());
    for (std::size_t j = 0; j < places_.size(); ++j) {
      const GltfJoint& joint = asset_.joints[j];
      const int parent = parents_[j];
      places_[j] = player_.place(joint.node, parent < 0 ? above : places_[at(parent)], time);
      turned[j] = (places_[j].rotation * joint.rest_rotation.conjugate()).normalized();
      if (parent < 0) {
        local_[j] = turned[j];
        offsets_[j] = asset_.unit_m * places_[j].position;
      } else {
        const Quaterniond parent_from_model = turned[at(parent)].conjugate();
        local_[j] = (parent_from_model * turned[j]).normalized();
        offsets_[j] = asset_.unit_m *
                      (parent_from_model * (places_[j].position - places_[at(parent)].position));
      }
    }
  }

  [[nodiscard]] const std::vector<Quaterniond>& rotations() const noexcept { return local_; }
  [[nodiscard]] const std::vector<Vector3d>& offsets() const noexcept { return offsets_; }
  [[nodiscard]] const std::vector<GltfPlace>& places() const noexcept { return places_; }

 private:
  const GltfAsset& asset_;
  const GltfPlayer& player_;
  const std::vector<int>& parents_;
  std::vector<GltfPlace> places_;
  std::vector<Quaterniond> turned_;  // model-space rotations of the clip
  std::vector<Quaterniond> local_;
  std::vector<Vector3d> offsets_;  // metres, parent space
};

std::vector<int> joint_parents(const GltfModel& model, const std::vector<int>& joints) {
  std::vector<int> joint_of(model.nodes.size(), -1);
  std::vector<int> parents;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    joint_of[at(joints[j])] = static_cast<int>(j);
    const int parent = model.nodes[at(joints[j])].parent;
    parents.push_back(j == 0 ? -1 : joint_of[at(parent)]);
  }
  return parents;
}

std::vector<motion::Joint> rest_joints(const GltfAsset& asset, const std::vector<int>& parents,
                                       const RestPose& rest) {
  std::vector<motion::Joint> joints(asset.joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const int node_index = asset.joints[j].node;
    const GltfNode& node = asset.model.nodes[at(node_index)];
    joints[j].name = node.name.empty() ? "node_" + std::to_string(node_index) : node.name;
    joints[j].parent = parents[j];
    const Vector3d above =
        parents[j] < 0 ? Vector3d(Vector3d::Zero()) : rest.positions[at(parents[j])];
    joints[j].rest_offset = asset.unit_m * (rest.positions[j] - above);
    if (node.end_site) joints[j].end_site = asset.unit_m * (rest.rotations[j] * *node.end_site);
  }
  return joints;
}

/// The least and greatest offset of each joint over a clip.
struct OffsetRange {
  std::vector<Vector3d> least, most;

  void add(const std::vector<Vector3d>& offsets) {
    if (least.empty()) least = most = offsets;
    for (std::size_t j = 0; j < offsets.size(); ++j) {
      least[j] = least[j].cwiseMin(offsets[j]);
      most[j] = most[j].cwiseMax(offsets[j]);
    }
  }
};

/// Joints other than the root that leave their rest offset; one that keeps to a place near it rests
/// there instead.
std::vector<bool> find_moving(std::vector<motion::Joint>& joints, const OffsetRange& range) {
  std::vector<bool> moving(joints.size(), false);
  for (std::size_t j = 1; j < joints.size(); ++j) {
    Vector3d& rest = joints[j].rest_offset;
    const Vector3d middle = 0.5 * (range.least[j] + range.most[j]);
    const bool keeps = (range.most[j] - range.least[j]).norm() <= kStillM;
    if (keeps && (middle - rest).norm() <= kBindNoiseM) rest = middle;
    const Vector3d away =
        (range.most[j] - rest).cwiseAbs().cwiseMax((range.least[j] - rest).cwiseAbs());
    moving[j] = away.norm() > kStillM;
  }
  return moving;
}

/// 3 x frames * joints: offsets of joints that move, rest offsets of those that do not.
Eigen::Matrix3Xd translations_of(JointPlayer& player, const std::vector<motion::Joint>& joints,
                                 const std::vector<bool>& moving, int frames) {
  const auto count = static_cast<Eigen::Index>(joints.size());
  Eigen::Matrix3Xd translations(3, frames * count);
  for (int f = 0; f < frames; ++f) {
    player.go_to(f);
    for (Eigen::Index j = 0; j < count; ++j) {
      const auto joint = static_cast<std::size_t>(j);
      translations.col(f * count + j) =
          j == 0 || moving[joint] ? player.offsets()[joint] : joints[joint].rest_offset;
    }
  }
  return translations;
}

motion::Clip make_clip(JointPlayer& player, std::vector<motion::Joint> joints,
                       const Timeline& timeline) {
  const int frames = timeline.frame_count;
  Eigen::Matrix3Xd root_positions(3, frames);
  std::vector<Quaterniond> rotations;
  rotations.reserve(static_cast<std::size_t>(frames) * joints.size());
  OffsetRange range;
  for (int f = 0; f < frames; ++f) {
    player.go_to(f);
    rotations.insert(rotations.end(), player.rotations().begin(), player.rotations().end());
    root_positions.col(f) = player.offsets().front();
    range.add(player.offsets());
  }
  const std::vector<bool> moving = find_moving(joints, range);
  Eigen::Matrix3Xd translations;
  if (std::find(moving.begin(), moving.end(), true) != moving.end()) {
    translations = translations_of(player, joints, moving, frames);
  }
  return {std::make_shared<const motion::Skeleton>(std::move(joints)), timeline.frame_rate_hz,
          std::move(root_positions), std::move(rotations), std::move(translations)};
}

/// The first joint above which scales are not uniform, or mirror, at the current frame; -1 for
/// none.
int first_sheared(const GltfAsset& asset, const std::vector<GltfPlace>& places,
                  const std::vector<int>& parents) {
  for (std::size_t j = 0; j < places.size(); ++j) {
    if (parents[j] < 0) continue;
    const Matrix3d& linear = places[at(parents[j])].linear;
    const Vector3d lengths = linear.colwise().norm();
    const bool uniform = lengths.maxCoeff() - lengths.minCoeff() <= kRigid * lengths.maxCoeff();
    if (!uniform || linear.determinant() <= 0.0) return asset.joints[at(parents[j])].node;
  }
  return -1;
}

void add_warnings(const GltfAsset& asset, const JointPlayer& player, const JointTree& tree,
                  const std::vector<int>& parents, bool bind_ignored, std::string_view name,
                  std::vector<std::string>& warnings) {
  const std::string start = std::string(name) + ": ";
  if (tree.left_out > 0) {
    warnings.push_back(start + "/nodes: " + std::to_string(tree.left_out) +
                       " joints in other trees than the largest are left out");
  }
  if (bind_ignored) {
    warnings.push_back(
        start +
        "/skins: inverse bind matrices that are not rigid are ignored; the rest pose "
        "is the nodes' own");
  }
  const int sheared = first_sheared(asset, player.places(), parents);
  if (sheared >= 0) {
    warnings.push_back(start + "/nodes/" + std::to_string(sheared) +
                       ": its scale is not uniform; joints below it are where they should be, but "
                       "turn without shear");
  }
}

}  // namespace

std::vector<std::string> GltfReadOptions::problems() const {
  std::vector<std::string> found;
  const auto require_positive = [&](const std::optional<double>& value, const char* option) {
    if (!value || (*value > 0.0 && *value <= 1e6)) return;
    found.push_back("GltfReadOptions::" + std::string(option) + " = " + std::to_string(*value) +
                    " (must be > 0 and at most 1e6)");
  };
  require_positive(unit_m, "unit_m");
  require_positive(frame_rate_hz, "frame_rate_hz");
  return found;
}

GltfFile read_gltf(std::string_view bytes, std::string_view name, const GltfReadOptions& options) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw Error(ErrorKind::kUsage, problems.front());
  std::vector<std::string> warnings;
  GltfDocument document = read_gltf_document(bytes, name, options.folder, warnings);
  GltfModel model = read_gltf_model(document, name, options.animation, warnings);
  auto asset = std::make_shared<GltfAsset>(std::move(document), std::move(model));
  const GltfPlayer player(asset->model, asset->document.binary);
  const JointTree tree = joint_tree(asset->model, name);
  const RestPose rest = rest_pose(asset->model, asset->document.binary, tree.joints,
                                  default_places(asset->model, player));
  const Timeline timeline = find_timeline(asset->model, asset->document.binary,
                                          tree.joints.size() + tree.ancestors.size(),
                                          asset->document.file_bytes, name, options.frame_rate_hz);
  asset->ancestors = tree.ancestors;
  for (std::size_t j = 0; j < tree.joints.size(); ++j) {
    asset->joints.push_back({tree.joints[j], rest.rotations[j]});
  }
  asset->unit_m = options.unit_m.value_or(1.0);
  asset->begin_s = timeline.begin_s;
  asset->frame_rate_hz = timeline.frame_rate_hz;
  const std::vector<int> parents = joint_parents(asset->model, tree.joints);
  JointPlayer joints(*asset, player, parents);
  motion::Clip clip = make_clip(joints, rest_joints(*asset, parents, rest), timeline);
  add_warnings(*asset, joints, tree, parents, rest.bind_ignored, name, warnings);
  return {std::move(clip),        asset->unit_m,    asset->model.animation_names,
          asset->model.animation, std::move(asset), std::move(warnings)};
}

}  // namespace laban::io
