#include "draw/body.h"

#include <set>

#include "laban/motion/forward_kinematics.h"

namespace laban::draw {
namespace {

using motion::Skeleton;

bool is_lower(char c) {
  return c >= 'a' && c <= 'z';
}
bool is_upper(char c) {
  return c >= 'A' && c <= 'Z';
}

std::string lowered(std::string_view text) {
  std::string low(text);
  for (char& c : low) {
    if (is_upper(c)) c = static_cast<char>(c - 'A' + 'a');
  }
  return low;
}

// Words of a joint name, lower case: "mixamorig:LeftUpLeg" is mixamorig, left, up, leg; "LHipJoint"
// is l, hip, joint.
std::vector<std::string> words_of(std::string_view name) {
  std::vector<std::string> words(1);
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    if (!is_lower(c) && !is_upper(c)) {
      words.emplace_back();
      continue;
    }
    const bool after_lower = i > 0 && is_lower(name[i - 1]);
    const bool before_lower = i + 1 < name.size() && is_lower(name[i + 1]);
    if (is_upper(c) && (after_lower || before_lower)) words.emplace_back();
    words.back() += c;
  }
  std::vector<std::string> filled;
  for (const std::string& word : words) {
    if (!word.empty()) filled.push_back(lowered(word));
  }
  return filled;
}

Side named_side(std::string_view name, const std::set<std::string>& all_names) {
  for (const std::string& word : words_of(name)) {
    if (word == "l" || word.starts_with("left")) return Side::kLeft;
    if (word == "r" || word.starts_with("right")) return Side::kRight;
  }
  // "lfemur" is a left joint because there is an "rfemur"; "lowerback" is not.
  const std::string low = lowered(name);
  if (low.empty() || (low[0] != 'l' && low[0] != 'r')) return Side::kMiddle;
  const bool left = low[0] == 'l';
  std::string twin = low;
  twin[0] = left ? 'r' : 'l';
  if (!all_names.contains(twin)) return Side::kMiddle;
  return left ? Side::kLeft : Side::kRight;
}

// Node tree: parents of joints, then of end sites.
std::vector<int> node_parents(const Skeleton& skeleton, const Body& body) {
  std::vector<int> parents;
  for (const motion::Joint& joint : skeleton.joints()) parents.push_back(joint.parent);
  parents.insert(parents.end(), body.end_site_joints.begin(), body.end_site_joints.end());
  return parents;
}

// Lengths at frame 0: a joint that animates its position need not lie at its rest offset.
std::vector<double> bone_lengths(const motion::Clip& clip, const Body& body) {
  std::vector<double> lengths;
  for (int j = 0; j < clip.joint_count(); ++j) {
    lengths.push_back(j <= body.root ? 0.0 : clip.translation(0, j).norm());
  }
  for (const int joint : body.end_site_joints) {
    lengths.push_back(clip.skeleton().joint(joint).end_site->norm());
  }
  return lengths;
}

bool slides(const motion::Clip& clip, int joint) {
  constexpr double kStillM = 0.01;
  if (!clip.has_translations()) return false;
  const Eigen::Vector3d first = clip.translation(0, joint);
  for (int f = 1; f < clip.frame_count(); ++f) {
    if ((clip.translation(f, joint) - first).norm() > kStillM) return true;
  }
  return false;
}

bool is_named_carrier(std::string_view name) {
  for (const std::string& word : words_of(name)) {
    for (const std::string_view carrier : {"root", "reference", "armature", "world", "scene"}) {
      if (word == carrier) return true;
    }
  }
  return false;
}

// Down from the root past joints that only carry the body: an only child that slides about, or a
// name that says so above an only child.
int body_root(const motion::Clip& clip) {
  int root = 0;
  while (true) {
    const std::vector<int> children = clip.skeleton().children(root);
    if (children.size() != 1) return root;
    const int child = children.front();
    const bool carries = slides(clip, child) || is_named_carrier(clip.skeleton().joint(root).name);
    if (!carries || clip.skeleton().children(child).empty()) return root;
    root = child;
  }
}

// The longest way down from each node, metres.
std::vector<double> reaches(const std::vector<int>& parents, const std::vector<double>& lengths) {
  std::vector<double> reach(parents.size(), 0.0);
  for (std::size_t n = parents.size(); n-- > 1;) {
    double& above = reach[static_cast<std::size_t>(parents[n])];
    above = std::max(above, reach[n] + lengths[n]);
  }
  return reach;
}

// The two longest branches of the root, hand to foot, are about 1.28 statures of a humanoid.
double size_from(int root, const std::vector<int>& parents, const std::vector<double>& lengths,
                 const std::vector<double>& reach) {
  double longest = 0.0;
  double second = 0.0;
  for (std::size_t n = 1; n < parents.size(); ++n) {
    if (parents[n] != root) continue;
    const double branch = reach[n] + lengths[n];
    second = std::max(second, std::min(longest, branch));
    longest = std::max(longest, branch);
  }
  return (longest + second) / 1.28;
}

std::optional<int> first_named(const Skeleton& skeleton, const std::vector<Side>& sides, Side side,
                               std::string_view part) {
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    if (sides[static_cast<std::size_t>(j)] != side) continue;
    if (lowered(skeleton.joint(j).name).find(part) != std::string::npos) return j;
  }
  return std::nullopt;
}

