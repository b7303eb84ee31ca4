#include "laban/draw/animation.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "laban/base/csv.h"
#include "laban/base/error.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/resample.h"

#include "draw/animation_page.h"
#include "draw/canvas.h"
#include "draw/figure.h"
#include "draw/strip_motion.h"

namespace laban::draw {
namespace {

using base::Error;
using base::ErrorKind;
using base::format_number;

constexpr double kLevels = 65535.0;  // of a coordinate's 16 bits

/// A text as a JSON string that may stand inside a <script>: no "<" can end it.
std::string quoted(std::string_view text) {
  std::string json = "\"";
  for (const char c : printable(text)) {
    if (c == '"' || c == '\\') {
      json += '\\';
      json += c;
    } else if (c == '<' || c == '>' || c == '&') {
      std::array<char, 8> escape{};
      std::snprintf(escape.data(), escape.size(), "\\u%04x", static_cast<unsigned>(c));
      json += escape.data();
    } else {
      json += c;
    }
  }
  return json + '"';
}

std::string html_escaped(std::string_view text) {
  std::string safe;
  for (const char c : printable(text)) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else
      safe += c;
  }
  return safe;
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(bytes.size() / 3 * 4 + 4);
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    const std::size_t left = bytes.size() - n;
    std::uint32_t group = static_cast<std::uint32_t>(bytes[n]) << 16U;
    if (left > 1) group |= static_cast<std::uint32_t>(bytes[n + 1]) << 8U;
    if (left > 2) group |= bytes[n + 2];
    text += kDigits[group >> 18U];
    text += kDigits[(group >> 12U) & 63U];
    text += left > 1 ? kDigits[(group >> 6U) & 63U] : '=';
    text += left > 2 ? kDigits[group & 63U] : '=';
  }
  return text;
}

/// Numbers of a page need no more than six digits after the point.
std::string number(double value) {
  return format_number(std::round(value * 1e6) / 1e6);
}

template <typename Items, typename ToText>
std::string list(const Items& items, const ToText& to_text) {
  std::string text = "[";
  for (const auto& item : items) {
    if (text.size() > 1) text += ',';
    text += to_text(item);
  }
  return text + ']';
}

std::string vector(const Eigen::Vector3d& v) {
  return list(std::array{v.x(), v.y(), v.z()}, [](double part) { return format_number(part); });
}

/// What the page draws: the nodes of a body, then the head's center, then the points of the feet.
struct Scene {
  Body body;
  int nodes = 0;
  std::optional<int> head;               ///< node of its center
  std::vector<int> points;               ///< nodes of the feet
  std::vector<Eigen::Matrix3Xd> frames;  ///< 3 x nodes each
  std::vector<std::uint8_t> touching;    ///< a bit a point; empty without a humanoid
};

void add_feet(const motion::Clip& clip, const motion::Humanoid& humanoid, Scene& scene) {
  const motion::FootPaths paths = motion::foot_paths(clip, humanoid);
  const auto found = motion::find_foot_contacts(paths, humanoid.leg_length_m());
  for (std::size_t f = 0; f < scene.frames.size(); ++f) {
    const auto frame = static_cast<Eigen::Index>(f);
    std::uint8_t mask = 0;
    for (int p = 0; p < motion::kFootPointCount; ++p) {
      const auto point = static_cast<motion::FootPoint>(p);
      scene.frames[f].col(scene.points[static_cast<std::size_t>(p)]) =
          paths.points[static_cast<std::size_t>(p)].col(frame);
      if (found.contacts.touches(point, static_cast<int>(f))) {
        mask = static_cast<std::uint8_t>(mask | (1U << static_cast<unsigned>(p)));
      }
    }
    scene.touching.push_back(mask);
  }
}

Scene scene_of(const motion::Clip& clip, const std::optional<motion::Humanoid>& humanoid) {
  Scene scene;
  scene.body = describe_body(clip);
  const Eigen::Index nodes =
      clip.joint_count() + static_cast<Eigen::Index>(scene.body.end_site_joints.size());
  scene.nodes = static_cast<int>(nodes);
  if (scene.body.head) scene.head = scene.nodes++;
  for (int p = 0; humanoid && p < motion::kFootPointCount; ++p) {
    scene.points.push_back(scene.nodes++);
  }
  for (int f = 0; f < clip.frame_count(); ++f) {
    const Eigen::Matrix3Xd body = node_positions(clip, scene.body, f);
    Eigen::Matrix3Xd frame = Eigen::Matrix3Xd::Zero(3, scene.nodes);
    frame.leftCols(nodes) = body;
    if (scene.head) frame.col(*scene.head) = head_center(scene.body, body);
    scene.frames.push_back(std::move(frame));
  }
  if (humanoid) add_feet(clip, *humanoid, scene);
  return scene;
}

