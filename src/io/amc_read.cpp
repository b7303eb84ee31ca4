#include <algorithm>
#include <cmath>
#include <map>

#include "laban/base/error.h"
#include "laban/io/asf_amc.h"
#include "laban/math/constants.h"

#include "io/text_scanner.h"
#include "io/warnings.h"

namespace laban::io {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Rotations that any file may ask for, however small it is; above that one for each 4 bytes, which
// real files stay below by a factor of eight.
constexpr std::size_t kFreeRotations = std::size_t{1} << 20U;
constexpr std::size_t kBytesARotation = 4;

constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

bool is_rotation(AsfDof dof) {
  return dof == AsfDof::kRx || dof == AsfDof::kRy || dof == AsfDof::kRz;
}

/// Lines that begin with a digit: as many as there are frames, at most.
std::size_t count_frames(std::string_view text) {
  std::size_t count = 0;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && is_digit(c)) ++count;
    line_begins = c == '\n' || c == '\r' || (line_begins && (c == ' ' || c == '\t'));
  }
  return count;
}

/// What a line of an AMC says of a joint.
struct JointValues {
  Quaterniond rotation = Quaterniond::Identity();
  Vector3d shift = Vector3d::Zero();  // in the bone's axes, file units
  double stretch = 0.0;               // file units
};

/// q becomes (rotation about an axis by an angle) * q.
void turn(Quaterniond& q, Eigen::Index axis, double angle) {
  const double c = std::cos(0.5 * angle);
  const double s = std::sin(0.5 * angle);
  const Eigen::Index b = (axis + 1) % 3;
  const Eigen::Index d = (axis + 2) % 3;
  const Eigen::Vector4d v = q.coeffs();  // x, y, z, w
  q.coeffs()[axis] = v[axis] * c + v[3] * s;
  q.coeffs()[b] = v[b] * c - v[d] * s;
  q.coeffs()[d] = v[d] * c + v[b] * s;
  q.coeffs()[3] = v[3] * c - v[axis] * s;
}

/// What a clip is made of.
struct DraftMotion {
  std::size_t frame_count = 0;
  std::vector<Vector3d> root_positions;
  std::vector<Quaterniond> rotations;
  std::vector<Vector3d> translations;  // empty unless bones below the root shift or stretch
};

class MotionReader {
 public:
  MotionReader(TextScanner& scanner, std::string_view text, const AsfFile& skeleton,
               Warnings& warnings)
      : scanner_(scanner), text_(text), asf_(skeleton), warnings_(warnings) {
    degrees_ = asf_.degrees;
    for (std::size_t j = 0; j < asf_.joints.size(); ++j) {
      index_.emplace(asf_.skeleton->joint(static_cast<int>(j)).name, j);
      for (const AsfDof dof : asf_.joints[j].dofs) translates_ |= j > 0 && !is_rotation(dof);
    }
    seen_in_.assign(asf_.joints.size(), 0);
    values_.resize(asf_.joints.size());
  }

  [[nodiscard]] DraftMotion read() {
    bool more = read_header();
    if (!more) scanner_.fail_at(scanner_.offset(), "there is no frame; the file has no motion");
    reserve();
    while (more) more = read_frame();
    return std::move(motion_);
  }
  /// :SAMPLES-PER-SECOND, if the header had it.
  [[nodiscard]] std::optional<double> samples_per_second() const { return samples_per_second_; }

 private:
  void skip_line() {
    while (!at_line_end()) scanner_.skip();
  }
  [[nodiscard]] bool at_line_end() const {
    const char next = scanner_.peek();
    return next == '\n' || next == '\r' || scanner_.at_end();
  }
  /// To the next line that is no comment; false at the end.
  [[nodiscard]] bool next_line() {
    scanner_.skip_space();
    while (scanner_.peek() == '#') {
      skip_line();
      scanner_.skip_space();
    }
    return !scanner_.at_end();
  }

  /// Up to the first frame's number; false if there is none.
  [[nodiscard]] bool read_header() {
    while (next_line()) {
      if (is_digit(scanner_.peek())) return true;
      const std::size_t begin = scanner_.offset();
      const std::string_view word = scanner_.word();
      if (!word.starts_with(':')) {
        scanner_.fail_at(begin, "expected a frame's number before " + quoted(word));
      }
      read_keyword(word, begin);
      skip_line();
    }
    return false;
  }

