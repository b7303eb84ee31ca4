#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "laban/base/error.h"
#include "laban/io/bvh.h"
#include "laban/math/constants.h"
#include "laban/math/rotation.h"

namespace laban::io {
namespace {

constexpr double kQuarterTurn = std::numbers::pi / 2.0;

// A rotation is off by at most the sum of its three angles' errors: 3 * 0.5e-6 < 1e-5 degrees.
constexpr int kAngleDecimals = 6;

// Offsets are written in steps of at most 1e-8 m: half a step on each of 30 joints in a chain keeps
// a fingertip within 1e-6 m, with room for the angles' own error.
constexpr double kPositionStepM = 1e-8;

// A joint that leaves its rest offset by no more than this is written without position channels.
constexpr double kStillChannelM = 1e-7;

// Below this cosine of the middle angle the first and third turn about one axis (gimbal lock): any
// first angle will do, as the third is computed after it.
constexpr double kGimbalCosine = 1e-6;

constexpr std::array<double, 16> kPowersOfTen = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
constexpr double kWholeLimit = 9007199254740992.0;  // 2^53: below it doubles hold every integer

/// Appends numbers as text, without exponents, which not every reader knows.
class NumberWriter {
 public:
  explicit NumberWriter(std::string& text) : text_(text) {}

  /// Rounded to `decimals` (at most 15) digits after the point; trailing zeros are left out.
  void append(double value, int decimals) {
    const double scaled = std::round(value * kPowersOfTen[static_cast<std::size_t>(decimals)]);
    if (std::abs(scaled) < kWholeLimit) {
      append_scaled(static_cast<std::int64_t>(scaled), decimals);
    } else {
      append_shortest(value);  // so large that a double has hardly any decimals
    }
  }

  /// As few digits as give the same double again.
  void append_shortest(double value) {
    const auto [last, status] =
        std::to_chars(digits_.begin(), digits_.end(), value, std::chars_format::fixed);
    LABAN_CHECK(status == std::errc());
    text_.append(digits_.begin(), last);
  }

 private:
  /// whole / 10^decimals. Several times as fast as std::to_chars with a precision.
  void append_scaled(std::int64_t whole, int decimals) {
    while (decimals > 0 && whole % 10 == 0) {
      whole /= 10;
      --decimals;
    }
    if (whole < 0) text_ += '-';
    const auto [last, status] = std::to_chars(digits_.begin(), digits_.end(), std::abs(whole));
    LABAN_CHECK(status == std::errc());
    const std::string_view digits(digits_.data(), static_cast<std::size_t>(last - digits_.data()));
    const auto after_point = static_cast<std::size_t>(decimals);
    if (digits.size() <= after_point) {
      text_ += "0.";
      text_.append(after_point - digits.size(), '0');
      text_ += digits;
    } else {
      text_ += digits.substr(0, digits.size() - after_point);
      if (after_point == 0) return;
      text_ += '.';
      text_ += digits.substr(digits.size() - after_point);
    }
  }