std::optional<int> head_joint(const Skeleton& skeleton) {
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const auto words = words_of(skeleton.joint(j).name);
    if (std::find(words.begin(), words.end(), "head") != words.end()) return j;
  }
  return std::nullopt;
}

// The head points to its end site, else away from its parent (leaves have no length of their own).
void find_head(const Skeleton& skeleton, const std::vector<double>& lengths, Body& body) {
  body.head = head_joint(skeleton);
  if (!body.head) return;
  body.head_base = std::max(0, skeleton.joint(*body.head).parent);
  body.head_tip = *body.head;
  constexpr double kShortestM = 0.02;
  for (std::size_t e = 0; e < body.end_site_joints.size(); ++e) {
    const auto node = static_cast<std::size_t>(skeleton.joint_count()) + e;
    if (body.end_site_joints[e] != *body.head || lengths[node] < kShortestM) continue;
    body.head_base = *body.head;
    body.head_tip = static_cast<int>(node);
  }
}

void find_hips(const Skeleton& skeleton, const std::vector<Side>& sides, Body& body) {
  // Thighs first: joints named hip may lie in the middle of the pelvis (CMU's LHipJoint does).
  for (const std::string_view part : {"upleg", "upperleg", "thigh", "femur", "hip", "leg"}) {
    body.left_hip = first_named(skeleton, sides, Side::kLeft, part);
    body.right_hip = first_named(skeleton, sides, Side::kRight, part);
    if (body.left_hip && body.right_hip) return;
  }
  body.left_hip.reset();
  body.right_hip.reset();
}

void find_tracers(const Skeleton& skeleton, const std::vector<Side>& sides, Body& body) {
  const auto trace = [&](std::initializer_list<std::string_view> parts) {
    for (const Side side : {Side::kLeft, Side::kRight}) {
      for (const std::string_view part : parts) {
        const auto joint = first_named(skeleton, sides, side, part);
        if (!joint) continue;
        body.tracers.push_back({*joint, side});
        break;
      }
    }
  };
  trace({"hand", "wrist"});
  trace({"foot", "ankle"});
  if (body.head) body.tracers.push_back({*body.head, Side::kMiddle});
  if (!body.tracers.empty()) return;
  constexpr std::size_t kMaxLeaves = 6;
  for (int j = 0; j < skeleton.joint_count() && body.tracers.size() < kMaxLeaves; ++j) {
    if (skeleton.children(j).empty()) {
      body.tracers.push_back({j, sides[static_cast<std::size_t>(j)]});
    }
  }
}

// Nodes below the head (face, eyes, a cap's end) are hidden by its circle.
std::vector<bool> below_head(const std::vector<int>& parents, const Body& body) {
  std::vector<bool> below(parents.size(), false);
  if (!body.head) return below;
  for (std::size_t n = 1; n < parents.size(); ++n) {
    below[n] = parents[n] == *body.head || below[static_cast<std::size_t>(parents[n])];
  }
  return below;
}

// A limb hangs on a middle joint and tapers from its root to its tips; the trunk tapers to the
// head.
struct LimbOfNode {
  std::size_t limb = 0;
  double depth = 0.0;   // metres from the limb's root
  double length = 0.0;  // metres from the limb's root to its furthest tip
};

double radius_at(const LimbOfNode& at, const Body& body) {
  const bool trunk = at.limb == 0;
  const double thick = trunk ? 0.034 : 0.027;
  const double thin = trunk ? 0.020 : 0.0125;
  const double share = at.length > 0.0 ? std::clamp(at.depth / at.length, 0.0, 1.0) : 0.0;
  return body.size_m * (thick + (thin - thick) * share);
}