  void read_keyword(std::string_view word, std::size_t begin) {
    if (equal_but_for_case(word, ":degrees")) {
      degrees_ = true;
    } else if (equal_but_for_case(word, ":radians")) {
      degrees_ = false;
    } else if (equal_but_for_case(word, ":samples-per-second")) {
      scanner_.skip_blanks();
      samples_per_second_ = scanner_.number();
      if (!(*samples_per_second_ > 0.0 && *samples_per_second_ <= 1e6)) {
        scanner_.fail_at(begin,
                         ":SAMPLES-PER-SECOND must be greater than 0 and at most 1e6; give the "
                         "frame rate (--fps) instead");
      }
    } else if (!equal_but_for_case(word, ":fully-specified")) {
      warnings_.add_once("keyword", begin, quoted(word) + " is ignored");
    }
  }

  void reserve() {
    const std::size_t frames = count_frames(text_);
    const std::size_t most = std::max(kFreeRotations, text_.size() / kBytesARotation);
    if (frames > most / asf_.joints.size()) {
      scanner_.fail_at(0, std::to_string(frames) + " frames of " +
                              std::to_string(asf_.joints.size()) +
                              " bones, most without dof, are more than is read from a file of "
                              "this size; remove the bones without dof from the skeleton");
    }
    motion_.rotations.reserve(frames * asf_.joints.size());
    if (translates_) motion_.translations.reserve(frames * asf_.joints.size());
    motion_.root_positions.reserve(frames);
  }

  /// One frame, from its number on; false at the end of the file.
  [[nodiscard]] bool read_frame() {
    const std::size_t begin = scanner_.offset();
    read_frame_number(begin);
    ++motion_.frame_count;
    std::fill(values_.begin(), values_.end(), JointValues());
    bool more = next_line();
    while (more && !is_digit(scanner_.peek())) {
      read_bone();
      more = next_line();
    }
    require_all_bones(begin);
    store();
    return more;
  }

  void read_frame_number(std::size_t begin) {
    const double number = scanner_.number();
    scanner_.skip_blanks();
    if (!at_line_end()) {
      scanner_.fail_at(scanner_.offset(), "a frame's number stands on a line of its own");
    }
    const double expected = motion_.frame_count == 0 ? 1.0 : last_number_ + 1.0;
    if (number != expected) {
      warnings_.add_once("frame number", begin,
                         "frame " + std::string(scanner_.text_between(begin, scanner_.offset())) +
                             " where " + std::to_string(static_cast<long long>(expected)) +
                             " is expected; frames are read one after the other as they stand");
    }
    // Kept within what a double counts exactly, so that the message above is a sane number.
    last_number_ = std::clamp(number, 0.0, 1e15);
  }

  /// Lines nearly always come in the order of the frame before, so the next is tried first.
  [[nodiscard]] std::size_t find_joint(std::string_view name, std::size_t begin) {
    if (line_ < order_.size()) {
      const std::size_t guess = order_[line_];
      if (asf_.skeleton->joint(static_cast<int>(guess)).name == name) return guess;
    }
    const auto found = index_.find(name);
    if (found == index_.end()) {
      scanner_.fail_at(begin, "the skeleton has no bone " + quoted(name) +
                                  "; give the .asf that belongs to this motion (--skeleton)");
    }
    return found->second;
  }

  void read_bone() {
    scanner_.skip_space();
    const std::size_t begin = scanner_.offset();
    const std::string_view name = scanner_.word();
    const std::size_t joint = find_joint(name, begin);
    if (seen_in_[joint] == motion_.frame_count) {
      scanner_.fail_at(begin, "bone " + quoted(name) + " stands twice in one frame");
    }
    seen_in_[joint] = motion_.frame_count;
    if (motion_.frame_count == 1) order_.push_back(joint);
    ++line_;
    read_values(joint, name);
  }

  void read_values(std::size_t joint, std::string_view name) {
    const std::vector<AsfDof>& dofs = asf_.joints[joint].dofs;
    JointValues& values = values_[joint];
    const double radians = degrees_ ? math::kDegree : 1.0;
    for (std::size_t i = 0; i < dofs.size(); ++i) {
      scanner_.skip_blanks();
      if (at_line_end()) fail_count(name, dofs.size(), i);
      const double value = scanner_.number();
      const auto kind = static_cast<Eigen::Index>(dofs[i]);
      if (dofs[i] == AsfDof::kLength) {
        values.stretch = value;
      } else if (is_rotation(dofs[i])) {
        turn(values.rotation, kind - static_cast<Eigen::Index>(AsfDof::kRx), radians * value);
      } else {
        values.shift[kind] = value;
      }
    }
    scanner_.skip_blanks();
    if (at_line_end()) return;
    std::size_t found = dofs.size();
    const std::size_t first_extra = scanner_.offset();
    for (; !at_line_end(); scanner_.skip_blanks()) {
      static_cast<void>(scanner_.number());
      ++found;
    }
    scanner_.fail_at(first_extra, count_message(name, dofs.size(), found));
  }