  std::string& text_;
  std::array<char, 512> digits_{};  // a double has at most 309 digits before the point or 340 after
};

/// The order of rotation channels: R = R_i(a) R_j(b) R_k(c).
struct EulerOrder {
  int i = 2;
  int j = 0;
  int k = 1;
  double sign = 1.0;  // +1 if (i, j, k) is a cyclic shift of (x, y, z), else -1
};

EulerOrder euler_order(std::string_view letters) {
  EulerOrder order;
  order.i = letters[0] - 'X';
  order.j = letters[1] - 'X';
  order.k = letters[2] - 'X';
  order.sign = (order.i + 1) % 3 == order.j ? 1.0 : -1.0;
  return order;
}

/// The second and third angle once the first is chosen.
///
/// With M = R_i(-a) R = R_j(b) R_k(c): row j of M is row j of R_k(c), and column k of M is column k
/// of R_j(b). Each is well conditioned for any a, so the three together give R even where the first
/// is ill-determined.
Eigen::Vector3d angles_after_first(const Eigen::Matrix3d& R, const EulerOrder& o, double a) {
  const double cos_a = std::cos(a);
  const double sin_a = o.sign * std::sin(a);
  const double b = std::atan2(o.sign * R(o.i, o.k), cos_a * R(o.k, o.k) - sin_a * R(o.j, o.k));
  const double c = std::atan2(o.sign * (cos_a * R(o.j, o.i) + sin_a * R(o.k, o.i)),
                              cos_a * R(o.j, o.j) + sin_a * R(o.k, o.j));
  return {a, b, c};
}

/// `angles`, each shifted by full turns to lie nearest to `previous`.
Eigen::Vector3d unwrapped(const Eigen::Vector3d& angles, const Eigen::Vector3d& previous) {
  Eigen::Vector3d nearest;
  for (Eigen::Index n = 0; n < 3; ++n) nearest[n] = math::nearest_angle(angles[n], previous[n]);
  return nearest;
}

/// Euler angles of a rotation, radians: of the two solutions (first angle half a turn apart) and
/// their full turns, the one nearest to the angles before it in time.
Eigen::Vector3d euler_angles(const Eigen::Quaterniond& q, const EulerOrder& o,
                             const Eigen::Vector3d& previous) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  // R(j,k) = -sign sin(a) cos(b), R(k,k) = cos(a) cos(b).
  const bool locked = std::hypot(R(o.j, o.k), R(o.k, o.k)) < kGimbalCosine;
  if (locked) return unwrapped(angles_after_first(R, o, previous[0]), previous);
  const double a = std::atan2(-o.sign * R(o.j, o.k), R(o.k, o.k));
  const Eigen::Vector3d one = unwrapped(angles_after_first(R, o, a), previous);
  // The other solution's first angle is half a turn away: too far to be nearer.
  if ((one - previous).squaredNorm() < kQuarterTurn * kQuarterTurn) return one;
  const Eigen::Vector3d other = unwrapped(angles_after_first(R, o, a + std::numbers::pi), previous);
  return (other - previous).squaredNorm() < (one - previous).squaredNorm() ? other : one;
}

/// A name as every reader takes it: [A-Za-z0-9_], not empty.
std::string plain_name(std::string_view name) {
  std::string plain(name);
  for (char& c : plain) {
    const bool kept =
        (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
    if (!kept) c = '_';
  }
  return plain.empty() ? "joint" : plain;
}

/// A unique plain name a joint. Names that are plain already keep their name, the first of equals.
std::vector<std::string> unique_names(const motion::Skeleton& skeleton) {
  std::vector<std::string> names;
  std::unordered_set<std::string> taken;
  for (const motion::Joint& joint : skeleton.joints()) {
    const bool keeps = plain_name(joint.name) == joint.name && taken.insert(joint.name).second;
    names.push_back(keeps ? joint.name : std::string());
  }
  std::unordered_map<std::string, int> next_number;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!names[i].empty()) continue;
    const std::string plain = plain_name(skeleton.joints()[i].name);
    names[i] = plain;
    int& number = next_number.try_emplace(plain, 2).first->second;
    while (!taken.insert(names[i]).second) names[i] = plain + "_" + std::to_string(number++);
  }
  return names;
}

/// What the hierarchy and the rows must agree on.
struct Layout {
  std::vector<std::size_t> order;          // joints, depth first
  std::vector<std::vector<int>> children;  // of each joint
  // Joints with position channels. Readers disagree on these: Blender and assimp put them in the
  // OFFSET's place, three.js adds them to it. So such a joint's OFFSET is 0 0 0.
  std::vector<bool> has_positions;
};