/// Positions as the page reads them: metres = low + step * number.
struct Quantised {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  std::string positions;  ///< base64 of little-endian 16-bit numbers
};

Quantised quantised(const Scene& scene) {
  Quantised result;
  Eigen::Vector3d high = scene.frames.front().rowwise().maxCoeff();
  result.low = scene.frames.front().rowwise().minCoeff();
  for (const Eigen::Matrix3Xd& frame : scene.frames) {
    result.low = result.low.cwiseMin(frame.rowwise().minCoeff());
    high = high.cwiseMax(frame.rowwise().maxCoeff());
  }
  result.step = (high - result.low) / kLevels;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(scene.frames.size() * static_cast<std::size_t>(scene.nodes) * 6);
  // A step of 0 (nothing moves along this axis) leaves differences of 0.
  const Eigen::Vector3d divisor = (result.step.array() > 0.0).select(result.step, 1.0);
  for (const Eigen::Matrix3Xd& frame : scene.frames) {
    for (Eigen::Index node = 0; node < frame.cols(); ++node) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const double value = (frame(axis, node) - result.low[axis]) / divisor[axis];
        const auto level = static_cast<unsigned>(std::lround(std::clamp(value, 0.0, kLevels)));
        bytes.push_back(static_cast<std::uint8_t>(level & 255U));
        bytes.push_back(static_cast<std::uint8_t>(level >> 8U));
      }
    }
  }
  result.positions = base64(bytes);
  return result;
}

const char* name_of(Side side) {
  if (side == Side::kLeft) return "left";
  return side == Side::kRight ? "right" : "trunk";
}

std::string limb_json(const Limb& limb) {
  return "{\"side\":" + quoted(name_of(limb.side)) + ",\"bones\":" +
         list(limb.bones,
              [](const Bone& bone) {
                return "[" + std::to_string(bone.from) + "," + std::to_string(bone.to) + "," +
                       number(bone.radius_from) + "," + number(bone.radius_to) + "]";
              }) +
         "}";
}

/// A lone joint has no bones: it is drawn as one of no length.
std::vector<Limb> limbs_of(const Body& body) {
  std::vector<Limb> limbs = body.limbs;
  if (limbs.size() == 1 && limbs[0].bones.empty()) {
    const double radius = 0.5 * body.size_m;
    limbs[0].bones.push_back({body.root, body.root, radius, radius});
  }
  return limbs;
}

std::string clip_json(const AnimatedClip& animated, const motion::Clip& clip, const Scene& scene,
                      const StripMotion& strip) {
  const Body& body = scene.body;
  const Quantised numbers = quantised(scene);
  const Eigen::Vector3d low = strip.anchors.rowwise().minCoeff();
  const Eigen::Vector3d high = strip.anchors.rowwise().maxCoeff();
  const Eigen::Vector3d middle = 0.5 * (low + high);
  const Eigen::Vector3d from = strip.camera.toward;
  std::string json = "{\"title\":" + quoted(animated.title) + ",\"note\":" + quoted(animated.note);
  const auto field = [&json](const char* name, const std::string& value) {
    json += ",\"" + std::string(name) + "\":" + value;
  };
  field("rate", format_number(clip.frame_rate_hz()));
  field("frames", std::to_string(clip.frame_count()));
  field("nodes", std::to_string(scene.nodes));
  field("root", std::to_string(body.root));
  field("size", number(body.size_m));
  field("floor", number(strip.floor));
  field("yaw", number(std::atan2(from.x(), from.z())));
  field("middle", list(std::array{middle.x(), middle.z()}, number));
  field("reach", number((high - low).norm()));
  field("limbs", list(limbs_of(body), limb_json));
  if (scene.head) {
    field("head", "{\"node\":" + std::to_string(*scene.head) +
                      ",\"radius\":" + number(body.head_radius()) + "}");
  }
  field("tracers", list(body.tracers, [&](const Tracer& tracer) {
          const int node = tracer.joint == body.head ? *scene.head : tracer.joint;
          return "[" + std::to_string(node) + ",\"" + name_of(tracer.side) + "\"]";
        }));
  field("marks", list(animated.marks_s, number));
  field("points", list(scene.points, [](int node) { return std::to_string(node); }));
  if (!scene.touching.empty()) field("contacts", '"' + base64(scene.touching) + '"');
  field("low", vector(numbers.low));
  field("step", vector(numbers.step));
  field("positions", '"' + numbers.positions + '"');
  return json + "}";
}