  [[nodiscard]] static std::string count_message(std::string_view name, std::size_t expected,
                                                 std::size_t found) {
    return "bone " + quoted(name) + " has " + std::to_string(expected) +
           " values in the skeleton, found " + std::to_string(found);
  }
  [[noreturn]] void fail_count(std::string_view name, std::size_t expected,
                               std::size_t found) const {
    scanner_.fail_at(scanner_.offset(), count_message(name, expected, found));
  }

  void require_all_bones(std::size_t frame_begin) {
    line_ = 0;
    for (std::size_t j = 0; j < seen_in_.size(); ++j) {
      if (seen_in_[j] == motion_.frame_count || asf_.joints[j].dofs.empty()) continue;
      scanner_.fail_at(frame_begin,
                       "this frame has no line for bone " +
                           quoted(asf_.skeleton->joint(static_cast<int>(j)).name) +
                           "; the file is cut short or belongs to another skeleton (--skeleton)");
    }
  }

  void store() {
    for (std::size_t j = 0; j < values_.size(); ++j) {
      const Quaterniond& axes = asf_.joints[j].axes;
      Quaterniond rotation = axes * values_[j].rotation;
      // The root's pre-set orientation turns the motion; a bone's axes only say where its x, y, z
      // are.
      if (j > 0) rotation = rotation * axes.conjugate();
      motion_.rotations.push_back(rotation.normalized());
    }
    motion_.root_positions.push_back(asf_.skeleton->joint(0).rest_offset + shift_of(0));
    if (!translates_) return;
    motion_.translations.push_back(motion_.root_positions.back());
    for (std::size_t j = 1; j < values_.size(); ++j) {
      const motion::Joint& joint = asf_.skeleton->joint(static_cast<int>(j));
      const auto parent = static_cast<std::size_t>(joint.parent);
      const Vector3d stretch =
          asf_.unit_m * values_[parent].stretch * asf_.joints[parent].direction;
      motion_.translations.push_back(joint.rest_offset + stretch + shift_of(j));
    }
  }

  [[nodiscard]] Vector3d shift_of(std::size_t joint) const {
    return asf_.unit_m * (asf_.joints[joint].axes * values_[joint].shift);
  }

  TextScanner& scanner_;
  std::string_view text_;
  const AsfFile& asf_;
  Warnings& warnings_;
  DraftMotion motion_;
  std::map<std::string_view, std::size_t> index_;  // joint of a name
  std::vector<std::size_t> order_;                 // joints in the order of the first frame
  std::vector<std::size_t> seen_in_;               // last frame, from 1, that had a joint's line
  std::vector<JointValues> values_;                // of the current frame
  std::optional<double> samples_per_second_;
  double last_number_ = 0.0;
  std::size_t line_ = 0;  // bones of the current frame so far
  bool degrees_ = true;
  bool translates_ = false;
};

Eigen::Matrix3Xd matrix_of(const std::vector<Vector3d>& columns) {
  if (columns.empty()) return {};
  return Eigen::Map<const Eigen::Matrix3Xd>(columns.front().data(), 3,
                                            static_cast<Eigen::Index>(columns.size()));
}

}  // namespace

std::vector<std::string> AmcReadOptions::problems() const {
  if (!frame_rate_hz || (*frame_rate_hz > 0.0 && *frame_rate_hz <= 1e6)) return {};
  return {"AmcReadOptions::frame_rate_hz = " + std::to_string(*frame_rate_hz) +
          " (must be > 0 and at most 1e6)"};
}

AmcFile read_amc(std::string_view text, std::string_view name, const AsfFile& skeleton,
                 const AmcReadOptions& options) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw base::Error(base::ErrorKind::kUsage, problems.front());
  TextScanner scanner(text, name);
  Warnings warnings(scanner);
  MotionReader reader(scanner, text, skeleton, warnings);
  DraftMotion motion = reader.read();
  const std::optional<double> told =
      options.frame_rate_hz ? options.frame_rate_hz : reader.samples_per_second();
  return {motion::Clip(skeleton.skeleton, told.value_or(kUsualAmcRateHz),
                       matrix_of(motion.root_positions), std::move(motion.rotations),
                       matrix_of(motion.translations)),
          !told.has_value(), warnings.take()};
}

}  // namespace laban::io