/// @param all_positions  of a clip that animates positions every joint, whether it moves or not:
///                       what comes later is not known.
Layout make_layout(const motion::Clip& clip, bool all_positions) {
  const motion::Skeleton& skeleton = clip.skeleton();
  Layout layout;
  layout.children.resize(skeleton.joints().size());
  for (int j = 1; j < clip.joint_count(); ++j) {
    layout.children[static_cast<std::size_t>(skeleton.joint(j).parent)].push_back(j);
  }
  std::vector<int> open = {0};
  while (!open.empty()) {
    const auto joint = static_cast<std::size_t>(open.back());
    open.pop_back();
    layout.order.push_back(joint);
    const std::vector<int>& children = layout.children[joint];
    open.insert(open.end(), children.rbegin(), children.rend());
  }
  layout.has_positions.assign(skeleton.joints().size(), all_positions && clip.has_translations());
  layout.has_positions[0] = true;
  if (!clip.has_translations() || all_positions) return layout;
  for (int f = 0; f < clip.frame_count(); ++f) {
    for (int j = 1; j < clip.joint_count(); ++j) {
      if ((clip.translation(f, j) - skeleton.joint(j).rest_offset).norm() > kStillChannelM) {
        layout.has_positions[static_cast<std::size_t>(j)] = true;
      }
    }
  }
  return layout;
}

int position_decimals(const BvhWriteOptions& options) {
  if (options.decimals) return *options.decimals;
  const double decimals = std::ceil(std::log10(options.unit_m / kPositionStepM) - 1e-9);
  return static_cast<int>(std::clamp(decimals, 0.0, 15.0));
}

class BvhWriter {
 public:
  BvhWriter(const motion::Clip& clip, const BvhWriteOptions& options, bool all_positions = false)
      : skeleton_(clip.shared_skeleton()),
        options_(options),
        layout_(make_layout(clip, all_positions)),
        names_(unique_names(clip.skeleton())),
        angles_(names_.size(), Eigen::Vector3d::Zero()),
        position_decimals_(position_decimals(options)),
        angle_decimals_(options.decimals.value_or(kAngleDecimals)) {}

  /// All that comes before the rows.
  void write_head(std::int64_t frame_count, double frame_rate_hz) {
    write_hierarchy();
    text_ += "MOTION\nFrames: " + std::to_string(frame_count) + "\nFrame Time: ";
    number_.append_shortest(1.0 / frame_rate_hz);
    text_ += '\n';
  }

  /// A row for each frame; Euler angles go on from the rows before.
  void write_rows(const motion::Clip& clip) {
    const EulerOrder order = euler_order(options_.rotation_order);
    for (int f = 0; f < clip.frame_count(); ++f) {
      const std::size_t row_begin = text_.size();
      for (const std::size_t j : layout_.order) {
        const int joint = static_cast<int>(j);
        if (layout_.has_positions[j]) write_positions(clip.translation(f, joint), " ");
        angles_[j] = euler_angles(clip.rotation(f, joint), order, angles_[j]);
        for (const double angle : angles_[j]) {
          text_ += ' ';
          number_.append(angle / math::kDegree, angle_decimals_);
        }
      }
      text_.erase(row_begin, 1);
      text_ += '\n';
    }
  }

  /// What has been written since the last call.
  [[nodiscard]] std::string take_text() { return std::exchange(text_, {}); }

  [[nodiscard]] std::vector<std::string> renames() const {
    std::vector<std::string> found;
    for (std::size_t j = 0; j < names_.size(); ++j) {
      const std::string& name = skeleton_->joints()[j].name;
      if (name != names_[j]) found.push_back("'" + name + "' is written as '" + names_[j] + "'");
    }
    return found;
  }

 private:
  void indent() { text_.append(blocks_.size(), '\t'); }

  void open_block() {
    indent();
    text_ += "{\n";
  }

  void write_positions(const Eigen::Vector3d& position_m, std::string_view between) {
    for (const double value : position_m) {
      text_ += between;
      number_.append(value / options_.unit_m, position_decimals_);
    }
  }

  void write_offset(const Eigen::Vector3d& offset_m) {
    indent();
    text_ += "OFFSET";
    write_positions(offset_m, " ");
    text_ += '\n';
  }

  void write_channels(std::size_t joint) {
    indent();
    text_ +=
        layout_.has_positions[joint] ? "CHANNELS 6 Xposition Yposition Zposition" : "CHANNELS 3";
    for (const char axis : options_.rotation_order)
      (text_ += ' ') += axis + std::string("rotation");
    text_ += '\n';
  }