void build_limbs(const std::vector<int>& parents, const std::vector<double>& lengths,
                 const std::vector<double>& reach, const std::vector<Side>& sides, Body& body) {
  const std::size_t joints = sides.size();
  const std::vector<bool> hidden = below_head(parents, body);
  std::vector<LimbOfNode> places(parents.size());
  body.limbs.push_back({});
  const double trunk_length = 0.45 * body.size_m;  // hips to head
  const auto root = static_cast<std::size_t>(body.root);
  places[root] = {0, 0.0, trunk_length};
  for (std::size_t n = root + 1; n < parents.size(); ++n) {
    if (parents[n] < body.root) continue;  // an end site of a joint above the body
    const auto parent = static_cast<std::size_t>(parents[n]);
    const LimbOfNode& above = places[parent];
    const Side side = n < joints ? sides[n] : body.limbs[above.limb].side;
    if (side == body.limbs[above.limb].side) {
      places[n] = {above.limb, above.depth + lengths[n], above.length};
    } else {
      places[n] = {body.limbs.size(), 0.0, reach[n]};
      body.limbs.push_back({side, {}});
    }
    if (hidden[n]) continue;
    // The first bone of a limb, from the trunk to its root, belongs to what it hangs on.
    const bool same = places[n].limb == above.limb;
    const double from = radius_at(above, body);
    const double to = same ? radius_at(places[n], body) : 0.024 * body.size_m;
    body.limbs[above.limb].bones.push_back(
        {static_cast<int>(parent), static_cast<int>(n), same ? from : to, to});
  }
}

}  // namespace

std::vector<Side> joint_sides(const Skeleton& skeleton) {
  std::set<std::string> names;
  for (const motion::Joint& joint : skeleton.joints()) names.insert(lowered(joint.name));
  const auto rest = motion::rest_pose(skeleton);
  std::vector<Side> sides;
  bool any = false;
  for (const motion::Joint& joint : skeleton.joints()) {
    Side side = named_side(joint.name, names);
    any = any || side != Side::kMiddle;
    if (side == Side::kMiddle && joint.parent >= 0) {
      side = sides[static_cast<std::size_t>(joint.parent)];
    }
    sides.push_back(side);
  }
  if (any) return sides;
  constexpr double kMiddleM = 0.01;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const double x = rest.positions(0, j) - rest.positions(0, 0);
    if (std::abs(x) < kMiddleM) continue;
    sides[static_cast<std::size_t>(j)] = x > 0.0 ? Side::kLeft : Side::kRight;
  }
  return sides;
}

Body describe_body(const motion::Clip& clip) {
  const Skeleton& skeleton = clip.skeleton();
  Body body;
  body.root = body_root(clip);
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    if (skeleton.joint(j).end_site) body.end_site_joints.push_back(j);
  }
  const auto parents = node_parents(skeleton, body);
  const auto lengths = bone_lengths(clip, body);
  const auto reach = reaches(parents, lengths);
  const auto sides = joint_sides(skeleton);
  constexpr double kSmallestM = 0.01;  // a lone joint is still drawn
  body.size_m = std::max(size_from(body.root, parents, lengths, reach), kSmallestM);
  find_head(skeleton, lengths, body);
  find_hips(skeleton, sides, body);
  find_tracers(skeleton, sides, body);
  build_limbs(parents, lengths, reach, sides, body);
  return body;
}

Eigen::Matrix3Xd node_positions(const motion::Clip& clip, const Body& body, int frame) {
  const auto pose = motion::forward_kinematics(clip, frame);
  const Eigen::Index joints = clip.joint_count();
  const auto ends = static_cast<Eigen::Index>(body.end_site_joints.size());
  Eigen::Matrix3Xd nodes(3, joints + ends);
  nodes.leftCols(joints) = pose.positions;
  for (int j = 0; j < body.root; ++j) nodes.col(j) = pose.positions.col(body.root);
  for (Eigen::Index e = 0; e < ends; ++e) {
    const int joint = body.end_site_joints[static_cast<std::size_t>(e)];
    nodes.col(joints + e) =
        pose.positions.col(joint) +
        pose.rotations[static_cast<std::size_t>(joint)] * *clip.skeleton().joint(joint).end_site;
  }
  return nodes;
}

}  // namespace laban::draw