/// Seconds of the first clip at each displayed frame of the last.
std::string moments_json(const AnimationOptions& options, double source_rate_hz,
                         double last_rate_hz, const motion::Clip& shown) {
  std::vector<double> moments;
  const auto last = static_cast<double>(options.source_frames.size() - 1);
  for (int f = 0; f < shown.frame_count(); ++f) {
    const double at = std::min(f / shown.frame_rate_hz() * last_rate_hz, last);
    const auto below = static_cast<std::size_t>(at);
    const std::size_t above = std::min(below + 1, options.source_frames.size() - 1);
    const double share = at - static_cast<double>(below);
    moments.push_back(
        ((1.0 - share) * options.source_frames[below] + share * options.source_frames[above]) /
        source_rate_hz);
  }
  return list(moments, number);
}

void require_valid(std::span<const AnimatedClip> clips, const AnimationOptions& options) {
  if (const auto problems = options.problems(); !problems.empty()) {
    throw Error(ErrorKind::kUsage, problems.front());
  }
  if (clips.empty() || std::ssize(clips) > kMaxAnimatedClips) {
    throw Error(ErrorKind::kUsage, "animation: " + std::to_string(clips.size()) +
                                       " clips (must be 1 .. " + std::to_string(kMaxAnimatedClips) +
                                       ")");
  }
  const auto& frames = options.source_frames;
  if (frames.empty()) return;
  const bool finite =
      std::all_of(frames.begin(), frames.end(), [](double f) { return std::isfinite(f); });
  if (!finite || std::ssize(frames) != clips.back().clip.frame_count()) {
    throw Error(ErrorKind::kData,
                "animation: source_frames must be one a frame of the last clip, all finite");
  }
}

/// The template with its two blanks filled in.
std::string filled_page(const std::string& title, const std::string& data) {
  constexpr std::string_view kTitle = "{{title}}", kData = "{{data}}";
  const std::size_t title_at = kAnimationPage.find(kTitle);
  const std::size_t data_at = kAnimationPage.find(kData);
  LABAN_CHECK(title_at < data_at && data_at != std::string_view::npos);
  std::string page(kAnimationPage.substr(0, title_at));
  page += title;
  page += kAnimationPage.substr(title_at + kTitle.size(), data_at - title_at - kTitle.size());
  page += data;
  page += kAnimationPage.substr(data_at + kData.size());
  return page;
}

}  // namespace

std::vector<std::string> AnimationOptions::problems() const {
  std::vector<std::string> problems;
  if (!(max_frame_rate_hz > 0.0) || !std::isfinite(max_frame_rate_hz)) {
    problems.push_back("AnimationOptions::max_frame_rate_hz = " + format_number(max_frame_rate_hz) +
                       " (must be > 0)");
  }
  return problems;
}

std::string animation(std::span<const AnimatedClip> clips, const AnimationOptions& options) {
  require_valid(clips, options);
  std::string json = "{\"clips\":[", titles;
  for (std::size_t n = 0; n < clips.size(); ++n) {
    const AnimatedClip& animated = clips[n];
    const motion::Clip shown = animated.clip.frame_rate_hz() > options.max_frame_rate_hz
                                   ? motion::resample(animated.clip, options.max_frame_rate_hz)
                                   : animated.clip;
    const Strip strip{shown, animated.title, {}, {}};
    const StripMotion described = describe_strip(strip, n, {}, View::kThreeQuarter);
    const Scene scene = scene_of(shown, animated.humanoid);
    if (n > 0) json += ',';
    json += clip_json(animated, shown, scene, described);
    titles += (n > 0 ? " | " : "") + animated.title;
    if (n + 1 == clips.size()) {
      json += ']';
      if (!options.source_frames.empty()) {
        json += ",\"moments\":" + moments_json(options, clips.front().clip.frame_rate_hz(),
                                               animated.clip.frame_rate_hz(), shown);
      }
    }
  }
  return filled_page(html_escaped(options.title.empty() ? titles : options.title), json + "}");
}

}  // namespace laban::draw