  void write_end_site(const motion::Joint& joint) {
    indent();
    text_ += "End Site\n";
    open_block();
    blocks_.push_back(-1);
    write_offset(joint.end_site.value_or(Eigen::Vector3d::Zero()));
    close_block();
  }

  void close_block() {
    blocks_.pop_back();
    indent();
    text_ += "}\n";
  }

  void write_hierarchy() {
    text_ += "HIERARCHY\n";
    for (const std::size_t index : layout_.order) {
      const motion::Joint& joint = skeleton_->joints()[index];
      while (!blocks_.empty() && blocks_.back() != joint.parent) close_block();
      indent();
      text_ += (index == 0 ? "ROOT " : "JOINT ") + names_[index] + '\n';
      open_block();
      blocks_.push_back(static_cast<int>(index));
      write_offset(layout_.has_positions[index] ? Eigen::Vector3d::Zero() : joint.rest_offset);
      write_channels(index);
      if (layout_.children[index].empty()) write_end_site(joint);
    }
    while (!blocks_.empty()) close_block();
  }

  std::shared_ptr<const motion::Skeleton> skeleton_;
  BvhWriteOptions options_;
  Layout layout_;
  std::vector<std::string> names_;
  std::vector<Eigen::Vector3d> angles_;  // of the row before
  int position_decimals_;
  int angle_decimals_;
  std::string text_;
  NumberWriter number_{text_};
  std::vector<int> blocks_;  // joints whose braces are open, -1 an end site
};

}  // namespace

std::vector<std::string> BvhWriteOptions::problems() const {
  std::vector<std::string> found;
  if (!(unit_m > 0.0 && unit_m <= 1e6)) {
    found.push_back("BvhWriteOptions::unit_m = " + std::to_string(unit_m) +
                    " (must be > 0 and at most 1e6)");
  }
  std::string sorted = rotation_order;
  std::sort(sorted.begin(), sorted.end());
  if (sorted != "XYZ") {
    found.push_back("BvhWriteOptions::rotation_order = \"" + rotation_order +
                    "\" (must be a permutation of \"XYZ\")");
  }
  if (decimals && (*decimals < 0 || *decimals > 15)) {
    found.push_back("BvhWriteOptions::decimals = " + std::to_string(*decimals) +
                    " (must be from 0 to 15)");
  }
  return found;
}

BvhText write_bvh(const motion::Clip& clip, const BvhWriteOptions& options) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw base::Error(base::ErrorKind::kUsage, problems.front());
  BvhWriter writer(clip, options);
  writer.write_head(clip.frame_count(), clip.frame_rate_hz());
  writer.write_rows(clip);
  return {writer.take_text(), writer.renames()};
}

class BvhStream::Impl {
 public:
  Impl(const motion::Clip& clip, const BvhWriteOptions& options)
      : skeleton(clip.shared_skeleton()),
        rate_hz(clip.frame_rate_hz()),
        writer(clip, options, true) {}

  std::shared_ptr<const motion::Skeleton> skeleton;
  double rate_hz;
  BvhWriter writer;
};

BvhStream::BvhStream(const motion::Clip& clip, const BvhWriteOptions& options) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw base::Error(base::ErrorKind::kUsage, problems.front());
  impl_ = std::make_unique<Impl>(clip, options);
}
BvhStream::BvhStream(BvhStream&&) noexcept = default;
BvhStream& BvhStream::operator=(BvhStream&&) noexcept = default;
BvhStream::~BvhStream() = default;

std::string BvhStream::head(std::int64_t frame_count) {
  impl_->writer.write_head(frame_count, impl_->rate_hz);
  return impl_->writer.take_text();
}

std::string BvhStream::rows(const motion::Clip& piece) {
  if (piece.joint_count() != impl_->skeleton->joint_count() ||
      piece.frame_rate_hz() != impl_->rate_hz) {
    throw base::Error(base::ErrorKind::kData,
                      "a piece of a BVH stream must have the joints and the rate of the first");
  }
  impl_->writer.write_rows(piece);
  return impl_->writer.take_text();
}

std::vector<std::string> BvhStream::renames() const {
  return impl_->writer.renames();
}

}  // namespace laban::io
