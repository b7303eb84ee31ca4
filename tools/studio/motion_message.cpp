#include "motion_message.h"

#include <bit>
#include <cstdint>
#include <cstring>

namespace laban::studio {
namespace {

static_assert(std::endian::native == std::endian::little, "messages are little endian");

/// Arrays one behind the other, and where each stands.
class ArrayWriter {
 public:
  template <typename Number>
  void add(const std::string& name, const char* type, const std::vector<Number>& numbers,
           std::vector<int> shape) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    places_[name] = {{"offset", bytes_.size()}, {"type", type}, {"shape", std::move(shape)}};
    const std::size_t size = sizeof(Number) * numbers.size();
    bytes_.resize(bytes_.size() + size);
    std::memcpy(bytes_.data() + bytes_.size() - size, numbers.data(), size);
  }
  [[nodiscard]] const Json& places() const { return places_; }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  Json places_ = Json::object();
  std::string bytes_;
};

Json vector_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// "left", "right" or "trunk"; a joint that plays no part is on its parent's side.
std::string side_of(const std::string& part, const std::string& parent_side) {
  if (part.empty()) return parent_side;
  if (part.starts_with("left_")) return "left";
  return part.starts_with("right_") ? "right" : "trunk";
}

Json joints_json(const motion::Skeleton& skeleton, const motion::Humanoid& humanoid) {
  Json joints = Json::array();
  std::vector<std::string> sides;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const motion::Joint& joint = skeleton.joint(j);
    std::string part;
    if (const auto played = humanoid.played_by(j))
      part = motion::kStandardJointNames[static_cast<std::size_t>(motion::index_of(*played))];
    sides.push_back(
        side_of(part, joint.parent < 0 ? "trunk" : sides[static_cast<std::size_t>(joint.parent)]));
    joints.push_back({{"name", joint.name},
                      {"parent", joint.parent},
                      {"offset", vector_json(joint.rest_offset)},
                      {"end", joint.end_site ? vector_json(*joint.end_site) : Json()},
                      {"side", sides.back()},
                      {"part", part.empty() ? Json() : Json(part)}});
  }
  return joints;
}

void add_poses(const motion::Clip& clip, ArrayWriter& arrays) {
  const int frames = clip.frame_count();
  const int joints = clip.joint_count();
  std::vector<float> root;
  std::vector<float> rotations;
  std::vector<float> translations;
  for (int f = 0; f < frames; ++f) {
    for (int k = 0; k < 3; ++k) root.push_back(static_cast<float>(clip.root_positions()(k, f)));
    for (const Eigen::Quaterniond& q : clip.rotations(f))
      for (int k = 0; k < 4; ++k) rotations.push_back(static_cast<float>(q.coeffs()[k]));
    for (int j = 0; j < joints && clip.has_translations(); ++j) {
      const Eigen::Vector3d offset = clip.translation(f, j);
      for (int k = 0; k < 3; ++k) translations.push_back(static_cast<float>(offset[k]));
    }
  }
  arrays.add("root", "float32", root, {frames, 3});
  arrays.add("rotations", "float32", rotations, {frames, joints, 4});
  if (clip.has_translations())
    arrays.add("translations", "float32", translations, {frames, joints, 3});
}

void add_contacts(const motion::FootContacts& contacts, ArrayWriter& arrays) {
  using motion::FootPoint;
  std::vector<std::uint8_t> touching;
  for (int f = 0; f < contacts.frame_count(); ++f) {
    touching.push_back(contacts.touches(FootPoint::kLeftHeel, f) ||
                       contacts.touches(FootPoint::kLeftToe, f));
    touching.push_back(contacts.touches(FootPoint::kRightHeel, f) ||
                       contacts.touches(FootPoint::kRightToe, f));
  }
  arrays.add("contacts", "uint8", touching, {contacts.frame_count(), 2});
}

}  // namespace

std::string motion_bytes(const MotionMessage& message) {
  const motion::FoundContacts found = motion::find_foot_contacts(message.clip, message.humanoid);
  ArrayWriter arrays;
  add_poses(message.clip, arrays);
  add_contacts(found.contacts, arrays);
  if (!message.source_frames.empty()) {
    const std::vector<float> frames(message.source_frames.begin(), message.source_frames.end());
    arrays.add("source_frames", "float32", frames, {static_cast<int>(frames.size())});
  }
  Json header = {{"frames", message.clip.frame_count()},
                 {"rate_hz", message.clip.frame_rate_hz()},
                 {"floor_m", found.floor ? Json(found.floor->toe_m) : Json()},
                 {"leg_length_m", message.humanoid.leg_length_m()},
                 {"joints", joints_json(message.clip.skeleton(), message.humanoid)},
                 {"arrays", arrays.places()}};
  header.update(message.more);
  std::string text = header.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const auto size = static_cast<std::uint32_t>(text.size());
  std::string bytes(sizeof size, '\0');
  std::memcpy(bytes.data(), &size, sizeof size);
  return bytes + text + arrays.bytes();
}

}  // namespace laban::studio
