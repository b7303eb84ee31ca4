#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/manifold/manifold_file.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/texture/texture_file.h"

#include "files.h"
#include "manifold.h"
#include "report.h"
#include "texture.h"
#include "verb.h"

namespace laban::cli {
namespace {

struct InspectVerb {
  Common common;
  ReadClipOptions reading;
  std::string input;
  bool check = false;
};

/// Height of the highest over the lowest joint at a frame, metres.
double body_extent_m(const motion::Clip& clip, int frame) {
  const Eigen::Matrix3Xd positions = motion::forward_kinematics(clip, frame).positions;
  return positions.row(1).maxCoeff() - positions.row(1).minCoeff();
}

Json describe_rig(const motion::Clip& clip, const motion::HumanoidOptions& options) {
  try {
    const motion::Humanoid rig = motion::find_humanoid(clip, options);
    Json json = {{"name", rig.rig_name()},
                 {"leg_length_m", rig.leg_length_m()},
                 {"t_pose_frame", rig.has_t_pose_frame()}};
    for (int s = 0; s < motion::kStandardJointCount; ++s) {
      const auto& mapped = rig.mapped(static_cast<motion::StandardJoint>(s));
      json["joints"][std::string(motion::kStandardJointNames[static_cast<std::size_t>(s)])] =
          mapped ? Json(clip.skeleton().joint(mapped->joint).name) : Json();
    }
    return json;
  } catch (const base::Error& error) {
    return {{"problem", error.what()}};
  }
}

void print(const InspectVerb& verb, const Json& clip) {
  for (const Json& warning : clip["warnings"]) warn(verb.common, warning.get<std::string>());
  fmt::print("{}: {} clip, {} joints, {} frames at {:g} Hz{} ({:.2f} s)\n", verb.input,
             clip["format"].get<std::string>(), clip["joints"].get<int>(),
             clip["frames"].get<int>(), clip["frame_rate_hz"].get<double>(),
             clip["frame_rate_guessed"].get<bool>() ? " (assumed; the file does not say)" : "",
             clip["duration_s"].get<double>());
  fmt::print("unit {:g} m{}, {} up; the body spans {:.2f} m at mid-clip\n",
             clip["unit_m"].get<double>(),
             clip["unit_guessed"].get<bool>() ? " (guessed from the body's size)" : "",
             clip["up_axis"].get<std::string>(), clip["extent_m"].get<double>());
  for (std::size_t a = 0; a < clip["animations"].size(); ++a) {
    fmt::print("animation {}: {}{}\n", a, clip["animations"][a].get<std::string>(),
               clip["animation"] == a ? " (read)" : "");
  }
  const Json& rig = clip["rig"];
  if (rig.contains("problem")) {
    fmt::print("no person found: {}\n", rig["problem"].get<std::string>());
    return;
  }
  fmt::print("rig {}, leg {:.2f} m{}\n", rig["name"].get<std::string>(),
             rig["leg_length_m"].get<double>(),
             rig["t_pose_frame"].get<bool>() ? ", frame 0 is a T-pose and no motion" : "");
  for (const auto& [standard, name] : rig["joints"].items()) {
    fmt::print("  {:<16} {}\n", standard, name.is_null() ? "-" : name.get<std::string>());
  }
}

void inspect_clip(const InspectVerb& verb, const std::string& bytes) {
  Common quiet = verb.common;
  quiet.quiet = true;  // the warnings are part of what is told below
  const io::ClipFile file = parse_any_clip(verb.input, bytes, verb.reading, quiet);
  const motion::Clip& clip = file.clip;
  const Json rig = describe_rig(clip, read_map(verb.reading.map));
  const Json json = {{"schema", "laban.inspect/1"},
                     {"kind", "clip"},
                     {"format", file.format},
                     {"frames", clip.frame_count()},
                     {"frame_rate_hz", clip.frame_rate_hz()},
                     {"frame_rate_guessed", file.frame_rate_guessed},
                     {"duration_s", clip.duration_s()},
                     {"joints", clip.joint_count()},
                     {"animates_translations", clip.has_translations()},
                     {"unit_m", file.unit_m},
                     {"unit_guessed", file.unit_guessed},
                     {"up_axis", name_of(file.up_axis)},
                     {"extent_m", body_extent_m(clip, clip.frame_count() / 2)},
                     {"rig", rig},
                     {"animations", file.animations},
                     {"animation", file.animations.empty() ? Json() : Json(file.animation)},
                     {"warnings", file.warnings}};
  if (verb.common.json) {
    fmt::print("{}\n", json.dump(2));
  } else {
    print(verb, json);
  }
  if (verb.check && (!file.warnings.empty() || rig.contains("problem"))) throw CheckFailed();
}

void inspect_model(const InspectVerb& verb, const std::string& bytes) {
  const transfer::StyleModel model = transfer::read_style_model(bytes, verb.input);
  Json json = {{"schema", "laban.inspect/1"},
               {"kind", "style model"},
               {"frame_rate_hz", model.frame_rate_hz()},
               {"contents", model.contents.names},
               {"regressor", effort::name_of(model.regressor.kind())},
               {"metric_dimensions", model.database.metric().dimension_count()},
               {"fragments", Json::array()},
               {"record", Json::parse(model.record_json)}};
  for (std::size_t n = 0; n < model.fragments.size(); ++n) {
    const transfer::Fragment& fragment = model.fragments[n];
    json["fragments"].push_back({{"name", fragment.name},
                                 {"content", fragment.content},
                                 {"performer", fragment.performer},
                                 {"frames", fragment.pose.frame_count()},
                                 {"content_margin", model.content_margins[n]},
                                 {"effort", to_json(*fragment.effort)}});
  }
  if (verb.common.json) {
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: style model, {} fragments at {:g} Hz, regressor {}\n", verb.input,
             model.fragments.size(), model.frame_rate_hz(),
             effort::name_of(model.regressor.kind()));
  std::string contents;
  for (const std::string& name : model.contents.names) contents += " " + name;
  fmt::print("contents:{}\n", contents);
  if (!verb.common.verbose) return;
  for (const transfer::Fragment& fragment : model.fragments) {
    fmt::print("  {:<32} {:<12} {:<12} {:>5} frames  {}\n", fragment.name, fragment.content,
               fragment.performer, fragment.pose.frame_count(), to_text(*fragment.effort));
  }
}

void inspect_manifold(const InspectVerb& verb, const std::string& bytes) {
  const manifold::PoseManifold manifold = manifold::read_manifold(bytes, verb.input);
  if (!verb.common.json) {
    fmt::print("{}: {}", verb.input, manifold_text(manifold));
    return;
  }
  Json json = {{"schema", "laban.inspect/1"}, {"kind", "manifold"}};
  json.update(describe_manifold(manifold));
  json["record"] = Json::parse(manifold.record_json);
  fmt::print("{}\n", json.dump(2));
}

void inspect_texture(const InspectVerb& verb, const std::string& bytes) {
  const texture::MotionTexture texture = texture::read_texture(bytes, verb.input);
  if (!verb.common.json) {
    fmt::print("{}: {}", verb.input, texture_text(texture, verb.common.verbose));
    return;
  }
  Json json = {{"schema", "laban.inspect/1"}, {"kind", "texture"}};
  json.update(describe_texture(texture));
  json["record"] = Json::parse(texture.record_json);
  fmt::print("{}\n", json.dump(2));
}

void inspect_table(const InspectVerb& verb, const std::string& text) {
  const effort::LabelTable table = effort::parse_label_table(text, verb.input);
  const auto blank = effort::blank_rows(table);
  if (verb.common.json) {
    const Json json = {{"schema", "laban.inspect/1"},
                       {"kind", "label table"},
                       {"rows", table.rows.size()},
                       {"fragments", effort::seeds(table).size()},
                       {"blends", effort::blends(table).size()},
                       {"blank", blank}};
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{}: label table, {} rows: {} of fragments, {} of blends, {} still blank\n",
             verb.input, table.rows.size(), effort::seeds(table).size(),
             effort::blends(table).size(), blank.size());
  for (const std::string& row : blank) tell(verb.common, row);
}

void run(const InspectVerb& verb) {
  const std::string bytes = read_bytes(verb.input);
  // The kind stands in the container's head.
  const bool is_container = bytes.starts_with("laban\r\n");
  const std::string head = bytes.substr(0, 64);
  if (is_container && head.find("laban.manifold") != head.npos)
    return inspect_manifold(verb, bytes);
  if (is_container && head.find("laban.texture") != head.npos) return inspect_texture(verb, bytes);
  if (is_container) return inspect_model(verb, bytes);
  if (verb.input.ends_with(".csv")) return inspect_table(verb, bytes);
  inspect_clip(verb, bytes);
}

}  // namespace

void add_inspect(CLI::App& app) {
  auto verb = std::make_shared<InspectVerb>();
  CLI::App* sub =
      add_verb(app, "inspect",
               "Tell what is in a clip, a style model, a manifold, a texture or a label table",
               "laban inspect capture.bvh");
  sub->add_option(
         "INPUT", verb->input,
         "clip, style model (.laban), manifold (.manifold), texture (.texture) or label table "
         "(.csv)")
      ->required();
  sub->add_flag("--check", verb->check,
                "exit with 7 if a clip needs mending or no person is found in it");
  add_read_options(sub, verb->reading);
  add_common(sub, verb->common);
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
