#include "texture_state.h"

#include <algorithm>

#include "laban/motion/reach.h"

#include "state_reader.h"

namespace laban::cli {
namespace {

constexpr const char* kTextureSchema = "laban.texture-room/1";
constexpr const char* kTextureRoom = "the texture room";
constexpr std::size_t kMostTextons = 2000;
constexpr int kLongestTexton = 100'000;
/// Frames that textons are stretched to, together.
constexpr int kMostStretched = 500'000;
/// Metres from the hips: beyond any body.
constexpr double kFarthestPlace = 10.0;

JointPin read_pin(const Json& json, const std::string& where) {
  ObjectReader reader(json, where + ": a pin");
  JointPin pin;
  pin.frame = reader.count("frame", 0, kLongestTexton);
  const std::string name = reader.text("joint");
  const auto& names = motion::kStandardJointNames;
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) pin.joint = static_cast<motion::StandardJoint>(found - names.begin());
  if (found == names.end() || !motion::can_reach(pin.joint))
    reader.fail_at("joint", "is none of hips, head, and left or right hand, forearm, foot, shin");
  const Json& place = reader.at("place");
  if (!place.is_array() || place.size() != 3) reader.fail_at("place", "is no list of 3 numbers");
  for (std::size_t k = 0; k < 3; ++k) {
    const double value = reader.number_in(place[k], "place");
    if (!(std::abs(value) <= kFarthestPlace)) reader.fail_at("place", "is more than 10 m away");
    pin.place[static_cast<Eigen::Index>(k)] = value;
  }
  reader.require_no_more();
  return pin;
}

TextonBlock read_block(const Json& json, const std::string& where) {
  ObjectReader reader(json, where + ": a texton");
  TextonBlock block;
  block.planned.texton = reader.count("texton", 0, 1'000'000);
  if (reader.find("frames") != nullptr)
    block.planned.length = reader.count("frames", 5, kLongestTexton);
  const Json& pins = reader.at("pins");
  if (!pins.is_array()) reader.fail_at("pins", "is no list");
  for (const Json& pin : pins) block.pins.push_back(read_pin(pin, where));
  reader.require_no_more();
  return block;
}

void check_stretched(const std::vector<TextonBlock>& path, ObjectReader& reader) {
  std::int64_t frames = 0;
  for (const TextonBlock& block : path) frames += block.planned.length.value_or(0);
  if (frames > kMostStretched)
    reader.fail_at("textons", "are stretched to more than 500000 frames in all");
}

Json block_json(const TextonBlock& block) {
  Json pins = Json::array();
  for (const JointPin& pin : block.pins) {
    pins.push_back(
        {{"frame", pin.frame},
         {"joint",
          motion::kStandardJointNames[static_cast<std::size_t>(motion::index_of(pin.joint))]},
         {"place", {pin.place.x(), pin.place.y(), pin.place.z()}}});
  }
  return {{"texton", block.planned.texton},
          {"frames", block.planned.length ? Json(*block.planned.length) : Json()},
          {"pins", pins}};
}

}  // namespace

Json to_json(const TextureState& state) {
  const texture::TextureMotionOptions& options = state.choices.options;
  Json textons = Json::array();
  for (const TextonBlock& block : state.choices.path) textons.push_back(block_json(block));
  return {{"schema", kTextureSchema},     {"texture", state.texture},       {"textons", textons},
          {"noise", options.noise_level}, {"variation", options.variation}, {"seed", options.seed},
          {"foot_fix", options.hold_feet}};
}

TextureState read_texture_state(const Json& json, const std::string& name) {
  ObjectReader reader(json, name);
  reader.require_schema(kTextureSchema, kTextureRoom);
  TextureState state;
  state.texture = reader.text("texture");
  const Json& textons = reader.at("textons");
  if (!textons.is_array() || textons.empty() || textons.size() > kMostTextons)
    reader.fail_at("textons", "is no list of 1 to 2000 textons");
  for (const Json& texton : textons) state.choices.path.push_back(read_block(texton, name));
  check_stretched(state.choices.path, reader);
  texture::TextureMotionOptions& options = state.choices.options;
  options.noise_level = reader.number("noise", 0.0, 10.0);
  options.variation = reader.number("variation", 0.0, 1.0);
  options.seed = static_cast<std::uint64_t>(reader.count("seed", 0, 1'000'000));
  options.hold_feet = reader.flag("foot_fix");
  reader.require_no_more();
  return state;
}

TextureState parse_texture_state(std::string_view text, const std::string& name) {
  return read_texture_state(parse_state(text, name), name);
}

}  // namespace laban::cli
